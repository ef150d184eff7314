"""The control loop: absolute deadlines on the joints' own clock, one cycle a row of the reference table."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from torquerig.control.compensation import NOTHING, Compensation
from torquerig.control.computing import Compute, Merged, Stepped
from torquerig.control.estimators import Estimator
from torquerig.control.joints import Joints
from torquerig.control.law import Law, Torque
from torquerig.control.limits import Limits
from torquerig.control.log import LoopLog
from torquerig.control.log_writer import LogWriter
from torquerig.control.observer import Observer
from torquerig.control.reference import ReferenceTable
from torquerig.control.row import Row
from torquerig.control.terms import TermsTorque
from torquerig.mechanism import Manipulator


@dataclass(frozen=True, slots=True)
class Controller:
    """Everything between a sample and a command. What it gives is in buffers, and holds until the next sample.

    Attributes:
        model: The manipulator as the controller knows it.
        estimator: Joint rates from joint angles.
        law: The control law.
        limits: What stops the machine.
        compensation: What is put around the law of what was measured.
        torque: The law with the compensation, as the loop calls it unless it merges it into a call of its own.
    """

    model: Manipulator
    estimator: Estimator
    law: Law
    limits: Limits
    compensation: Compensation = NOTHING
    torque: Torque = field(init=False, repr=False, compare=False)
    _work: Merged | Stepped = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        law = self.law.in_loop()
        object.__setattr__(self, "torque", self.compensation.around(law))
        object.__setattr__(self, "_work", self._work_of(law))

    def _work_of(self, law: Torque) -> Merged | Stepped:
        """How a cycle's work is done: with a law that the compiled call knows, or with one that it calls."""
        if isinstance(law, TermsTorque):
            return Merged(self.model, self.estimator, self.limits, law.coefficients, self.compensation.coulomb)
        return Stepped(self.model, Observer(self.model, self.estimator), self.limits, self.torque)

    def along(self, table: ReferenceTable, ahead: ReferenceTable | None, row: Row) -> Compute:
        """What a cycle computes, along a reference: laid out once, so that little is left to be done in a cycle.

        Args:
            table: What to follow.
            ahead: What the law is asked for instead of the table's rows, as `Compensation.ahead` gives it.
            row: Filled in each cycle with what was measured and is to be commanded.
        """
        return self._work.along(table, ahead, row)


@dataclass(frozen=True, slots=True)
class Pace:
    """When a cycle's parts happen.

    Attributes:
        command_after_ns: When torques leave, after the cycle's due time; as soon as they are computed when None.
        tolerance_ns: How late a cycle may begin and still be run; one period when None.
        start_ns: When the first cycle is due; one period from now when None.
    """

    command_after_ns: int | None = None
    tolerance_ns: int | None = None
    start_ns: int | None = None

    def schedule(self, period_ns: int, now_ns: int) -> "Schedule":
        """The times that count, for a sampling period, at a moment.

        Raises:
            ValueError: If torques would leave before the cycle's due time, or a period or more after it.
        """
        after = 0 if self.command_after_ns is None else self.command_after_ns
        if not 0 <= after < period_ns:
            raise ValueError(f"torques that leave {after} ns after the due time: 0 to {period_ns - 1} ns can be had")
        return Schedule(
            start_ns=now_ns + period_ns if self.start_ns is None else self.start_ns,
            period_ns=period_ns,
            command_after_ns=after,
            tolerance_ns=period_ns if self.tolerance_ns is None else self.tolerance_ns,
        )


@dataclass(frozen=True, slots=True)
class Schedule:
    """A pace with all its times settled.

    Attributes:
        start_ns: When the first cycle is due.
        period_ns: Sampling period.
        command_after_ns: When torques leave at the earliest, after the cycle's due time.
        tolerance_ns: How late a cycle may begin and still be run.
    """

    start_ns: int
    period_ns: int
    command_after_ns: int
    tolerance_ns: int


@dataclass(frozen=True, slots=True)
class Progress:
    """Who is told how far the loop is, outside the timed part of a cycle.

    Attributes:
        tell: Called with the number of cycles done; it has to be quick, as it delays the next cycle.
        every: Cycles between two calls.
    """

    tell: Callable[[int], None]
    every: int


def run_loop(
    joints: Joints,
    controller: Controller,
    table: ReferenceTable,
    log: LoopLog,
    *,
    stopwatch_ns: Callable[[], int],
    pace: Pace = Pace(),
    progress: Progress | None = None,
    ahead: ReferenceTable | None = None,
) -> LoopLog:
    """Run one cycle for every row of a reference table, and return the log.

    Cycle k is due at start + k periods. One that could only begin later than the tolerance is skipped and counted; the
    reference goes on, and nothing is caught up in a burst. An incomplete sample is used and counted.

    Args:
        joints: The machine; the loop lives on its clock.
        controller: From a sample to torques.
        table: What to follow.
        log: `LoopLog.for_table(table)`; after an exception, what was until then.
        stopwatch_ns: A monotonic count of ns, for the cycle's own work.
        pace: When a cycle's parts happen.
        progress: Whom to tell.
        ahead: What the law is asked for instead of the table's rows, as `Compensation.ahead` gives it.

    Raises:
        LimitExceeded: If a limit is violated; no torque is commanded in that cycle.
        ValueError: If torques would leave outside the cycle's period.
    """
    cycle = _Cycle(joints, controller, table, log, stopwatch_ns, ahead)
    controller.estimator.reset()
    schedule = pace.schedule(table.period_ns, joints.now_ns())
    log.start_ns = schedule.start_ns
    for k in range(len(table)):
        cycle.run(k, schedule)
        if progress is not None and (k + 1) % progress.every == 0:
            progress.tell(k + 1)
    return log


class _Cycle:
    """What every cycle needs, laid out once: as in `run_loop`."""

    __slots__ = ("_command", "_compute", "_log", "_now_ns", "_row", "_sample", "_stopwatch_ns", "_writer")

    def __init__(  # noqa: PLR0917  (what a loop is made of)
        self,
        joints: Joints,
        controller: Controller,
        table: ReferenceTable,
        log: LoopLog,
        stopwatch_ns: Callable[[], int],
        ahead: ReferenceTable | None,
    ) -> None:
        self._log = log
        self._now_ns, self._sample, self._command = joints.now_ns, joints.sample, joints.command
        self._stopwatch_ns = stopwatch_ns
        self._row = Row()
        self._compute = controller.along(table, ahead, self._row)
        self._writer = LogWriter(log, self._row)

    def run(self, k: int, schedule: Schedule) -> None:
        """Sample, compute, command and write down what happened; or skip the cycle, if it is too late for it.

        Args:
            k: The cycle's row.
            schedule: The times that count.

        Raises:
            LimitExceeded: If a limit is violated.
        """
        now_ns, look_ns, row = self._now_ns, self._stopwatch_ns, self._row
        due = schedule.start_ns + k * schedule.period_ns
        late = now_ns() - due
        if late > schedule.tolerance_ns:
            self._log.skip(k, late)
            return
        sample = self._sample(due)
        sampled = now_ns() - due
        began = look_ns()
        try:
            clipped = self._compute(k, sample)
            law = look_ns() - began
            self._command(row.tau, due + schedule.command_after_ns)
        except BaseException:
            row.tau[:] = np.nan  # nobody was commanded
            self._writer.write(k, sample, sampled, sample.at_ns - due)
            raise
        left = now_ns() - due
        began = look_ns()
        self._writer.write(k, sample, sampled, sample.at_ns - due)
        self._writer.finish(k, clipped, left, law, law + look_ns() - began)
