"""The torque scale out of levels on a locked rotor: digital = K tau + c in each direction (thesis, 5.4.1, Figure 5.5).

Which variable has the noise: the digital value is what was commanded, exact to the last bit; the torque is measured.
So torque is regressed on the digital value, tau = a + b digital, and K = 1 / b, c = -a / b. Fitting digital on tau, as
Figure 5.5 is labelled, would put the noise on the side that least squares takes for exact, and draw K towards zero by
var(noise) / var(tau). The interval of K is that of b through the reciprocal, which is monotonic, so it covers as b's.

Dry friction holds against the change of torque: the transducer feels the motor's torque less the friction on the way
up, and more the friction on the way down. So both branches of a direction share one slope, and have an intercept each;
half their distance is the friction, whatever the transducer's zero is.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from torquerig.calibration.procedure import CONFIDENCE

OUTLYING: Final = 5.0
"""Residuals beyond so many robust standard deviations are outliers: Hampel's identifier, whose usual 3 is for many
points; of 2000 simulated sets of 20 points without an outlier none lost a point at 5."""
LEAST_LEVELS: Final = 3
"""Different levels a direction that a slope with an interval takes."""

_GAUSSIAN_MAD: Final = 1.4826  # standard deviation over median absolute deviation of a normal distribution

Array = NDArray[np.float64]


class LevelReading(NamedTuple):
    """One level, held and averaged.

    Attributes:
        level: What was commanded [counts].
        rising: Whether the torque grew towards it; in either direction away from zero.
        torque: Mean of the readings [N·m].
        spread: Standard deviation of single readings [N·m]; of one that was written down, that of its rounding.
        samples: How many readings.
        actual: What the drive said it gave, mean [counts]; NaN where nobody asked it.
        overloaded: Whether the transducer said that it was.
    """

    level: int
    rising: bool
    torque: float
    spread: float
    samples: int
    actual: float = float("nan")
    overloaded: bool = False


class Interval(NamedTuple):
    """A value and its interval of confidence (`procedure.CONFIDENCE`).

    Attributes:
        value: The value.
        low: Where the interval begins.
        high: Where it ends.
    """

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class DirectionFit:
    """One direction's line.

    Attributes:
        counts_per_nm: K; negative when the transducer shows the other sign [counts/(N·m)].
        intercept: c of the way up, or of the only way: counts that friction and the transducer's zero take [counts].
        friction: Half the distance of the two branches; NaN when one of them was not measured [N·m].
        linearity: Largest distance of a point from the line, as a share of the largest torque.
        bend: What a parabola would deviate from the line, as a share of the largest torque.
        bend_is_real: Whether noise would make such a parabola in fewer than one of a thousand cases.
        noise: Standard deviation of a level about the line [N·m].
        used: Levels that the line is fitted to.
        outliers: Levels left out because they are far from what the others say.
    """

    counts_per_nm: Interval
    intercept: Interval
    friction: Interval
    linearity: float
    bend: float
    bend_is_real: bool
    noise: float
    used: tuple[LevelReading, ...]
    outliers: tuple[LevelReading, ...]

    @property
    def hysteresis(self) -> float:
        """Distance of the two branches as a share of the largest torque; NaN when one was not measured."""
        return 2.0 * self.friction.value / max(abs(reading.torque) for reading in self.used)

    def torque(self, counts: float, *, rising: bool = True) -> float:
        """What the line says of a digital value [N·m]."""
        way = 1.0 if counts >= 0.0 else -1.0
        play = 0.0 if rising or isnan(self.friction.value) else 2.0 * way * self.friction.value
        return (counts - self.intercept.value) / self.counts_per_nm.value + play


def average(positive: Interval, negative: Interval) -> Interval:
    """The average of both directions' slopes, as the thesis uses it; its interval takes the two as independent."""
    value = 0.5 * (positive.value + negative.value)
    below = 0.5 * float(np.hypot(positive.value - positive.low, negative.value - negative.low))
    above = 0.5 * float(np.hypot(positive.high - positive.value, negative.high - negative.value))
    return Interval(value, value - below, value + above)


def fit_direction(readings: Sequence[LevelReading]) -> DirectionFit | None:
    """The line through one direction's levels.

    Args:
        readings: Levels of one sign; saturated ones are left out by the caller, who knows why they are.

    Returns:
        The line; None when there are too few levels, or torque does not depend on them at all.
    """
    if len({reading.level for reading in readings}) < LEAST_LEVELS:
        return None
    points = _Points.of(readings)
    keep = ~points.outlying()
    used = tuple(reading for reading, kept in zip(readings, keep, strict=True) if kept)
    if len({reading.level for reading in used}) < LEAST_LEVELS:
        keep, used = np.ones(len(readings), dtype=np.bool_), tuple(readings)
    outliers = tuple(reading for reading, kept in zip(readings, keep, strict=True) if not kept)
    return _line(_Points.of(used), used, outliers)


