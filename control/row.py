"""The numbers of a cycle in one buffer, one behind the other: how the loop, its kernel and its log hand them on."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.joints import JointSample

# layout of a row
Q: Final = 0
QD: Final = 3
POSITION: Final = 6
VELOCITY: Final = 8
TAU_LAW: Final = 10
TAU: Final = 13
TAU_ACTUAL: Final = 16
TPDO: Final = 19
ROW: Final = 22

STATE: Final = TAU_LAW
"""The first numbers are the state's: q, qd, position, velocity."""

_AXES: Final = 3
_UNKNOWN: Final = np.full(_AXES, np.nan)


class Row:
    """One cycle's numbers, and views of them that are made once.

    Attributes:
        numbers: All of them, shape (ROW,).
        q: Measured joint angles, shape (3,) [rad].
        position: Measured position of the end-effector, shape (2,) [m].
        tau_law: Motor torques that the law asked for, shape (3,) [N·m at the motor].
        tau: Motor torques to be commanded, shape (3,) [N·m at the motor].
    """

    __slots__ = ("_computed", "_tau_actual", "_tpdo", "numbers", "position", "q", "tau", "tau_law")

    def __init__(self) -> None:
        """A row in which nothing is known."""
        self.numbers: Final = np.full(ROW, np.nan)
        self.q: Final = self.numbers[Q:QD]
        self.position: Final = self.numbers[POSITION:VELOCITY]
        self.tau_law: Final = self.numbers[TAU_LAW:TAU]
        self.tau: Final = self.numbers[TAU:TAU_ACTUAL]
        self._computed: Final = self.numbers[:TAU_ACTUAL]
        # memoryviews, as numpy takes twice as long to copy three numbers; type checkers take them all for bytes
        self._tau_actual: Final[Any] = self.numbers.data[TAU_ACTUAL:TPDO]
        self._tpdo: Final[Any] = self.numbers.data[TPDO:ROW]

    def report(self, sample: JointSample) -> None:
        """Take from a sample what no law needs: actual torques, and when each axis answered."""
        answered_ns = sample.answered_ns
        self._tau_actual[:] = sample.torque
        self._tpdo[:] = _UNKNOWN if answered_ns is None else answered_ns

    def begin(self, sample: JointSample) -> None:
        """Take a sample's joint angles; nothing is computed from them yet."""
        self._computed[:] = np.nan
        self.q[:] = sample.q


def columns(table: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """A table of rows by what stands in them, views.

    Args:
        table: Shape (n, ROW).
    """
    begins = {
        "q": Q,
        "qd": QD,
        "position": POSITION,
        "velocity": VELOCITY,
        "tau_law": TAU_LAW,
        "tau": TAU,
        "tau_actual": TAU_ACTUAL,
        "tpdo_ns": TPDO,
    }
    ends = (*list(begins.values())[1:], ROW)
    return {name: table[:, begin:end] for (name, begin), end in zip(begins.items(), ends, strict=True)}
