"""What is put around a law of what was measured on the rig: the time until torques act, and Coulomb friction.

A torque that is computed from a sample acts later: the command leaves, crosses the wire, and the drive takes its time.
With a lead d the law is asked for the torque of t + d. The machine is taken to go on as the reference does, so that its
errors stay what they are:

    X(t + d) = X + X_d(t + d) - X_d,   Xdot(t + d) = Xdot + v_d(t + d) - v_d,   q and qd likewise.

With Coulomb friction Fc each motor is given Fc sign(qd_d) beside the law's torque.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.law import Desired, State, Torque
from torquerig.control.reference import LEGS, NANOSECONDS_PER_SECOND, ReferenceTable
from torquerig.mechanism import Manipulator

Array = NDArray[np.float64]

SLICE: Final = 100
"""Rows that are worked out in one go: 3 ms of work."""


@dataclass(frozen=True, slots=True)
class Compensation:
    """What is put around a law.

    Attributes:
        lead: How long after its sample a torque acts [s]; 0: the law is asked for the sample's own instant.
        coulomb: Torque fed forward on each joint in the direction of its desired rate [N·m at the motor].
    """

    lead: float = 0.0
    coulomb: float = 0.0

    def around(self, torque: Torque) -> Torque:
        """The law with it; the law itself where there is nothing to compensate."""
        return _Compensated(torque, self.coulomb).torque if self.coulomb else torque

    def ahead(
        self, model: Manipulator, table: ReferenceTable, breathe: Callable[[], None] = lambda: None
    ) -> ReferenceTable | None:
        """What the law is to be asked for: the table's rows `lead` later, the last one at its end.

        Between two rows positions follow the polynomial of fifth order with the rows' velocities and accelerations.

        Args:
            model: The manipulator as the controller knows it, for the joints' part.
            table: From rest to rest.
            breathe: Called after each slice of the work.

        Returns:
            As many rows; None without a lead.
        """
        if not self.lead:
            return None
        period = table.period_ns / NANOSECONDS_PER_SECOND
        at = np.minimum(np.arange(len(table)) + self.lead / period, len(table) - 1)
        k = np.minimum(at.astype(np.intp), len(table) - 2)
        position, velocity, acceleration = _between(table, k, (at - k)[:, None], period)
        q, qd = np.empty((len(table), LEGS)), np.empty((len(table), LEGS))
        for row, (x, v) in enumerate(zip(position, velocity, strict=True)):
            q[row], qd[row] = model.inverse_kinematics(x).theta, model.joint_rates(x, v)[:LEGS]
            if row % SLICE == 0:
                breathe()
        return replace(table, position=position, velocity=velocity, acceleration=acceleration, q=q, qd=qd)

    @staticmethod
    def later(state: State, desired: Desired, asked: Desired) -> tuple[State, Desired]:
        """What the law is given: the state that is expected when its torque acts, and what is then asked for.

        Args:
            state: The manipulator as measured.
            desired: What the reference asks for at that instant.
            asked: What it asks for `lead` later.
        """
        expected = State(
            state.q + (asked.q - desired.q),
            state.qd + (asked.qd - desired.qd),
            state.position + (asked.position - desired.position),
            state.velocity + (asked.velocity - desired.velocity),
        )
        return expected, asked


NOTHING: Final = Compensation()
"""No compensation: the law as it is."""


class _Compensated:
    """A law's torque with Coulomb friction, with its buffer."""

    __slots__ = ("_coulomb", "_tau", "_torque")

    def __init__(self, torque: Torque, coulomb: float) -> None:
        self._torque, self._coulomb, self._tau = torque, coulomb, np.zeros(LEGS)

    def torque(self, state: State, desired: Desired) -> Array:
        """Motor torques, shape (3,) [N·m at the motor]; the same array every time."""
        np.sign(desired.qd, out=self._tau)
        self._tau *= self._coulomb
        self._tau += self._torque(state, desired)
        return self._tau


def _between(table: ReferenceTable, k: NDArray[np.intp], s: Array, period: float) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration at the share `s` of the way from row k to the next, shape (n, 2) each."""
    x0, v0, a0 = (part[k] for part in (table.position, table.velocity * period, table.acceleration * period**2))
    x1, v1, a1 = (part[k + 1] for part in (table.position, table.velocity * period, table.acceleration * period**2))
    way = x1 - x0 - v0 - a0 / 2
    turn = v1 - v0 - a0
    bend = a1 - a0
    c3 = 10.0 * way - 4.0 * turn + bend / 2
    c4 = -15.0 * way + 7.0 * turn - bend
    c5 = 6.0 * way - 3.0 * turn + bend / 2
    position = x0 + s * (v0 + s * (a0 / 2 + s * (c3 + s * (c4 + s * c5))))
    velocity = v0 + s * (a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))
    acceleration = a0 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5))
    return position, velocity / period, acceleration / period**2
