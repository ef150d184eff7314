"""A whole experiment's reference as arrays: approach, hold, motion, hold, sampled before the loop starts."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.control.law import Desired
from torquerig.control.motions import Hold, Motion, SmoothMove
from torquerig.control.row import POSITION, QD, STATE, VELOCITY, Q
from torquerig.mechanism import Manipulator

NANOSECONDS_PER_SECOND: Final = 1_000_000_000
LEGS: Final = 3
"""Active joints, the first of all joints' rates."""
ACCELERATION: Final = STATE
"""A row of a reference table is a state as in `Row`, and the acceleration."""
ASKED: Final = ACCELERATION + 2


class Piece(NamedTuple):
    """A part of an experiment.

    Attributes:
        motion: How the end-effector moves in it.
        in_motion: Whether its samples are the motion's, the ones that count.
    """

    motion: Motion
    in_motion: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceTable:
    """One row a cycle.

    Attributes:
        period_ns: Sampling period.
        position: X_d, shape (n, 2) [m].
        velocity: v_d, shape (n, 2) [m/s].
        acceleration: a_d, shape (n, 2) [m/s²].
        q: Joint angles at X_d, shape (n, 3) [rad].
        qd: Joint rates S v_d, shape (n, 3) [rad/s].
        in_motion: Whether the row belongs to the motion, shape (n,).
        rows: All but that in one array, as kernels take it, shape (n, ASKED); the others are views of it.
    """

    period_ns: int
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    q: NDArray[np.float64]
    qd: NDArray[np.float64]
    in_motion: NDArray[np.bool_]
    rows: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Lay the arrays out as kernels are compiled for them: they would be compiled anew for any other layout."""
        parts = {"q": Q, "qd": QD, "position": POSITION, "velocity": VELOCITY, "acceleration": ACCELERATION}
        rows = np.concatenate([getattr(self, name) for name in parts], axis=1, dtype=np.float64)
        object.__setattr__(self, "rows", rows)
        for (name, begin), end in zip(parts.items(), (*list(parts.values())[1:], ASKED), strict=True):
            object.__setattr__(self, name, rows[:, begin:end])

    def __len__(self) -> int:
        return len(self.position)

    def row(self, k: int) -> Desired:
        """What cycle `k` asks for, as views."""
        return Desired(self.position[k], self.velocity[k], self.acceleration[k], self.q[k], self.qd[k])


def in_row(desired: Desired) -> tuple[NDArray[np.float64], ...]:
    """What is asked for in the order of a table's row."""
    return desired.q, desired.qd, desired.position, desired.velocity, desired.acceleration


def samples_in(duration: float, period_ns: int) -> int:
    """Sampling instants in [0, duration): 50 in 200 ms at 4 ms.

    Args:
        duration: A piece's duration [s].
        period_ns: Sampling period.

    Returns:
        How many; a remainder that is shorter than a period has one too.
    """
    return -(-round(duration * NANOSECONDS_PER_SECOND) // period_ns)


def tabulate(model: Manipulator, pieces: Sequence[Piece], period_ns: int) -> ReferenceTable:
    """Sample pieces one after another.

    Each piece begins on a sampling instant, and the last ends with one sample at its end. As pieces start and end at
    rest, and one starts where the one before ended, position and velocity are continuous.

    Args:
        model: The manipulator as the controller knows it, for the joints' part.
        pieces: The parts in order, at least one.
        period_ns: Sampling period.

    Returns:
        The table.

    Raises:
        ValueError: If there is no piece, or a piece does not start where the one before ended.
    """
    if not pieces:
        raise ValueError("a reference table of no pieces")
    rows, counted = [], []
    end = pieces[0].motion.at(0.0).position
    for motion, in_motion in pieces:
        begin = motion.at(0.0).position
        if not np.allclose(begin, end, rtol=0.0, atol=1e-9):
            raise ValueError(f"a piece starts at {begin} m, where the one before ended at {end} m")
        n = samples_in(motion.duration, period_ns)
        rows += [motion.at(k * period_ns / NANOSECONDS_PER_SECOND) for k in range(n)]
        counted += [in_motion] * n
        end = motion.at(motion.duration).position
    rows.append(pieces[-1].motion.at(pieces[-1].motion.duration))
    counted.append(False)
    position, velocity, acceleration = (np.array(column) for column in zip(*rows, strict=True))
    q = np.array([model.inverse_kinematics(x).theta for x in position])
    qd = np.array([model.joint_rates(x, v)[:LEGS] for x, v in zip(position, velocity, strict=True)])
    return ReferenceTable(period_ns, position, velocity, acceleration, q, qd, np.array(counted))


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What surrounds the motion of an experiment.

    Attributes:
        speed: Greatest speed of the approach [m/s].
        acceleration: Greatest acceleration of the approach [m/s²].
        before: Hold between approach and motion [s].
        after: Hold after the motion [s].
    """

    speed: float
    acceleration: float
    before: float
    after: float


def experiment_table(
    model: Manipulator,
    motion: Motion,
    *,
    stands_at: tuple[float, float],
    repeats: int,
    period_ns: int,
    around: Surroundings,
) -> ReferenceTable:
    """Approach, hold, the motion several times, hold.

    Args:
        model: The manipulator as the controller knows it.
        motion: The motion; it has to end where it starts when it is repeated.
        stands_at: Where the machine stands, (x, y) [m].
        repeats: How many times the motion runs, 1 or more.
        period_ns: Sampling period.
        around: Approach and holds.

    Returns:
        The table; only the motion's samples are `in_motion`.

    Raises:
        ValueError: If `repeats` is below 1, or a bound of the approach is not positive.
    """
    if repeats < 1:
        raise ValueError(f"{repeats} repeats of a motion: 1 is the least")
    start, end = _place(motion, 0.0), _place(motion, motion.duration)
    approach = SmoothMove.within(stands_at, start, speed=around.speed, acceleration=around.acceleration)
    pieces = [
        Piece(approach),
        Piece(Hold(start, around.before)),
        *[Piece(motion, in_motion=True)] * repeats,
        Piece(Hold(end, around.after)),
    ]
    return tabulate(model, pieces, period_ns)


def _place(motion: Motion, t: float) -> tuple[float, float]:
    """Where a motion is at a time, (x, y) [m]."""
    x, y = motion.at(t).position.tolist()
    return x, y
