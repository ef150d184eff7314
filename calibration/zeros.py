"""Encoder zeros of a redundant machine from a recorded motion: what makes the three legs close (calibration.closure).

Each sample has one closure residual; its derivative by the three zeros is the unit vector nu_k. While the machine moves
nu_k turns, and all three zeros can be observed: the singular values of the rows nu_k, over the root of their number,
tell how well. At home nu hardly turns within +-10 mm: 0.98, 0.17, 0.030, a condition number of 33.

Link lengths and base points can be sought too. The closure does not see all of them (a larger machine with the same
angles closes as well, so does a displaced or turned one), so each is held near its drawing by a tolerance.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from torquerig.calibration.closure import LEGS, Array, Geometry, close
from torquerig.calibration.regression import least_squares_in_time
from torquerig.mechanism import Manipulator, SingularPoseError

MOST_CONDITION: Final = 60.0
"""Of a motion from which zeros are taken: twice that of +-10 mm about home; what the geometry is off by comes into the
zeros that many times."""
FEWEST: Final = 200
"""Samples in motion, at least: no fewer average the encoders' rounding to a fiftieth of a count."""
_HANGING_TOGETHER: Final = 0.5
"""Time over which residuals may hang together [s]: what an irregular hand and geometry leave turns over slowly."""
_LARGEST: Final = 20.0
"""How many times larger a motion is looked at to say how large it must be."""
_ROUNDS: Final = 2
"""Of least squares: the first finds the residuals' size, with which the second weighs the tolerance."""
_NORMAL: Final = 1.96
"""Standard deviations either side that hold 95 % of a normal distribution."""
NAMES: Final = (
    *(f"A{leg}{axis}" for leg in (1, 2, 3) for axis in "xy"),
    *(f"proximal {leg}" for leg in (1, 2, 3)),
    *(f"distal {leg}" for leg in (1, 2, 3)),
)
"""The geometry's twelve lengths, in order."""


class MotionTooSmall(ValueError):
    """A motion from which the zeros cannot be told; its text says how large it must be."""


@dataclass(frozen=True, slots=True, eq=False)
class Observability:
    """What a motion tells of the zeros.

    Attributes:
        singular_values: Of the residuals' derivatives by the zeros over the root of their number, falling, shape (3,).
        combinations: Rows: the combination of zeros that belongs to each, shape (3, 3).
        extent: Half of the motion's range in x and y [m].
        samples: How many there were in which all joints moved.
    """

    singular_values: Array
    combinations: Array
    extent: tuple[float, float]
    samples: int

    @property
    def condition_number(self) -> float:
        """Largest over smallest singular value; inf where a combination cannot be observed at all."""
        first, last = float(self.singular_values[0]), float(self.singular_values[-1])
        return first / last if last > 0.0 else math.inf


@dataclass(frozen=True, slots=True, eq=False)
class Zeros:
    """Encoder zeros that were found.

    Attributes:
        values: What is to be added to the measured angles, shape (3,) [rad].
        low: Begin of each interval of confidence, shape (3,) [rad].
        high: Its end.
        residuals: Closure residuals after it, shape (n,) [rad].
        before: The same before it.
        position: Of the end-effector at the samples, shape (n, 2) [m].
        observability: What the motion told.
        lengths: What the geometry's lengths are longer than the model's by, value, low and high by name [m]; empty
            unless they were sought.
    """

    values: Array
    low: Array
    high: Array
    residuals: Array
    before: Array
    position: Array
    observability: Observability
    lengths: dict[str, tuple[float, float, float]]

    @property
    def rms(self) -> float:
        """Root mean square of the closure residuals [rad]."""
        return math.sqrt(float(np.mean(self.residuals**2)))


