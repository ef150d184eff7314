"""The moving window: the velocity filter of the thesis' identification."""

import math
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.estimator import (
    NANOSECONDS_PER_SECOND,
    THESIS_SAMPLING,
    Estimator,
    Parameter,
    Sampling,
)
from torquerig.mechanism.compiled import bind, compiled

Floats = NDArray[np.float64]

THESIS_WINDOW: Final = 9
"""Length of the thesis' velocity filter in samples (5.4.2, "a one dimension window filter of a length nine")."""


class MovingWindow(Estimator):
    """Mean of the last n backward differences: the thesis' filter.

    The thesis differentiates numerically and passes the velocity through "a one dimension window filter of a length
    nine" (5.4.2): the mean of nine differences, which telescopes to (q_k - q_{k-n}) / (t_k - t_{k-n}). Time is
    taken from the samples, so over skipped cycles too it is the mean rate of the window. Until n differences are
    there, all there are count.

    It is n/2 periods late, and white noise on the angles comes out sqrt(2)/n times as large per period.
    """

    name: ClassVar[str] = "moving-window"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("length", "samples", THESIS_WINDOW, 1, 1000, "differences in the window (thesis, 5.4.2)", whole=True),
    )

    def __init__(self, axes: int, sampling: Sampling = THESIS_SAMPLING, **given: float) -> None:
        """Reserve room for the window: `length` differences, 1 or more."""
        super().__init__(axes, sampling, **given)
        self.length: Final = int(self.values["length"])
        self._slots: Final = self.length + 1
        self._angles: Final = np.zeros((self._slots, axes))
        self._times: Final = [0] * self._slots
        self._taken = 0
        self._slope: Final = bind(_slope, self.q, self._angles, self.rate, scalars=("int64", "int64", "float64"))

    @property
    def delay(self) -> float:
        """Delay of the estimate in sampling periods."""
        return self.length / 2

    @property
    def noise_gain(self) -> float:
        """Standard deviation of rate times period, per standard deviation of the angles' white noise."""
        return math.sqrt(2) / self.length

    def _begin(self, at_ns: int) -> None:
        """The first sample: a window of one."""
        self._angles[0] = self.q
        self._times[0] = at_ns
        self._taken = 1

    def _advance(self, at_ns: int, interval_ns: int) -> None:  # noqa: ARG002  (the window's span counts)
        """The difference over the window, by its span."""
        newest = self._taken % self._slots
        oldest = (self._taken - min(self._taken, self.length)) % self._slots
        self._times[newest] = at_ns
        per_second = NANOSECONDS_PER_SECOND / (at_ns - self._times[oldest])
        self._slope(newest, oldest, per_second)
        self._taken += 1


@compiled
def _slope(q: Floats, angles: Floats, rate: Floats, newest: int, oldest: int, per_second: float) -> None:  # noqa: PLR0917
    """The rate since the oldest sample, and the sample kept."""
    for i in range(len(q)):
        rate[i] = (q[i] - angles[oldest, i]) * per_second
        angles[newest, i] = q[i]
