"""How flat an optimum is: how far each parameter moves at next to no cost, and which parameters move together."""

import math
from typing import Final, NamedTuple

import numpy as np

from torquerig.plant_fit.problem import Array, Problem, factor_of
from torquerig.plant_fit.search import Optimum, slopes

LEEWAY: Final = 1.01
"""The typical factor may become 1 % greater."""
_WIDTH: Final = 0.02
"""Half width of the slopes, as a share of the ranges."""
_HALVINGS: Final = 5
"""Of the way to where a direction ends: the interval's ends are known to 3 % of it."""
_RIDGE: Final = 1e-9
"""Against a parameter that changes nothing, relative to the greatest curvature."""


class Flatness(NamedTuple):
    """What surrounds an optimum.

    Attributes:
        lowest: How far down each parameter goes within the leeway while the others give way, shape (k,) [share].
        highest: How far up, shape (k,) [share].
        correlation: Of the parameters along the valley, shape (k, k); +1 or -1 are not told apart by the data.
        condition: Condition number of the slopes, the parameters in shares of their ranges.
    """

    lowest: Array
    highest: Array
    correlation: Array
    condition: float


def flatness(problem: Problem, optimum: Optimum) -> Flatness:
    """Look around an optimum on all runs.

    The slopes give the valley's shape: the direction in which each parameter goes farthest at a given cost while the
    others give way (J'J is half of the cost's Hessian, but for terms of second order). How far it really goes is
    measured along that direction, by halving, because the cost is rough and saturates.

    Args:
        problem: The problem.
        optimum: The optimum.

    Returns:
        What is there.
    """
    J = slopes(problem, optimum.point, problem.all_runs(), _WIDTH)
    curvature = J.T @ J
    covariance = np.linalg.inv(curvature + _RIDGE * np.max(np.diag(curvature)) * np.eye(len(curvature)))
    spread = np.sqrt(np.diag(covariance))
    singular = np.linalg.svd(J, compute_uv=False)
    directions = covariance / np.diag(covariance)  # column i: parameter i by 1, the others along the valley
    ends = _ends(problem, optimum, [*-directions.T, *directions.T])
    k = len(spread)
    own = np.array([end[place % k] for place, end in enumerate(ends)])
    return Flatness(
        lowest=np.minimum(own[:k], optimum.point),
        highest=np.maximum(own[k:], optimum.point),
        correlation=covariance / np.outer(spread, spread),
        condition=float(singular[0] / singular[-1]) if singular[-1] > 0 else math.inf,
    )


def _ends(problem: Problem, optimum: Optimum, directions: list[Array]) -> list[Array]:
    """Where the leeway ends in each direction, or the box does."""
    bearable = LEEWAY * optimum.factor
    longest = [_way_out(optimum.point, direction) for direction in directions]
    good = np.zeros(len(directions))
    tried = np.ones(len(directions))
    for halving in range(_HALVINGS + 1):
        shares = tried * longest
        points = [optimum.point + share * direction for share, direction in zip(shares, directions, strict=True)]
        rows = problem.residuals([np.clip(point, 0.0, 1.0) for point in points], problem.all_runs())
        held = np.array([factor_of(row) <= bearable for row in rows])
        good = np.where(held, tried, good)
        step = 0.5 ** (halving + 1)
        tried = np.where(held, np.minimum(tried + step, 1.0), tried - step)
    return [
        optimum.point + share * way * direction for share, way, direction in zip(good, longest, directions, strict=True)
    ]


def _way_out(point: Array, direction: Array) -> float:
    """How far a direction leads before it leaves the box."""
    ways = [
        ((1.0 if slope > 0 else 0.0) - at) / slope for at, slope in zip(point, direction, strict=True) if slope != 0.0
    ]
    return max(min(ways, default=0.0), 0.0)
