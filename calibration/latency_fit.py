"""From answers at equivalent times to a delay and a lag.

A torque is commanded a little before a SYNC, by another while each time. What the SYNC catches of the step is

    y = 0 for x < d,  y = 1 - exp(-(x - d) / lag) from then on

where x is the time from the command to the drive's sample. So -ln(1 - y) is a straight line of x, whose slope is
1 / lag and which meets zero at d.
"""

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom
from scipy.stats import t as student

from torquerig.calibration.procedure import CONFIDENCE, Estimate

Vector = NDArray[np.float64]

RISING: Final = (0.05, 0.92)
"""Where the line is fitted: below it rounding, above it the logarithm of rounding would count."""
STAMP: Final = 1e-9
"""Of a difference of two time stamps: each is rounded to whole nanoseconds [s]."""
_LEAST_POINTS: Final = 5


class Interval(NamedTuple):
    """A value and its interval of confidence.

    Attributes:
        value: The value.
        low: Begin of the interval.
        high: Its end.
    """

    value: float
    low: float
    high: float

    def shifted(self, by: float) -> "Interval":
        """The same of a value that is counted from elsewhere."""
        return Interval(self.value + by, self.low + by, self.high + by)


class Response(NamedTuple):
    """How a torque follows its command.

    Attributes:
        delay: d [s].
        lag: Of the current loop [s].
    """

    delay: Interval
    lag: Interval


class Times(NamedTuple):
    """What the drives need, all alike.

    Attributes:
        sample: From SYNC until the TPDO is ready [s].
        reaction: From an RPDO's reception until its torque is demanded [s].
        current_lag: Time constant of the current loops [s].
    """

    sample: Interval
    reaction: Interval
    current_lag: Interval

    def by_key(self) -> dict[str, Interval]:
        """By key of the configuration."""
        return {f"latency.{name}": interval for name, interval in self._asdict().items()}

    def rows(self) -> Iterator[Estimate]:
        """As a table has them, in the configuration's unit."""
        for key, (value, low, high) in self.by_key().items():
            yield Estimate(key, value, low, high, "s")


def fit_response(x: Vector, y: Vector) -> Response | None:
    """Delay and lag of a step response that was sampled at many times.

    Args:
        x: From the command to the sample, shape (n,) [s].
        y: Which share of the step was there, shape (n,).

    Returns:
        Both; None when fewer than five samples lie on the rise.
    """
    low, high = RISING
    rising = (y > low) & (y < high)
    count = int(rising.sum())
    if count < _LEAST_POINTS:
        return None
    # regressed on the logarithm: it carries the noise of the small step of time, x the command's own
    height, when = -np.log1p(-y[rising]), x[rising]
    design = np.column_stack([np.ones(count), height])
    (delay, lag), *_ = np.linalg.lstsq(design, when, rcond=None)
    residual = when - design @ (delay, lag)
    variance = float(residual @ residual) / (count - 2)
    deviation = np.sqrt(np.diag(np.linalg.inv(design.T @ design)) * variance)
    half = float(student.ppf((1 + CONFIDENCE) / 2, count - 2)) * deviation
    return Response(
        Interval(float(delay), float(delay - half[0]), float(delay + half[0])),
        Interval(float(lag), float(lag - half[1]), float(lag + half[1])),
    )


def latch_wait(before: Vector, frame: float, frames: int) -> Vector:
    """How long a SYNC waits for the wire behind commands that were sent shortly before it.

    It has the lowest identifier, so that it waits only for the frame that is being sent (CAN arbitration).

    Args:
        before: How long before the SYNC the commands were handed over, shape (n,) [s].
        frame: Time of one command on the wire [s].
        frames: How many there are.

    Returns:
        The wait, shape (n,) [s].
    """
    under_way = (before > 0) & (before < frames * frame)
    wait: Vector = np.where(under_way, frame - np.mod(before, frame), 0.0)
    return wait


def mean_interval(values: Vector) -> Interval:
    """Mean of independent values and its interval of confidence (Student's)."""
    mean, count = float(values.mean()), len(values)
    if count < 2:
        return Interval(mean, float("nan"), float("nan"))
    half = float(student.ppf((1 + CONFIDENCE) / 2, count - 1) * values.std(ddof=1) / np.sqrt(count))
    return Interval(mean, mean - half, mean + half)


def mean_of(intervals: Sequence[Interval]) -> Interval:
    """The mean of values that are known independently, and its interval of confidence."""
    mean = float(np.mean([each.value for each in intervals]))
    half = float(np.linalg.norm([(each.high - each.low) / 2 for each in intervals])) / len(intervals)
    return Interval(mean, mean - half, mean + half)


def median_interval(values: Vector) -> Interval:
    """Median of independent times and its interval of confidence: which of them bound it does not ask for their law.

    The r-th smallest and the r-th largest of n hold it between them with the probability 1 - 2 P(B < r), B binomial
    with n and 1/2; time stamps are whole nanoseconds, so that it is known to half of one of each end at best.
    """
    ordered = np.sort(values)
    rank = max(int(binom.ppf((1 - CONFIDENCE) / 2, len(ordered), 0.5)) - 1, 0)
    return Interval(float(np.median(ordered)), float(ordered[rank]) - STAMP, float(ordered[-1 - rank]) + STAMP)