def find_zeros(
    model: Manipulator, q: Array, period: float, *, start: tuple[float, float], tolerance: float | None = None
) -> Zeros:
    """The zeros that make the legs close.

    Args:
        model: The manipulator, by its drawing.
        q: Joint angles of a motion, shape (n, 3) [rad]; with NaN where a sample is missing.
        period: Sampling period [s].
        start: Where the end-effector is about, (x, y) [m].
        tolerance: Standard deviation of link lengths and base points, to seek them too [m]; None: they are right.

    Returns:
        Zeros with intervals.

    Raises:
        MotionTooSmall: The zeros cannot be told from this motion; says how much it takes.
        SingularPoseError: The legs do not close anywhere near: an axis is wired wrongly, or an angle is far off.
    """
    theta = different(q)
    observed = observe(model, theta, start)
    require_enough(model, theta, observed, start)
    about = close(Geometry.of(model), theta, np.array(start)).position
    problem = _Problem(Geometry.of(model), theta, about, 0.0 if tolerance is None else tolerance)
    solution, sigma = problem.solved(LEGS + (0 if tolerance is None else len(NAMES)))
    residuals, slopes = problem.rows(solution)
    half = _half_widths(residuals, slopes, round(_HANGING_TOGETHER / period), sigma)
    zeros = solution[:LEGS]
    return Zeros(
        zeros,
        zeros - half[:LEGS],
        zeros + half[:LEGS],
        residuals,
        problem.rows(np.zeros(len(solution)))[0],
        close(problem.geometry(solution), theta + zeros, problem.start).position,
        observed,
        _lengths(problem.tolerance * solution[LEGS:], problem.tolerance * half[LEGS:]),
    )


def _lengths(found: Array, half: Array) -> dict[str, tuple[float, float, float]]:
    """Value, low and high of each length that was sought, by name."""
    names = NAMES[: len(found)]
    return {
        name: (value, value - by, value + by)
        for name, value, by in zip(names, found.tolist(), half.tolist(), strict=True)
    }


def different(q: Array) -> Array:
    """The whole samples in which every joint differs from the sample before.

    A joint that hardly moves keeps its rounding, up to half a count, for many samples, and these would weigh as many
    times; one that moves on by counts has a new rounding each time, and the mean of those is nothing.
    """
    whole = q[np.all(np.isfinite(q), axis=1)]
    return whole[1:][np.all(np.diff(whole, axis=0) != 0.0, axis=1)]


def observe(model: Manipulator, theta: Array, start: tuple[float, float]) -> Observability:
    """What a motion tells of the zeros.

    Args:
        model: The manipulator.
        theta: Joint angles, shape (n, 3) [rad].
        start: Where the end-effector is about, (x, y) [m].

    Raises:
        MotionTooSmall: There is no sample at all.
        SingularPoseError: The legs do not close.
    """
    if not len(theta):
        raise MotionTooSmall(
            f"no sample in which all three joints moved: {FEWEST} are needed, from a motion of about +-10 mm both ways"
        )
    closed = close(Geometry.of(model), theta, np.array(start))
    x, y = np.ptp(closed.position, axis=0) / 2
    _, values, combinations = np.linalg.svd(closed.normals, full_matrices=False)
    padded = np.zeros(LEGS)
    padded[: len(values)] = values / math.sqrt(len(theta))
    return Observability(padded, combinations, (float(x), float(y)), len(theta))


def require_enough(model: Manipulator, theta: Array, observed: Observability, start: tuple[float, float]) -> None:
    """See that a motion tells enough.

    Raises:
        MotionTooSmall: It does not; says how much it takes.
    """
    x, y = (1e3 * half for half in observed.extent)
    if observed.samples >= FEWEST and observed.condition_number <= MOST_CONDITION:
        return
    spans = f"the motion spans +-{x:.1f} mm in x and +-{y:.1f} mm in y in {observed.samples} samples in motion"
    if observed.samples < FEWEST:
        raise MotionTooSmall(
            f"{spans}: {FEWEST} samples are needed, and about +-10 mm both ways; move the machine while it is recorded"
        )
    factor = _enlargement(model, theta, start)
    if factor is None:
        advice = "cover a circle of about +-10 mm, not a line"
    else:
        advice = f"make it {factor:.1f} times as large, +-{factor * x:.1f} mm and +-{factor * y:.1f} mm"
    raise MotionTooSmall(
        f"{spans}, from which the zeros follow with a condition number of {observed.condition_number:.0f}, and"
        f" {MOST_CONDITION:.0f} is the most: {advice}"
    )


