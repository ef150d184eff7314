"""What an estimator of joint rates is: a filter over joint angles that runs in the loop and allocates nothing there."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

NANOSECONDS_PER_SECOND: Final = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Sampling:
    """How joint angles come.

    Attributes:
        period_ns: The nominal sampling period.
        resolution: The angle of one encoder count at the joint [rad].
    """

    period_ns: int
    resolution: float

    @property
    def period(self) -> float:
        """The nominal sampling period [s]."""
        return self.period_ns / NANOSECONDS_PER_SECOND

    @property
    def quantisation(self) -> float:
        """Standard deviation of an angle that is uniform within one count: resolution / sqrt(12) [rad]."""
        return self.resolution / math.sqrt(12)


THESIS_SAMPLING: Final = Sampling(period_ns=4_000_000, resolution=2 * math.pi / 200_000)
"""4 ms (thesis, 6.4); 2000 pulses, quadrature x4, gear 25 (thesis, Table A.1 and 5.4.2)."""


class Parameter(NamedTuple):
    """A number that an estimator may be given.

    Attributes:
        name: Its name in configurations.
        unit: Its unit, "1" for ratios.
        default: What it is unless somebody says otherwise.
        least: The least that it may be.
        most: The most that it may be.
        meaning: What it is, in a few words, with the source of the default.
        whole: Whether it counts something.
    """

    name: str
    unit: str
    default: float
    least: float
    most: float
    meaning: str
    whole: bool = False

    @property
    def range(self) -> str:
        """What it may be, in words."""
        return f"{'a whole number' if self.whole else 'a number'} at least {self.least:g} and at most {self.most:g}"

    def allows(self, value: float) -> bool:
        """Whether it may have this value."""
        return self.least <= value <= self.most and (not self.whole or value == int(value))


class Objection(NamedTuple):
    """Why an estimator cannot have a parameter's value.

    Attributes:
        parameter: The parameter's name.
        words: What is wrong, to be put after "NAME = VALUE cannot be: ".
    """

    parameter: str
    words: str


class Estimator(ABC):
    """An estimator of joint rates.

    A new one is one file in `torquerig.control.estimators` with one subclass; nothing has to be registered. It gives
    `name`, `parameters`, `delay`, `noise_gain` and the two steps `_begin` and `_advance`.

    Samples say when they were taken. An interval that is not the nominal period (a skipped cycle, jitter) must not
    bend the estimate: after its first samples every estimator returns the slope of a joint that turns evenly, whatever
    the intervals are, and says in its docstring what else it keeps.

    Attributes:
        name: Its name in configurations and records.
        parameters: What it may be given.
        sampling: The nominal period and the angles' resolution.
        values: Its parameters' values by name.
        q: The latest joint angles, shape (axes,) [rad]: one buffer for ever.
        rate: The estimate, shape (axes,) [rad/s]: one buffer for ever.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]] = ()

    def __init__(self, axes: int, sampling: Sampling = THESIS_SAMPLING, **given: float) -> None:
        """Check the parameters and reserve room.

        Args:
            axes: Number of joints.
            sampling: The nominal period and the angles' resolution.
            given: Parameters by name; one that is missing has its default.

        Raises:
            ValueError: If there is no such parameter, or it cannot have that value.
        """
        for parameter, words in self.objections(given):
            raise ValueError(f"{self.name}: {parameter} = {given.get(parameter)!r} cannot be: {words}")
        self.sampling: Final = sampling
        self.values: Final[Mapping[str, float]] = MappingProxyType(self.complete(given))
        self.q: Final = np.zeros(axes)
        self.rate: Final = np.zeros(axes)
        self._at_ns: int | None = None

    @classmethod
    def complete(cls, given: Mapping[str, float]) -> dict[str, float]:
        """All parameters by name: those given, the rest by default; whole ones as int."""
        chosen = {each: given.get(each.name, each.default) for each in cls.parameters}
        return {each.name: int(value) if each.whole else float(value) for each, value in chosen.items()}

    @classmethod
    def objections(cls, given: Mapping[str, float]) -> Iterator[Objection]:
        """Why it cannot have these parameters.

        Args:
            given: Parameters by name; one that is missing has its default.

        Yields:
            What is wrong with each.
        """
        known = {each.name: each for each in cls.parameters}
        for name, value in given.items():
            if name not in known:
                yield Objection(name, f"{cls.name} takes {', '.join(known) or 'no parameter'}")
            elif not known[name].allows(value):
                yield Objection(name, f"it must be {known[name].range}")

    @property
    @abstractmethod
    def delay(self) -> float:
        """How old the estimate is, in sampling periods: its group delay at low frequency.

        An estimator that follows a constant acceleration without an error has none; what it loses at the frequencies
        of a motion shows in a measurement only (`torquerig estimators`).
        """

    @property
    @abstractmethod
    def noise_gain(self) -> float:
        """Standard deviation of the rate times the period, per standard deviation of white noise on the angles."""

    def reset(self) -> None:
        """Forget every sample: the machine stands, a run begins."""
        self._at_ns = None

    def update(self, q: NDArray[np.float64], at_ns: int) -> NDArray[np.float64]:
        """Take the next sample and estimate the rates.

        Args:
            q: Joint angles, shape (axes,) [rad]; they are copied.
            at_ns: When they were sampled, later than the sample before.

        Returns:
            Joint rates, shape (axes,) [rad/s], zero after the first sample. The same buffer every time: it holds until
            the next update.

        Raises:
            ValueError: If `at_ns` is not later than the sample before.
        """
        self.q[:] = q
        self.step(at_ns)
        return self.rate

    def step(self, at_ns: int) -> None:
        """As `update`, of the angles that stand in `q`: whoever has a quicker way to put them there does so.

        Args:
            at_ns: When they were sampled, later than the sample before.

        Raises:
            ValueError: If `at_ns` is not later than the sample before.
        """
        previous = self._at_ns
        if previous is None:
            self.rate[:] = 0.0
            self._begin(at_ns)
        elif at_ns <= previous:
            raise ValueError(f"a sample at {at_ns} ns is not later than the one before, at {previous} ns")
        else:
            self._advance(at_ns, at_ns - previous)
        self._at_ns = at_ns

    @abstractmethod
    def _begin(self, at_ns: int) -> None:
        """Take the first sample from `q`, taken at `at_ns`; the joints stand, `rate` is zero."""

    @abstractmethod
    def _advance(self, at_ns: int, interval_ns: int) -> None:
        """Take another sample from `q`, taken at `at_ns`, `interval_ns` after the one before, and set `rate`."""
