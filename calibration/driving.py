"""Driving the machine along a motion under a control law, within the bounds that were agreed, and what comes of it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.conductor import SECOND_NS, Conductor
from torquerig.control.log import LoopLog
from torquerig.control.loop import Controller, Pace, run_loop
from torquerig.control.motions import Hold, Motion, Reference, SmoothMove
from torquerig.control.reference import Piece, ReferenceTable, tabulate

Array = NDArray[np.float64]

_SPEED: Final = 0.05
"""Of the way to a motion's start [m/s], and ..."""
_ACCELERATION: Final = 0.5
"""... [m/s²]: as approach.speed and approach.acceleration of the shipped configuration."""
_STILL: Final = 0.1
"""Standing still before and after a motion [s]."""
_SLICE: Final = 0.1
"""Of the way that is worked out in one go [s]: the bus must not wait longer than a period."""
_COMMAND_AFTER: Final = 4
"""Torques leave a fourth of a period after SYNC: later than they are ready, so that the delay is the same each time."""


@dataclass(frozen=True, slots=True)
class _Part:
    """A stretch of a motion."""

    motion: Motion
    begin: float
    duration: float

    def at(self, t: float) -> Reference:
        """What the motion asks for `t` seconds after the part's begin [s]."""
        return self.motion.at(self.begin + min(max(t, 0.0), self.duration))


def prepare(controller: Controller, motion: Motion, period_ns: int) -> ReferenceTable:
    """A motion with a hold before and after it as a table, held against the loop's limits.

    Args:
        controller: Its model and limits.
        motion: From rest to rest.
        period_ns: Sampling period.

    Raises:
        LimitExceeded, ReachError: The motion leaves what the machine may do.
    """
    start, end = (_place(motion.at(t).position) for t in (0.0, motion.duration))
    pieces = [Piece(Hold(start, _STILL)), Piece(motion, in_motion=True), Piece(Hold(end, _STILL))]
    table = tabulate(controller.model, pieces, period_ns)
    controller.limits.check_reference(controller.model, table)
    return table


def follow(conductor: Conductor, controller: Controller, table: ReferenceTable, words: str) -> LoopLog:
    """Bring the machine to the start of a table, and run it.

    Args:
        conductor: The machine, homed and enabled.
        controller: Drives it.
        table: As `prepare` makes them.
        words: What is being done.

    Returns:
        The table's cycles.

    Raises:
        LimitExceeded: A bound that was agreed to, or a limit of the loop.
        DriveFault, NoAnswer, SecondMaster, BusError: As in `AxisGroup.sample`.
    """
    here = conductor.rest("looking where it stands", 0.0).q[-1]
    begin = _place(controller.model.forward_kinematics(here))
    move = SmoothMove.within(begin, _place(table.position[0]), speed=_SPEED, acceleration=_ACCELERATION)
    approach = []
    for stretch in _parts(move):
        approach.append(tabulate(controller.model, [Piece(stretch)], table.period_ns))
        controller.limits.check_reference(controller.model, approach[-1])
        conductor.group.wait(0.0)
    conductor.say(words)
    conductor.notebook.begin(words)
    pace = Pace(command_after_ns=table.period_ns // _COMMAND_AFTER)
    for part in [*approach, table]:
        log = LoopLog.for_table(part)
        run_loop(conductor, controller, part, log, stopwatch_ns=conductor.now_ns, pace=pace)
    conductor.rest("standing still", 0.0)
    return log


def motion_rows(log: LoopLog) -> slice:
    """The rows of a log that belong to its motion."""
    inside = np.flatnonzero(log.in_motion[: log.rows])
    return slice(int(inside[0]), int(inside[-1]) + 1)


def lasts(table: ReferenceTable) -> float:
    """How long a table takes [s]."""
    return len(table) * table.period_ns / SECOND_NS


def _parts(move: SmoothMove) -> Iterator[_Part]:
    count = int(move.duration // _SLICE)
    for number in range(count):
        yield _Part(move, number * _SLICE, _SLICE)
    yield _Part(move, count * _SLICE, move.duration - count * _SLICE)


def _place(position: Array) -> tuple[float, float]:
    x, y = position.tolist()
    return x, y
