"""The alpha-beta filter: a constant-rate observer with two gains."""

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


class AlphaBeta(Estimator):
    """Predict x + v dt, then correct by the residual r: x += alpha r, v += beta r / dt.

    The prediction is over the interval dt that passed, and the correction of the rate is divided by it: a joint that
    turns evenly is followed without an error whatever the intervals are, and no interval can make the filter unstable.

    It is alpha/beta - 1/2 periods late (the rate that a constant acceleration lacks); white noise comes out
    sqrt(2 beta² / (alpha (4 - 2 alpha - beta))) times as large per period. With alpha = beta = 1 it is the backward
    difference. Source: Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation, 6.5.
    """

    name: ClassVar[str] = "alpha-beta"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("alpha", "1", 0.96, 0.01, 1.0, "correction of the angle: 1 - m² with a memory m of 0.2; our choice"),
        Parameter("beta", "1", 0.64, 1e-4, 1.0, "correction of the rate: (1 - m)², which is critically damped"),
    )

    def __init__(self, axes: int, sampling: Sampling = THESIS_SAMPLING, **given: float) -> None:
        """Reserve room for the angles; `alpha` and `beta` are the gains."""
        super().__init__(axes, sampling, **given)
        self._alpha: Final = self.values["alpha"]
        self._beta: Final = self.values["beta"]
        self._angle: Final = np.zeros(axes)
        self._correct: Final = bind(_correct, self.q, self._angle, self.rate, scalars=("float64",) * 3)

    @property
    def delay(self) -> float:
        """Delay of the estimate in sampling periods, at low frequency."""
        return self._alpha / self._beta - 0.5

    @property
    def noise_gain(self) -> float:
        """Standard deviation of rate times period, per standard deviation of the angles' white noise."""
        return math.sqrt(2 * self._beta**2 / (self._alpha * (4 - 2 * self._alpha - self._beta)))

    def _begin(self, at_ns: int) -> None:  # noqa: ARG002
        """The first sample: rest where it is."""
        self._angle[:] = self.q

    def _advance(self, at_ns: int, interval_ns: int) -> None:  # noqa: ARG002
        """Predict over the interval, and correct."""
        self._correct(interval_ns / NANOSECONDS_PER_SECOND, self._alpha, self._beta)


@compiled
def _correct(q: Floats, angle: Floats, rate: Floats, interval: float, alpha: float, beta: float) -> None:  # noqa: PLR0917
    """One step of prediction and correction."""
    for i in range(len(q)):
        predicted = angle[i] + rate[i] * interval
        residual = q[i] - predicted
        angle[i] = predicted + alpha * residual
        rate[i] += beta * residual / interval
