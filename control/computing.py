"""From a sample to what is commanded, in every cycle: in one compiled call where the law allows it, or step by step."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.compensation import Compensation
from torquerig.control.cycle_kernel import OUTSIDE, WILD, cycle
from torquerig.control.estimator import Estimator
from torquerig.control.joints import JointSample
from torquerig.control.law import State, Torque
from torquerig.control.limits import Limits
from torquerig.control.observer import Observer
from torquerig.control.reference import LEGS, ReferenceTable
from torquerig.control.row import POSITION, STATE, VELOCITY, Row
from torquerig.mechanism import Manipulator
from torquerig.mechanism.compiled import entry
from torquerig.mechanism.status import require_ok

Compute = Callable[[int, JointSample], int]
"""Fills a `Row` from a row of the reference and a sample; gives how many axes were cut to the torque limit.

    Raises:
        LimitExceeded: A limit is violated.
        ReachError, SingularPoseError: The machine is where no law can be worked out.
        ValueError: The sample is not later than the one before.
"""


@cache
def compiled_cycle() -> Callable[..., int]:
    """The kernel for all that a cycle computes, compiled at the first call."""
    numbers, rows = np.zeros(1), np.zeros((1, 1))
    return entry(cycle, *[numbers] * 8, rows, rows, scalars=("int64",))


@dataclass(frozen=True, slots=True)
class Merged:
    """A law of `Terms` with all around it, in one compiled call.

    Attributes:
        model: The manipulator as the controller knows it.
        estimator: Joint rates from joint angles.
        limits: What stops the machine.
        coefficients: The law's, as `TermsTorque` has them.
        coulomb: Torque fed forward on each joint in the direction of its desired rate [N·m at the motor].
    """

    model: Manipulator
    estimator: Estimator
    limits: Limits
    coefficients: NDArray[np.float64]
    coulomb: float

    def __post_init__(self) -> None:
        """Have the call compiled now, not in the first cycle."""
        compiled_cycle()

    def along(self, table: ReferenceTable, ahead: ReferenceTable | None, row: Row) -> Compute:
        """As `Controller.along`."""
        return _MergedCycle(self, table, table if ahead is None else ahead, row).compute


class _MergedCycle:
    """The call with its arrays."""

    __slots__ = ("_expected", "_kernel", "_parts", "_q", "_row", "_step", "_table")

    def __init__(self, parts: Merged, table: ReferenceTable, ahead: ReferenceTable, row: Row) -> None:
        self._parts, self._table, self._row = parts, table, row
        estimator = parts.estimator
        self._step = estimator.step
        self._q: Final[Any] = estimator.q.data  # as `Row` has it
        self._expected = np.zeros(STATE)
        constants = (parts.model.constants, parts.coefficients, np.full(LEGS, parts.coulomb), parts.limits.bounds)
        numbers = (estimator.q, estimator.rate, row.numbers, self._expected)
        self._kernel = partial(compiled_cycle(), *constants, *numbers, table.rows, ahead.rows)

    def compute(self, k: int, sample: JointSample) -> int:
        """A `Compute`."""
        try:
            self._q[:] = sample.q
            self._step(sample.at_ns)
        except BaseException:
            self._row.begin(sample)
            raise
        code = self._kernel(k)
        if code > 0:
            self._refuse(code, k)
        return -code

    def _refuse(self, code: int, k: int) -> None:
        """Raise what the kernel's code means."""
        model, limits, row = self._parts.model, self._parts.limits, self._row
        if code == OUTSIDE:
            estimator = self._parts.estimator
            state = State(estimator.q, estimator.rate, row.position, row.numbers[VELOCITY:STATE])
            limits.refuse(model, state, self._table.row(k))
        if code == WILD:
            limits.clip(row.tau_law, np.zeros(LEGS))
        require_ok(code, self._expected[POSITION:VELOCITY], model.bases, model.link_length)


@dataclass(frozen=True, slots=True)
class Stepped:
    """Any law, called in Python between the parts around it.

    Attributes:
        model: The manipulator as the controller knows it.
        observer: From samples to the state.
        limits: What stops the machine.
        torque: The law as the loop calls it.
    """

    model: Manipulator
    observer: Observer
    limits: Limits
    torque: Torque

    def along(self, table: ReferenceTable, ahead: ReferenceTable | None, row: Row) -> Compute:
        """As `Controller.along`."""

        def compute(k: int, sample: JointSample) -> int:
            row.begin(sample)
            desired = table.row(k)
            state = self.observer.observe(sample)
            np.concatenate(state, out=row.numbers[:STATE])
            self.limits.check_state(self.model, state, desired)
            if ahead is not None:
                state, desired = Compensation.later(state, desired, ahead.row(k))
            row.tau_law[:] = self.torque(state, desired)
            clipped = self.limits.clip(row.tau_law, command)
            row.tau[:] = command
            return clipped

        command = np.zeros(LEGS)
        return compute
