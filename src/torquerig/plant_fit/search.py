"""The search: a screening of the whole box, then Gauss-Newton descents from its best points.

The errors are rough in the parameters: joints stick and slip, encoders count, torques saturate. Slopes over a
thousandth of a range are mostly noise, and a solver's own differences of 1e-8 are nothing else. So slopes are central
differences over 5 % of each range, then over 2 %. What else was tried, with figures: docs/fit-plant.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from torquerig.plant_fit.parameters import to_unit, value_in
from torquerig.plant_fit.problem import Array, Problem, columns, factor_of

_INSIDE: Final = 1e-3
"""How far from a bound a descent begins: scipy wants its start strictly inside."""
_BATCH: Final = 16
"""Points of the screening that are given out at once: few enough for a progress that moves."""
_TOLERANCE: Final = 1e-3
"""Relative change of point or cost at which a descent ends: roughness hides finer ones."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How much a search may try.

    Attributes:
        screened: Points of the screening, a power of two.
        starts: Descents that are begun.
        rough: Steps after which only the best of them go on.
        kept: How many go on.
        iterations: Their steps at each width, at most.
        widths: Half widths of the differences, as shares of the ranges, coarse to fine.
    """

    screened: int = 64
    starts: int = 6
    rough: int = 4
    kept: int = 2
    iterations: int = 8
    widths: tuple[float, ...] = (0.05, 0.02)

    def plants(self, parameters: int) -> int:
        """How many plants a search tries at most."""
        steps = self.starts * self.rough + self.kept * len(self.widths) * self.iterations
        return self.screened + 1 + steps * (2 * parameters + 1)


class Screening(NamedTuple):
    """What the screening has found.

    Attributes:
        points: Shape (n, k).
        residuals: Of all runs, shape (n, 2 x runs).
    """

    points: Array
    residuals: Array

    def best(self, which: Sequence[int], count: int) -> list[Array]:
        """The best points for some runs, the best first."""
        cost = np.sum(self.residuals[:, columns(which)] ** 2, axis=1)
        return [self.points[place] for place in np.argsort(cost, kind="stable")[:count]]


class Optimum(NamedTuple):
    """Where a descent has ended.

    Attributes:
        point: The point, shape (k,).
        residuals: Of the runs that were fitted.
    """

    point: Array
    residuals: Array

    @property
    def factor(self) -> float:
        """Its typical factor."""
        return factor_of(self.residuals)


def screen(problem: Problem, effort: Effort, seed: int) -> Screening:
    """Try points all over the box, and the plant that the fit begins with.

    Args:
        problem: The problem.
        effort: How many points.
        seed: Of the points: a scrambled Sobol sequence.

    Returns:
        The points and their residuals.
    """
    k = len(problem.parameters)
    start = to_unit(problem.parameters, [value_in(problem.plant, each.name) for each in problem.parameters])
    points: Array = np.vstack([qmc.Sobol(k, seed=np.random.default_rng(seed)).random(effort.screened), start])
    rows = [
        problem.residuals(list(points[at : at + _BATCH]), problem.all_runs()) for at in range(0, len(points), _BATCH)
    ]
    return Screening(points, np.concatenate(rows))


def descend(problem: Problem, start: Array, which: Sequence[int], effort: Effort) -> Optimum:
    """Gauss-Newton from a start, with differences that become finer.

    Args:
        problem: The problem.
        start: Where to begin, shape (k,).
        which: The runs to fit.
        effort: Widths and iterations.

    Returns:
        Where it ended: not worse than the start.
    """
    best = Optimum(start, problem.residuals([start], which)[0])
    for width in effort.widths:
        found = _gauss_newton(problem, best.point, which, width, effort.iterations)
        if found.factor < best.factor:
            best = found
    return best


def _gauss_newton(problem: Problem, start: Array, which: Sequence[int], width: float, iterations: int) -> Optimum:
    """One descent with slopes over one width."""

    def residuals(point: Array) -> Array:
        row: Array = problem.residuals([point], which)[0]
        return row

    def jacobian(point: Array) -> Array:
        return slopes(problem, point, which, width)

    found = least_squares(
        residuals,
        np.clip(start, _INSIDE, 1 - _INSIDE),
        jac=jacobian,
        bounds=(0.0, 1.0),
        max_nfev=iterations,
        xtol=_TOLERANCE,
        ftol=_TOLERANCE,
        gtol=None,
    )
    return Optimum(found.x, found.fun)


def optima(problem: Problem, screening: Screening, which: Sequence[int], effort: Effort) -> list[Optimum]:
    """Descents from the best points of a screening; the best of them go on to their end.

    Args:
        problem: The problem.
        screening: The points to choose from.
        which: The runs to fit.
        effort: How many descents.

    Returns:
        Where those that went on ended, the best first.
    """
    starts = screening.best(which, effort.starts)
    begun = [_gauss_newton(problem, start, which, effort.widths[0], effort.rough) for start in starts]
    begun.sort(key=lambda optimum: optimum.factor)
    found = [descend(problem, rough.point, which, effort) for rough in begun[: effort.kept]]
    return sorted(found, key=lambda optimum: optimum.factor)


def slopes(problem: Problem, point: Array, which: Sequence[int], width: float) -> Array:
    """How the residuals change with each parameter, over a width on either side, or as much as the bounds leave.

    Args:
        problem: The problem.
        point: Where, shape (k,).
        which: The runs.
        width: On either side, as a share of the range.

    Returns:
        Shape (2 x runs, k) [per range of the parameter].
    """
    k = len(point)
    highs = np.clip(point + width * np.eye(k), 0.0, 1.0)
    lows = np.clip(point - width * np.eye(k), 0.0, 1.0)
    rows = problem.residuals([*highs, *lows], which)
    spans = np.diagonal(highs) - np.diagonal(lows)
    return ((rows[:k] - rows[k:]) / spans[:, None]).T
