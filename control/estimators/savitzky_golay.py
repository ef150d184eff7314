"""The causal Savitzky-Golay filter: the slope, now, of a polynomial through the last samples."""

from collections.abc import Iterator, Mapping
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.estimator import (
    NANOSECONDS_PER_SECOND,
    THESIS_SAMPLING,
    Estimator,
    Objection,
    Parameter,
    Sampling,
)
from torquerig.mechanism.compiled import bind, compiled

Floats = NDArray[np.float64]


class SavitzkyGolay(Estimator):
    """Slope at the newest sample of the polynomial that fits the last n samples best, in the least squares' sense.

    At even intervals these are Savitzky and Golay's coefficients (scipy's `savgol_coeffs(n, order, deriv=1, pos=n-1)`).
    Here the polynomial is fitted anew to the instants of the samples, by Forsythe's orthogonal polynomials: a motion
    that is a polynomial of this order is differentiated exactly, whatever the intervals are. Until n samples are
    there, all there are count, and the order is as high as they allow.

    From order 2 on it has no delay at low frequency; order 1 is (n-1)/2 periods late. Sources: Savitzky and Golay,
    Analytical Chemistry 36 (1964) 1627; Forsythe, J. SIAM 5 (1957) 74.
    """

    name: ClassVar[str] = "savitzky-golay"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("length", "samples", 5, 2, 100, "samples in the window; our choice", whole=True),
        Parameter("order", "1", 2, 1, 5, "of the polynomial; our choice: the least that has no delay", whole=True),
    )

    def __init__(self, axes: int, sampling: Sampling = THESIS_SAMPLING, **given: float) -> None:
        """Reserve room for the window: `length` samples, a polynomial of `order`."""
        super().__init__(axes, sampling, **given)
        self.length: Final = int(self.values["length"])
        self.order: Final = int(self.values["order"])
        self._angles: Final = np.zeros((self.length, axes))
        self._times: Final = np.zeros(self.length, dtype=np.int64)
        self._scratch: Final = np.zeros((3, self.length))
        self._taken = 0
        window = (self._angles, self._times, self._scratch)
        self._fit: Final = bind(_fit, self.q, *window, self.rate, scalars=("int64",) * 4)

    @classmethod
    def objections(cls, given: Mapping[str, float]) -> Iterator[Objection]:
        """As for all; and an order that the window cannot hold."""
        ranges = list(super().objections(given))
        if ranges:
            yield from ranges
            return
        values = cls.complete(given)
        order, length = values["order"], values["length"]
        if order >= length and "order" in given:
            yield Objection("order", f"it must be below length = {length}")
        elif order >= length:
            yield Objection("length", f"it must be above order = {order}")

    @property
    def delay(self) -> float:
        """Delay of the estimate in sampling periods, at low frequency."""
        return (self.length - 1) / 2 if self.order == 1 else 0.0

    @property
    def noise_gain(self) -> float:
        """Standard deviation of rate times period, per standard deviation of the angles' white noise."""
        ages = np.arange(self.length) / self.length
        powers = np.vander(ages, self.order + 1, increasing=True)
        slope = np.linalg.pinv(powers)[1] / self.length
        return float(np.linalg.norm(slope))

    def _begin(self, at_ns: int) -> None:
        """The first sample."""
        self._angles[0] = self.q
        self._times[0] = at_ns
        self._taken = 1

    def _advance(self, at_ns: int, interval_ns: int) -> None:  # noqa: ARG002  (all of the window's instants count)
        """Fit the window that ends with this sample."""
        newest = self._taken % self.length
        self._taken += 1
        count = min(self._taken, self.length)
        self._fit(at_ns, newest, count, self.order)


@compiled
def _keep(  # noqa: PLR0917  (a kernel takes plain numbers and arrays)
    q: Floats, at_ns: int, angles: Floats, times: NDArray[np.int64], newest: int, oldest: int, x: Floats
) -> float:
    """Keep the newest sample; the instants x run from -1 at the oldest to 0 at the newest, over the span returned."""
    slots = len(times)
    times[newest] = at_ns
    for i in range(len(q)):
        angles[newest, i] = q[i]
    span = float(at_ns - times[oldest])
    for m in range((newest - oldest) % slots + 1):
        x[m] = (times[(oldest + m) % slots] - at_ns) / span
    return span / NANOSECONDS_PER_SECOND


@compiled
def _share(here: Floats, count: int, angles: Floats, oldest: int, i: int, origin: float) -> float:  # noqa: PLR0917
    """<P, q_i - origin> over the window."""
    share = 0.0
    for m in range(count):
        share += here[m] * (angles[(oldest + m) % len(angles), i] - origin)
    return share


@compiled
def _fit(  # noqa: PLR0917
    q: Floats,
    angles: Floats,
    times: NDArray[np.int64],
    scratch: Floats,
    rate: Floats,
    at_ns: int,
    newest: int,
    count: int,
    order: int,
) -> None:
    """Sum the slopes of the orthogonal polynomials P_j at the newest sample, each with its share in the window.

    P_{j+1} = (x - a_j) P_j - b_j P_{j-1}, a_j = <x P_j, P_j> / <P_j, P_j>, b_j = <P_j, P_j> / <P_{j-1}, P_{j-1}>.
    """
    x, here, last = scratch[0], scratch[1], scratch[2]
    oldest = (newest - count + 1) % len(times)
    seconds = _keep(q, at_ns, angles, times, newest, oldest, x)
    here[:], last[:], rate[:] = 1.0, 0.0, 0.0
    value, value_before, slope, slope_before, norm_before = 1.0, 0.0, 0.0, 0.0, 1.0
    for degree in range(min(order, count - 1) + 1):
        norm, mean = 0.0, 0.0
        for m in range(count):
            norm += here[m] * here[m]
            mean += x[m] * here[m] * here[m]
        a, b = mean / norm, norm / norm_before if degree else 0.0
        for i in range(len(q)):
            rate[i] += _share(here, count, angles, oldest, i, q[i]) / norm * slope / seconds
        for m in range(count):
            here[m], last[m] = (x[m] - a) * here[m] - b * last[m], here[m]
        slope, slope_before = value - a * slope - b * slope_before, slope
        value, value_before = -a * value - b * value_before, value
        norm_before = norm
