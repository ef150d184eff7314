"""Kernels of the machine at rest: does friction hold the load, when does it give way, and which joints then move.

Three frictions on two freedoms are set-valued: the machine stays if and only if some f within the breakaway limits has
S' f = load. Such loads form a hexagon with sides along the rows of S, so three inequalities decide.
"""

from math import copysign

from torquerig.device_sim.plant.layout import (
    ALL,
    BREAKAWAY,
    DEMAND,
    LAG,
    NOBODY,
    POSITION,
    ROWS,
    SIGN,
    TORQUE,
)
from torquerig.device_sim.plant.motor import NEVER, crossing_time
from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import GEAR, Floats, leg_at, leg_inertia, rows_of

Pair = tuple[float, float]
Triple = tuple[float, float, float]


@compiled
def resting_joint(s: Floats) -> int:
    """The joint that rests while the others slide, or NOBODY, or ALL."""
    if s[SIGN] == 0.0 and s[SIGN + 1] == 0.0:  # two at rest leave the mechanism no freedom
        return ALL
    for i in range(3):
        if s[SIGN + i] == 0.0:
            return i
    return NOBODY


@compiled
def resting_inertia(p: Floats, s: Floats) -> Triple:
    """Mt as xx, xy, yy where the machine rests; notes S there in the state."""
    mxx = mxy = myy = 0.0
    for i in range(3):
        leg = leg_at(p, i, s[POSITION], s[POSITION + 1])
        rows = rows_of(p, leg)
        s[ROWS + 2 * i] = rows[0]
        s[ROWS + 2 * i + 1] = rows[1]
        xx, xy, yy = leg_inertia(p, i, leg, rows)
        mxx += xx
        mxy += xy
        myy += yy
    return mxx, mxy, myy


@compiled
def holding_time(p: Floats, f: Floats, s: Floats) -> float:
    """For how long friction will hold the machine while the torques run towards their demands [s].

    The side of the hexagon along S_i: |S_i x load| <= sum_j F_j |S_i x S_j|, load = n S' tau_m.
    """
    shortest = NEVER
    for i in range(3):
        now = later = limit = 0.0
        for j in range(3):
            cross = s[ROWS + 2 * i] * s[ROWS + 2 * j + 1] - s[ROWS + 2 * i + 1] * s[ROWS + 2 * j]
            now += p[GEAR] * s[TORQUE + j] * cross
            later += p[GEAR] * s[DEMAND + j] * cross
            limit += f[BREAKAWAY + j] * abs(cross)
        shortest = min(shortest, crossing_time(f[LAG], now, later, limit))
    return shortest


@compiled
def trial_motion(s: Floats, inertia: Triple, load: Pair, limit: Triple, trial: int) -> Triple:
    """A candidate for `first_motion`: an acceleration, and its cost.

    Trials 0 to 2: joint 0 to 2 rests, the best on its line. Trials 3 to 10: the best while each joint slides one way.
    """
    mxx, mxy, myy = inertia
    fx, fy = load
    tx = -s[ROWS + 2 * (trial % 3) + 1]
    ty = s[ROWS + 2 * (trial % 3)]
    along = tx * fx + ty * fy
    drag = 0.0
    for j in range(3):
        drag += limit[j] * abs(s[ROWS + 2 * j] * tx + s[ROWS + 2 * j + 1] * ty)
        friction = limit[j] if ((trial - 3) >> j) & 1 else -limit[j]
        fx -= friction * s[ROWS + 2 * j]
        fy -= friction * s[ROWS + 2 * j + 1]
    ax = (myy * fx - mxy * fy) / (mxx * myy - mxy * mxy)
    ay = (mxx * fy - mxy * fx) / (mxx * myy - mxy * mxy)
    if trial < 3:
        pace = copysign(max(abs(along) - drag, 0.0), along)
        pace /= mxx * tx * tx + 2.0 * mxy * tx * ty + myy * ty * ty
        ax, ay = pace * tx, pace * ty
    cost = 0.5 * (mxx * ax * ax + 2.0 * mxy * ax * ay + myy * ay * ay) - load[0] * ax - load[1] * ay
    for j in range(3):
        cost += limit[j] * abs(s[ROWS + 2 * j] * ax + s[ROWS + 2 * j + 1] * ay)
    return ax, ay, cost


@compiled
def first_motion(p: Floats, s: Floats, inertia: Triple, limit: Triple) -> bool:
    """Solves min over a of 1/2 a'Mt a - load'a + sum_i F_i |S_i a|, the acceleration out of rest.

    Convex, two unknowns, three kink lines: the minimum is the origin, or on a line (that joint rests), or between
    lines. All are tried and the least cost wins, so that no tolerance decides.

    Returns:
        Whether the machine moves; the joints' directions then stand in the state, 0 for one that rests.
    """
    fx = fy = 0.0
    for j in range(3):
        fx += p[GEAR] * s[TORQUE + j] * s[ROWS + 2 * j]
        fy += p[GEAR] * s[TORQUE + j] * s[ROWS + 2 * j + 1]
    best = best_x = best_y = 0.0
    resting = NOBODY
    for trial in range(11):
        ax, ay, cost = trial_motion(s, inertia, (fx, fy), limit, trial)
        if cost < best:
            best, best_x, best_y = cost, ax, ay
            resting = trial if trial < 3 else NOBODY
    for j in range(3):
        rate = s[ROWS + 2 * j] * best_x + s[ROWS + 2 * j + 1] * best_y
        s[SIGN + j] = 0.0 if j == resting or best == 0.0 else copysign(1.0, rate)
    return best < 0.0