@dataclass(frozen=True, slots=True, eq=False)
class _Points:
    """Levels as arrays, shape (n,).

    Attributes:
        x: Levels [counts].
        y: Torques [N·m].
        rising: Which branch.
        error: What averaging leaves of the readings' spread, one number for all [N·m].
        rounding: Of readings that were written down; residuals may hide it, for rounding is no chance [N·m].
    """

    x: Array
    y: Array
    rising: NDArray[np.bool_]
    error: float
    rounding: float

    @classmethod
    def of(cls, readings: Sequence[LevelReading]) -> "_Points":
        errors = [reading.spread / reading.samples**0.5 for reading in readings if not isnan(reading.spread)]
        written = [reading.spread for reading in readings if reading.samples == 1 and not isnan(reading.spread)]
        return cls(
            np.array([reading.level for reading in readings], dtype=np.float64),
            np.array([reading.torque for reading in readings], dtype=np.float64),
            np.array([reading.rising for reading in readings], dtype=np.bool_),
            float(np.median(errors)) if errors else 0.0,
            float(np.median(written)) if written else 0.0,
        )

    @property
    def branches(self) -> list[NDArray[np.bool_]]:
        """Which points belong to the ways up and down, those that there are."""
        return [branch for branch in (self.rising, ~self.rising) if branch.any()]

    def outlying(self) -> NDArray[np.bool_]:
        """Points that are far from a robust line (Theil and Sen's, with the branches' medians), shape (n,)."""
        slopes = [self._slopes(branch) for branch in self.branches]
        slope = float(np.median(np.concatenate(slopes)))
        rest = self.y - slope * self.x
        for branch in self.branches:
            rest[branch] -= np.median(rest[branch])
        scale = max(_GAUSSIAN_MAD * float(np.median(np.abs(rest))), self.error)
        outlying: NDArray[np.bool_] = np.abs(rest) > OUTLYING * scale
        return outlying if scale > 0.0 else np.zeros(len(self.x), dtype=np.bool_)

    def _slopes(self, branch: NDArray[np.bool_]) -> Array:
        """The slopes between each two of a branch's points."""
        x, y = self.x[branch], self.y[branch]
        first, second = np.triu_indices(len(x), 1)
        apart = x[first] != x[second]
        slopes: Array = (y[second] - y[first])[apart] / (x[second] - x[first])[apart]
        return slopes


def _line(points: _Points, used: tuple[LevelReading, ...], outliers: tuple[LevelReading, ...]) -> DirectionFit | None:
    """Least squares with one slope and an intercept a branch."""
    design = np.column_stack([points.x, *(branch.astype(np.float64) for branch in points.branches)])
    freedom = len(points.x) - design.shape[1]
    if freedom < 1:
        return None
    solution, covariance, residuals = _least_squares(design, points.y, freedom, least=points.rounding)
    slope = float(solution[0])
    if slope == 0.0:
        return None
    quantile = float(stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE))
    largest = float(np.max(np.abs(points.y)))
    bend, real = _bend(points, design, freedom - 1)
    return DirectionFit(
        counts_per_nm=_reciprocal(slope, quantile * float(covariance[0, 0]) ** 0.5),
        intercept=_intercept(solution, covariance, quantile),
        friction=_friction(points, solution, covariance, quantile),
        linearity=float(np.max(np.abs(residuals))) / largest,
        bend=bend / largest,
        bend_is_real=real,
        noise=float(np.sqrt(residuals @ residuals / freedom)),
        used=used,
        outliers=outliers,
    )


def _least_squares(design: Array, y: Array, freedom: int, *, least: float = 0.0) -> tuple[Array, Array, Array]:
    """Solution, its covariance by the residuals but with at least so much noise, and the residuals.

    Columns are scaled, for counts are large.
    """
    scale = np.max(np.abs(design), axis=0)
    scaled = design / scale
    solution = np.linalg.lstsq(scaled, y, rcond=None)[0]
    residuals = y - scaled @ solution
    variance = max(float(residuals @ residuals) / freedom, least**2)
    covariance = variance * np.linalg.inv(scaled.T @ scaled) / np.outer(scale, scale)
    return solution / scale, covariance, residuals


def _reciprocal(slope: float, half: float) -> Interval:
    """1 / slope with its interval; unbounded when slope 0 lies within `half` of it."""
    if abs(slope) <= half:
        return Interval(1.0 / slope, float("-inf"), float("inf"))
    return Interval(1.0 / slope, *sorted((1.0 / (slope - half), 1.0 / (slope + half))))


def _intercept(solution: Array, covariance: Array, quantile: float) -> Interval:
    """-a / b of the first branch, its interval to first order."""
    slope, offset = float(solution[0]), float(solution[1])
    gradient = np.array([offset / slope**2, -1.0 / slope])
    half = quantile * float(gradient @ covariance[:2, :2] @ gradient) ** 0.5
    value = -offset / slope
    return Interval(value, value - half, value + half)


def _friction(points: _Points, solution: Array, covariance: Array, quantile: float) -> Interval:
    """Half of how much further from zero the way down is than the way up."""
    if len(points.branches) < 2:
        return Interval(float("nan"), float("nan"), float("nan"))
    way = 1.0 if float(points.x.mean()) >= 0.0 else -1.0
    value = 0.5 * way * float(np.sign(solution[0])) * float(solution[2] - solution[1])
    variance = covariance[1, 1] + covariance[2, 2] - 2.0 * covariance[1, 2]
    half = 0.5 * quantile * float(max(variance, 0.0)) ** 0.5
    return Interval(value, value - half, value + half)


def _bend(points: _Points, design: Array, freedom: int) -> tuple[float, bool]:
    """What a parabola deviates at most from the line [N·m], and whether it is more than noise."""
    if freedom < 1 or len(np.unique(points.x)) < LEAST_LEVELS:
        return 0.0, False
    centred = points.x - points.x.mean()
    square = (centred / np.max(np.abs(centred))) ** 2
    scaled = design / np.max(np.abs(design), axis=0)
    square -= scaled @ np.linalg.lstsq(scaled, square, rcond=None)[0]  # what a line cannot do
    solution, covariance, _ = _least_squares(
        np.column_stack([design, square]), points.y, freedom, least=points.rounding
    )
    weight = float(solution[-1])
    threshold = float(stdtrit(freedom, 0.9995)) * float(covariance[-1, -1]) ** 0.5
    return abs(weight) * float(np.max(np.abs(square))), abs(weight) > threshold
