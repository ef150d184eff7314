"""The derivative behind a first-order low pass, s / (tau s + 1)."""

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


class LowPassDerivative(Estimator):
    """v_k = p v_{k-1} + (1 - p) (q_k - q_{k-1}) / dt with p = exp(-dt / tau), tau = 1 / (2 pi cutoff).

    The exact answer of s / (tau s + 1) to angles that run straight from sample to sample, over an interval dt of any
    length: after a skipped cycle p is smaller, and the filter forgets as much as it would have in the cycles between.

    It is half a period and p/(1-p) periods late; white noise comes out (1-p) sqrt(2/(1+p)) times as large per period.
    """

    name: ClassVar[str] = "low-pass-derivative"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("cutoff", "Hz", 40.0, 0.1, 4000.0, "corner of the low pass; our choice: a sixth of 250 Hz"),
    )

    def __init__(self, axes: int, sampling: Sampling = THESIS_SAMPLING, **given: float) -> None:
        """Reserve room for one sample; `cutoff` is the low pass' corner [Hz]."""
        super().__init__(axes, sampling, **given)
        self._tau: Final = 1 / (2 * math.pi * self.values["cutoff"])
        self._pole: Final = math.exp(-sampling.period / self._tau)
        self._before: Final = np.zeros(axes)
        self._filter: Final = bind(_filter, self.q, self._before, self.rate, scalars=("float64", "float64"))

    @property
    def delay(self) -> float:
        """Delay of the estimate in sampling periods, at low frequency."""
        return 0.5 + self._pole / (1 - self._pole)

    @property
    def noise_gain(self) -> float:
        """Standard deviation of rate times period, per standard deviation of the angles' white noise."""
        return (1 - self._pole) * math.sqrt(2 / (1 + self._pole))

    def _begin(self, at_ns: int) -> None:  # noqa: ARG002
        """The first sample: rest."""
        self._before[:] = self.q

    def _advance(self, at_ns: int, interval_ns: int) -> None:  # noqa: ARG002
        """Forget as much as the interval asks for, and add the difference."""
        interval = interval_ns / NANOSECONDS_PER_SECOND
        self._filter(interval, math.exp(-interval / self._tau))


@compiled
def _filter(q: Floats, before: Floats, rate: Floats, interval: float, pole: float) -> None:
    """The rate from the rate and the sample before, and the sample kept."""
    for i in range(len(q)):
        rate[i] = pole * rate[i] + (1.0 - pole) * (q[i] - before[i]) / interval
        before[i] = q[i]
