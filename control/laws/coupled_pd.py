"""Coupled PD: a spring and a damper in the plane, shared among the motors (thesis 6.3, law 2)."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from torquerig.control.law import Desired, Gains, Law, Published, State, Torque
from torquerig.control.terms import Terms


@dataclass(frozen=True, slots=True)
class CoupledPD(Law):
    """tau_m = S(S'S)^-1 (kp e + kv edot) / n, e = X_d - X.

    Options add Ft v_d to the force, and stiction. Gains in N/m and N·s/m.
    """

    name: ClassVar[str] = "coupled-pd"
    gains: ClassVar[Mapping[int, Gains]] = MappingProxyType({1: Gains(28000, 700), 2: Gains(38000, 1200)})
    published: ClassVar[Mapping[int, Published]] = MappingProxyType(
        {1: Published(1.5021, 0.0565, "thesis, Table 6.1"), 2: Published(1.7220, 0.1024, "thesis, Table 6.2")}
    )
    running_time_ns: ClassVar[int | None] = 2_810_000

    def torque(self, state: State, desired: Desired) -> NDArray[np.float64]:
        """Motor torques, shape (3,) [N·m at the motor]."""
        e = desired.position - state.position
        edot = desired.velocity - state.velocity
        force = self.kp * e + self.kv * edot
        if self.friction:
            force += self.friction_force(self.model.task_viscous(state.position), desired)
        return self.model.distribute(state.position, force) + self.stiction_torque(desired)

    def in_loop(self) -> Torque:
        """The same, compiled."""
        terms = Terms(kp=self.kp, kv=self.kv, friction=float(self.friction), stiction=self.stiction)
        return terms.torque(self.model)
