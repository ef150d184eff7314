"""What is watched while the machine follows an order under low limits: that it goes the way that was asked for."""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.conductor import Moment
from torquerig.calibration.errors import WrongWay
from torquerig.control.errors import LimitExceeded
from torquerig.mechanism import Manipulator

Vector = NDArray[np.float64]

AGAINST: Final = 0.003
"""How far a joint may go against its order [rad]: 95 counts; joints that count right go 0 on all plants."""
APART: Final = 1e-3
"""How far the legs may miss each other [m]; our choice: three times what home calls unusable."""
STRAY: Final = 2e-3
"""How far the end-effector may leave its room beyond where it stood at first [m]; our choice."""
ADVICE: Final = "run torquerig calibrate direction, which names it"


class Room(NamedTuple):
    """Where the end-effector may be.

    Attributes:
        x: From and to [m].
        y: Likewise.
    """

    x: tuple[float, float]
    y: tuple[float, float]

    def outside(self, position: tuple[float, float]) -> float:
        """How far a position is outside, in x or in y [m]; 0 inside."""
        return max(max(low - value, value - high, 0.0) for value, (low, high) in zip(position, self, strict=True))

    def require(self, position: tuple[float, float], allowed: float) -> None:
        """See that a position is no farther outside than a machine may be that stood outside already.

        Raises:
            LimitExceeded: It is.
        """
        for axis, value, (low, high) in zip("xy", position, self, strict=True):
            # written so that NaN is outside
            if not low - allowed <= value <= high + allowed:
                raise LimitExceeded("workspace", axis, value, low if value < low else high, "m")


@dataclass(frozen=True, slots=True)
class Guard:
    """Looks at every cycle of a move.

    Attributes:
        model: The mechanism.
        begin: Joint angles where the move begins, shape (3,) [rad].
        order: By how much each joint is to turn, shape (3,) [rad].
        room: Where the end-effector may be.
    """

    model: Manipulator
    begin: Vector
    order: Vector
    room: Room

    def look(self, now: Moment) -> None:
        """See that all goes as ordered.

        Raises:
            WrongWay: A joint goes against its order, or the legs come apart: an axis counts the wrong way.
            LimitExceeded: The end-effector leaves its room.
            MechanismError: The angles are no pose.
        """
        ways = (now.q - self.begin) * np.sign(self.order)
        if against := np.flatnonzero((ways < -AGAINST) & (np.abs(self.order) > AGAINST)).tolist():
            axes = [str(axis + 1) for axis in against]
            moves = f"axis {axes[0]} moves" if len(axes) == 1 else f"axes {' and '.join(axes)} move"
            raise WrongWay(f"{moves} against the order: an axis is reversed; {ADVICE}")
        missed = float(np.abs(self.model.closure_residuals(now.q)).max())
        if not missed <= APART:
            raise WrongWay(
                f"the legs miss each other by {1e3 * missed:.2g} mm, {1e3 * APART:g} mm is the most: an axis is"
                f" reversed or swapped, or home is not home; {ADVICE}"
            )
        x, y = self.model.forward_kinematics(now.q).tolist()
        begin_x, begin_y = self.model.forward_kinematics(self.begin).tolist()
        self.room.require((x, y), self.room.outside((begin_x, begin_y)) + STRAY)
