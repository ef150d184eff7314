"""The reference of a run, made in two parts: what is known beforehand, and the approach from where the machine stands.

While the drives are on the bus, nobody but this thread sends the master's heartbeat: what takes long is done before the
bus is opened, and what can only be done then is done in slices.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from torquerig.building import period_ns
from torquerig.control.loop import Controller
from torquerig.control.motions import Hold, Motion, Reference, SmoothMove
from torquerig.control.reference import Piece, ReferenceTable, tabulate
from torquerig.motions import choose_motion
from torquerig.schema import Rig

SLICE: Final = 100
"""Cycles of a slice: 3 ms of work."""


@dataclass(frozen=True, slots=True)
class Excerpt:
    """A part of a motion.

    Attributes:
        motion: The motion.
        begin: When the part begins [s].
        duration: How long it lasts [s].
    """

    motion: Motion
    begin: float
    duration: float

    def at(self, t: float) -> Reference:
        """What the motion asks for `t` seconds after the part's begin [s]."""
        return self.motion.at(self.begin + min(max(t, 0.0), self.duration))


def plan_motion(rig: Rig, controller: Controller) -> ReferenceTable:
    """Hold, the motion as often as `loop.repeat` says, hold; held against the limits.

    A motion that does not end where it starts is followed by a smooth move back and a hold before it is run again.

    Args:
        rig: The configuration.
        controller: Its model and limits.

    Returns:
        One row a cycle.

    Raises:
        MotionError: A motion of the user cannot be read, or leaves what the machine may do.
        ReachError, LimitExceeded: The motion leaves what the machine may do.
    """
    chosen, around = choose_motion(rig, controller.model), rig.approach
    again = []
    if not chosen.is_closed:
        back = SmoothMove.within(chosen.end, chosen.start, speed=around.speed, acceleration=around.acceleration)
        again = [Piece(back), Piece(Hold(chosen.start, around.hold_before))]
    once = Piece(chosen.motion, in_motion=True)
    pieces = [Piece(Hold(chosen.start, around.hold_before)), once]
    pieces += [*again, once] * (rig.loop.repeat - 1)
    pieces += [Piece(Hold(chosen.end, around.hold_after))]
    return _checked(controller, pieces, period_ns(rig))


def plan_approach(
    rig: Rig,
    controller: Controller,
    stands_at: tuple[float, float],
    start: tuple[float, float],
    breathe: Callable[[], None],
) -> list[ReferenceTable]:
    """A smooth move from where the machine stands to the start of the motion, held against the limits.

    Args:
        rig: The configuration.
        controller: Its model and limits.
        stands_at: Where the machine stands, (x, y) [m].
        start: Where the motion starts, (x, y) [m].
        breathe: Called after each slice, to serve the bus.

    Returns:
        One row a cycle, in slices; each ends with the row with which the next begins.

    Raises:
        ReachError, LimitExceeded: The way leaves what the machine may do.
    """
    around = rig.approach
    move = SmoothMove.within(stands_at, start, speed=around.speed, acceleration=around.acceleration)
    slices = []
    for part in _excerpts(move, SLICE * period_ns(rig) / 1e9):
        slices.append(_checked(controller, [Piece(part, in_motion=False)], period_ns(rig)))
        breathe()
    return slices


def join(parts: Sequence[ReferenceTable]) -> ReferenceTable:
    """Several tables as one.

    Args:
        parts: The tables; each but the last ends with the row with which the next begins.

    Returns:
        All rows, those that are there twice once.
    """
    *leading, last = parts

    def rows(name: str) -> np.ndarray:
        return np.concatenate([*(getattr(part, name)[:-1] for part in leading), getattr(last, name)])

    return ReferenceTable(
        last.period_ns,
        position=rows("position"),
        velocity=rows("velocity"),
        acceleration=rows("acceleration"),
        q=rows("q"),
        qd=rows("qd"),
        in_motion=rows("in_motion"),
    )


def _excerpts(motion: Motion, duration: float) -> Iterator[Excerpt]:
    """A motion in parts of one duration, the last one shorter."""
    count = int(motion.duration // duration)
    for number in range(count):
        yield Excerpt(motion, number * duration, duration)
    yield Excerpt(motion, count * duration, motion.duration - count * duration)


def _checked(controller: Controller, pieces: Sequence[Piece], period: int) -> ReferenceTable:
    """A table of pieces, held against the limits."""
    table = tabulate(controller.model, pieces, period)
    controller.limits.check_reference(controller.model, table)
    return table
