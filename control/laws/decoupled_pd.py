"""Decoupled PD: every motor for itself (thesis 6.3, law 1)."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from torquerig.control.law import Desired, Gains, Law, Published, State, Torque
from torquerig.control.terms import Terms


@dataclass(frozen=True, slots=True)
class DecoupledPD(Law):
    """tau_m = kp (q_d - q) + kv (qd_d - qd).

    Options add S(S'S)^-1 Ft v_d / n, and stiction. Gains in N·m/rad and N·m·s/rad, from joint angles to *motor*
    torque: taken as joint torque they give errors of 8 to 9 mm (experiments.md, "Controllers").
    """

    name: ClassVar[str] = "decoupled-pd"
    gains: ClassVar[Mapping[int, Gains]] = MappingProxyType({1: Gains(18, 0.16), 2: Gains(32, 0.22)})
    published: ClassVar[Mapping[int, Published]] = MappingProxyType(
        {1: Published(1.2285, 0.0753, "thesis, Table 6.1"), 2: Published(1.9785, 0.1323, "thesis, Table 6.2")}
    )
    running_time_ns: ClassVar[int | None] = 2_710_000

    def torque(self, state: State, desired: Desired) -> NDArray[np.float64]:
        """Motor torques, shape (3,) [N·m at the motor]."""
        e = desired.q - state.q
        edot = desired.qd - state.qd
        tau = self.kp * e + self.kv * edot + self.stiction_torque(desired)
        if self.friction:
            F = self.model.task_viscous(state.position)
            tau += self.model.distribute(state.position, self.friction_force(F, desired))
        return tau

    def in_loop(self) -> Torque:
        """The same, compiled."""
        terms = Terms(joint_kp=self.kp, joint_kv=self.kv, friction=float(self.friction), stiction=self.stiction)
        return terms.torque(self.model)
