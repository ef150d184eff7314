"""The backward difference: the velocity of the thesis' control loops."""

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from torquerig.control.estimator import NANOSECONDS_PER_SECOND, THESIS_SAMPLING, Estimator, Sampling
from torquerig.mechanism.compiled import bind, compiled

Floats = NDArray[np.float64]


class BackwardDifference(Estimator):
    """(q_k - q_{k-1}) / (t_k - t_{k-1}): half a period late, the least delay that a mean of differences can have.

    The velocity of the thesis' control loops: the window of nine makes every run oscillate (experiments.md,
    "Controllers"). Over an interval of any length it is the joint's mean rate in it.
    """

    name: ClassVar[str] = "backward-difference"

    def __init__(self, axes: int, sampling: Sampling = THESIS_SAMPLING, **given: float) -> None:
        """Reserve room for one sample; there is nothing to be given."""
        super().__init__(axes, sampling, **given)
        self._before = np.zeros(axes)
        self._difference = bind(_difference, self.q, self._before, self.rate, scalars=("float64",))

    @property
    def delay(self) -> float:
        """Delay of the estimate in sampling periods."""
        return 0.5

    @property
    def noise_gain(self) -> float:
        """Standard deviation of rate times period, per standard deviation of the angles' white noise."""
        return math.sqrt(2)

    def _begin(self, at_ns: int) -> None:  # noqa: ARG002
        """The first sample."""
        self._before[:] = self.q

    def _advance(self, at_ns: int, interval_ns: int) -> None:  # noqa: ARG002
        """The difference of two samples, by the time between them."""
        self._difference(NANOSECONDS_PER_SECOND / interval_ns)


@compiled
def _difference(q: Floats, before: Floats, rate: Floats, per_second: float) -> None:
    """The rate from the sample before, and the sample kept."""
    for i in range(len(q)):
        rate[i] = (q[i] - before[i]) * per_second
        before[i] = q[i]
