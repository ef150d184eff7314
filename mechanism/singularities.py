"""Where the machine is singular, and how far that is: what the loop's limits ask every cycle."""

from itertools import combinations
from math import hypot, sqrt
from typing import Final

from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import BASES, DIRECT, DIRECT_COUNT, LENGTH, NEAR_ZERO, Floats, leg_at, rows_of

Point = tuple[float, float]

_TOLERANCE: Final = 1e-9
"""Of lengths, relative to a link, when circles are held to touch; far below what a machine is built to."""


def direct_singularities(bases: tuple[Point, ...], length: float, branches: tuple[int, ...]) -> list[Point]:
    """The poses in which all three distal links lie on one line, in a working mode (2.4) [m].

    Of three parallel links of one length that meet in C two coincide: their elbows are one point P, at a link's
    length from both base joints. The third lies along them or opposite: its elbow is 2C - P. The thesis' machine has
    two such poses, in other working modes than its own. (Were all three base joints at a link's length from one P, a
    whole circle about it would be singular; that is not listed, `conditioning` sees it.)

    Args:
        bases: The three base joints [m].
        length: Of every link [m].
        branches: Each leg's elbow sign.
    """
    found: list[Point] = []
    for i, j in combinations(range(len(bases)), 2):
        k = 3 - i - j
        for elbow in _meetings(bases[i], length, bases[j], length):
            for opposite in _meetings(bases[k], length, elbow, 2.0 * length):
                x, y = 0.5 * (elbow[0] + opposite[0]), 0.5 * (elbow[1] + opposite[1])
                legs = ((bases[i], elbow), (bases[j], elbow), (bases[k], opposite))
                signs = (branches[i], branches[j], branches[k])
                if all(_bends(base, at, (x, y)) * sign > 0.0 for (base, at), sign in zip(legs, signs, strict=True)):
                    found.append((x, y))
    return found


def _meetings(a: Point, ra: float, b: Point, rb: float) -> list[Point]:
    """Where two circles meet: two points, one if they touch, or none."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    d = hypot(dx, dy)
    along = (d * d + ra * ra - rb * rb) / (2.0 * d)
    square = ra * ra - along * along
    if square < -_TOLERANCE * ra * ra:
        return []
    height = sqrt(max(square, 0.0))
    sides = (1.0, -1.0) if height > _TOLERANCE * ra else (0.0,)
    return [(a[0] + (along * dx - s * height * dy) / d, a[1] + (along * dy + s * height * dx) / d) for s in sides]


def _bends(base: Point, elbow: Point, end: Point) -> float:
    """Above 0 if the elbow lies to the left of the way from base joint to end, as in branch +1."""
    return (end[0] - base[0]) * (elbow[1] - base[1]) - (end[1] - base[1]) * (elbow[0] - base[0])


@compiled
def conditioning(p: Floats, x: float, y: float) -> float:
    """sigma_min / sigma_max of S; 0 where a leg is stretched, folded or out of reach."""
    xx = 0.0
    xy = 0.0
    yy = 0.0
    volume = 0.0  # (sigma_min sigma_max)², the sum of the minors' squares: without cancellation
    ax = ay = bx = by = 0.0
    for i in range(3):
        leg = leg_at(p, i, x, y)
        if abs(leg[4]) < NEAR_ZERO:
            return 0.0
        tx, ty, _, _ = rows_of(p, leg)
        xx += tx * tx
        xy += tx * ty
        yy += ty * ty
        volume += (ax * ty - ay * tx) ** 2 + (bx * ty - by * tx) ** 2
        ax, ay, bx, by = bx, by, tx, ty
    return 2.0 * sqrt(volume) / (xx + yy + hypot(xx - yy, 2.0 * xy))


@compiled
def singularity_distance(p: Floats, x: float, y: float) -> float:
    """Metres to the nearest singular pose of the working mode; below 0 out of reach, nan for nan.

    A leg is stretched on the circle of radius 2L about its base joint, and folded in its middle.
    """
    nearest: float = 2.0 * p[LENGTH]
    for i in range(3):
        r = hypot(x - p[BASES + 2 * i], y - p[BASES + 2 * i + 1])
        for distance in (r, 2.0 * p[LENGTH] - r):
            if not distance >= nearest:
                nearest = distance
    for k in range(int(p[DIRECT_COUNT])):
        distance = hypot(x - p[DIRECT + 2 * k], y - p[DIRECT + 2 * k + 1])
        if not distance >= nearest:
            nearest = distance
    return nearest
