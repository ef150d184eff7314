"""The control loop: absolute deadlines on the joints' own clock, one cycle a row of the reference table."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from torquerig.control.compensation import NOTHING, Compensation
from torquerig.control.estimators import Estimator
from torquerig.control.joints import Joints, JointSample
from torquerig.control.law import Law, State, Torque
from torquerig.control.limits import Limits
from torquerig.control.log import LoopLog
from torquerig.control.observer import Observer
from torquerig.control.reference import ReferenceTable
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
        torque: The law as the loop calls it, with the compensation.
    """

    model: Manipulator
    estimator: Estimator
    law: Law
    limits: Limits
    compensation: Compensation = NOTHING
    torque: Torque = field(init=False, repr=False, compare=False)
    _observer: Observer = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "torque", self.compensation.around(self.law.in_loop()))
        object.__setattr__(self, "_observer", Observer(self.model, self.estimator))

    def observe(self, sample: JointSample) -> State:
        """The state of the manipulator from a sample.

        Args:
            sample: The joints now.

        Returns:
            Joint angles and rates as estimated, the end-effector by forward kinematics, its velocity by least squares.
        """
        return self._observer.observe(sample)


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
    cycle = _Cycle(joints, controller, table, log, stopwatch_ns, pace.schedule(table.period_ns, joints.now_ns()), ahead)
    controller.estimator.reset()
    log.start_ns = cycle.schedule.start_ns
    for k in range(len(table)):
        cycle.run(k)
        if progress is not None and (k + 1) % progress.every == 0:
            progress.tell(k + 1)
    return log


@dataclass(frozen=True, slots=True)
class _Cycle:
    """What every cycle needs, as in `run_loop`, and the buffer of the torques, which it uses every time."""

    joints: Joints
    controller: Controller
    table: ReferenceTable
    log: LoopLog
    stopwatch_ns: Callable[[], int]
    schedule: Schedule
    ahead: ReferenceTable | None
    command: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))

    def run(self, k: int) -> None:
        """Sample, compute, command and write down what happened; or skip the cycle, if it is too late for it.

        Args:
            k: The cycle's row.

        Raises:
            LimitExceeded: If a limit is violated.
        """
        joints, log, schedule = self.joints, self.log, self.schedule
        due = schedule.start_ns + k * schedule.period_ns
        late = joints.now_ns() - due
        if late > schedule.tolerance_ns:
            log.skip(k, late)
            return
        sample = joints.sample(due)
        sampled = joints.now_ns()
        began = self.stopwatch_ns()
        log.begin(k, sample, sampled - due, sample.at_ns - due)
        self._compute(k, sample)
        work = self.stopwatch_ns() - began
        joints.command(self.command, due + schedule.command_after_ns)
        log.finish(k, self.command, joints.now_ns() - due, work)

    def _compute(self, k: int, sample: JointSample) -> None:
        """From a sample to the torques in `command`, holding the limits."""
        controller, log, desired, look_ns = self.controller, self.log, self.table.row(k), self.stopwatch_ns
        began = look_ns()
        state = controller.observe(sample)
        observing = look_ns() - began
        log.observe(k, state)
        controller.limits.check_state(controller.model, state, desired)
        began = look_ns()
        if self.ahead is not None:
            state, desired = controller.compensation.later(state, desired, self.ahead.row(k))
        tau = controller.torque(state, desired)
        log.law_ns[k] = observing + look_ns() - began
        log.tau_law[k] = tau
        log.clipped[k] = controller.limits.clip(tau, self.command)
