"""Augmented PD: a PD law beside the model along the reference (thesis 6.3, law 3)."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from torquerig.control.law import Desired, Gains, Law, Published, State, Torque
from torquerig.control.terms import Terms


@dataclass(frozen=True, slots=True)
class AugmentedPD(Law):
    """tau_m = S(S'S)^-1 (Mt a_d + Ct v_d + kp e + kv edot) / n, e = X_d - X.

    Options add Ft v_d to the force, and stiction. Gains in N/m and N·s/m.
    """

    name: ClassVar[str] = "augmented-pd"
    gains: ClassVar[Mapping[int, Gains]] = MappingProxyType({1: Gains(8500, 400), 2: Gains(14000, 700)})
    published: ClassVar[Mapping[int, Published]] = MappingProxyType(
        {1: Published(1.0447, 0.0471, "thesis, Table 6.1"), 2: Published(0.7143, 0.0606, "thesis, Table 6.2")}
    )
    running_time_ns: ClassVar[int | None] = 2_810_000
    friction_by_default: ClassVar[bool] = True

    def torque(self, state: State, desired: Desired) -> NDArray[np.float64]:
        """Motor torques, shape (3,) [N·m at the motor]."""
        M, C, F, _ = self.model.dynamics(state.position, state.velocity)
        e = desired.position - state.position
        edot = desired.velocity - state.velocity
        force = M @ desired.acceleration + C @ desired.velocity + self.kp * e + self.kv * edot
        force += self.friction_force(F, desired)
        return self.model.distribute(state.position, force) + self.stiction_torque(desired)

    def in_loop(self) -> Torque:
        """The same, compiled."""
        terms = Terms(
            inertia=1.0,
            coriolis=1.0,
            friction=float(self.friction),
            kp=self.kp,
            kv=self.kv,
            stiction=self.stiction,
        )
        return terms.torque(self.model)