def _enlargement(model: Manipulator, theta: Array, start: tuple[float, float]) -> float | None:
    """How many times larger the same motion would tell enough; None if no larger one would."""
    path = close(Geometry.of(model), theta, np.array(start)).position[:: max(1, len(theta) // FEWEST)]
    middle = (path.max(axis=0) + path.min(axis=0)) / 2
    for factor in np.geomspace(1.1, _LARGEST, 32).tolist():
        try:
            larger = np.array([model.inverse_kinematics(at).theta for at in middle + factor * (path - middle)])
            seen = observe(model, larger, (float(middle[0]), float(middle[1])))
        except (SingularPoseError, ValueError):
            return None
        if seen.condition_number <= MOST_CONDITION:
            return float(factor)
    return None


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """Least squares of the closure residuals; unknowns are the zeros [rad] and, in tolerances, the twelve lengths."""

    nominal: Geometry
    theta: Array
    start: Array
    tolerance: float
    _last: dict[bytes, tuple[Array, Array]] = field(default_factory=dict)

    def geometry(self, unknowns: Array) -> Geometry:
        """The geometry that the unknowns mean."""
        if len(unknowns) == LEGS:
            return self.nominal
        change = self.tolerance * unknowns[LEGS:]
        return replace(
            self.nominal,
            bases=self.nominal.bases + change[: 2 * LEGS].reshape(LEGS, 2),
            proximal=self.nominal.proximal + change[2 * LEGS : 3 * LEGS],
            distal=self.nominal.distal + change[3 * LEGS :],
        )

    def rows(self, unknowns: Array) -> tuple[Array, Array]:
        """Residuals, shape (n,) [rad], and their derivatives, shape (n, unknowns); the last answer is kept."""
        key = unknowns.tobytes()
        if key not in self._last:
            answer = self._work_out(unknowns)
            self._last.clear()
            self._last[key] = answer
        return self._last[key]

    def _work_out(self, unknowns: Array) -> tuple[Array, Array]:
        closed = close(self.geometry(unknowns), self.theta + unknowns[:LEGS], self.start)
        slopes = closed.normals
        if len(unknowns) > LEGS:
            by_leg = -self.tolerance * closed.normals[:, :, None] * closed.slopes
            bases = by_leg[:, :, :2].reshape(len(slopes), 2 * LEGS)
            slopes = np.concatenate([slopes, bases, by_leg[:, :, 2], by_leg[:, :, 3]], axis=1)
        return closed.residuals, slopes

    def solved(self, count: int) -> tuple[Array, float]:
        """So many unknowns, and the size of a residual [rad]; the tolerance weighs against what a round finds of it."""
        solution, sigma = np.zeros(count), 1.0
        for _ in range(_ROUNDS):
            solution = self.solve(solution, sigma)
            sigma = math.sqrt(float(np.mean(self.rows(solution)[0] ** 2)))
        return solution, sigma

    def solve(self, first: Array, sigma: float) -> Array:
        """The unknowns, from a first guess; `sigma` is the size of a residual [rad]."""
        prior = np.eye(len(first))[LEGS:]

        def residuals(unknowns: Array) -> Array:
            return np.concatenate([self.rows(unknowns)[0] / sigma, unknowns[LEGS:]])

        def slopes(unknowns: Array) -> Array:
            return np.concatenate([self.rows(unknowns)[1] / sigma, prior])

        found: Array = least_squares(residuals, first, slopes, method="lm", xtol=1e-11).x
        return found


def _half_widths(residuals: Array, slopes: Array, lags: int, sigma: float) -> Array:
    """Half of each unknown's interval of confidence, shape of the unknowns."""
    if slopes.shape[1] == LEGS:
        kept = np.ones(len(residuals), dtype=np.bool_)
        fit = least_squares_in_time(slopes[:, None, :], -residuals[:, None], kept, lags=lags)
        return (fit.high - fit.low) / 2
    prior = np.diag([0.0] * LEGS + [1.0] * (slopes.shape[1] - LEGS))
    half: Array = _NORMAL * np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes / sigma**2 + prior)))
    return half
