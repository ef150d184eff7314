"""Computed torque, without its small Coriolis term (thesis 6.3, law 4)."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from torquerig.control.law import Desired, Gains, Law, Published, State, Torque
from torquerig.control.terms import Terms


@dataclass(frozen=True, slots=True)
class ComputedTorque(Law):
    """tau_m = S(S'S)^-1 Mt (a_d + kv edot + kp e) / n, e = X_d - X.

    Options add Ft v_d to the force, and stiction. Gains in 1/s² and 1/s.
    """

    name: ClassVar[str] = "computed-torque"
    gains: ClassVar[Mapping[int, Gains]] = MappingProxyType({1: Gains(3000, 120), 2: Gains(6000, 300)})
    published: ClassVar[Mapping[int, Published]] = MappingProxyType(
        {1: Published(0.9592, 0.0436, "thesis, Table 6.1"), 2: Published(0.9778, 0.0547, "thesis, Table 6.2")}
    )
    running_time_ns: ClassVar[int | None] = 3_180_000
    friction_by_default: ClassVar[bool] = True

    def torque(self, state: State, desired: Desired) -> NDArray[np.float64]:
        """Motor torques, shape (3,) [N·m at the motor]."""
        M, _, F, _ = self.model.dynamics(state.position, state.velocity)
        e = desired.position - state.position
        edot = desired.velocity - state.velocity
        force = M @ (desired.acceleration + self.kv * edot + self.kp * e) + self.friction_force(F, desired)
        return self.model.distribute(state.position, force) + self.stiction_torque(desired)

    def in_loop(self) -> Torque:
        """The same, compiled."""
        terms = Terms(
            inertia=1.0,
            inertia_kp=self.kp,
            inertia_kv=self.kv,
            friction=float(self.friction),
            stiction=self.stiction,
        )
        return terms.torque(self.model)
