"""Kernels of the moving machine: acceleration with one joint held or none, one RK4 step, where a step must end.

Between two events friction is smooth: each sliding joint has its Coulomb torque against a known direction, and at most
one joint rests (two resting joints would stop the machine). A step that runs across an event is cut at the event.
"""

# ruff: noqa: PLR0917  -- a kernel takes plain numbers, as many as the equation has

from typing import Final

from torquerig.device_sim.plant.layout import (
    BREAKAWAY,
    COULOMB,
    CROWD,
    DEMAND,
    ELBOW,
    EVENTS,
    LAG,
    NOBODY,
    POSITION,
    SIGN,
    TORQUE,
    VELOCITY,
)
from torquerig.device_sim.plant.motor import NEVER, remaining_share
from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import (
    GEAR,
    LENGTH,
    Floats,
    leg_at,
    leg_bias,
    leg_inertia,
    row_rates_of,
    rows_of,
)
from torquerig.mechanism.solvers import gram

Triple = tuple[float, float, float]
Motion = tuple[float, float, float, float]  # x, y [m], vx, vy [m/s]
Stride = tuple[Motion, float, int]  # motion, time taken [s], joint

SHARP: Final = 1e-12  # how far beyond an event a step may end [rad/s or N·m]
MOMENT: Final = 1e-14  # events are not told apart within this time [s]
TRIALS: Final = 60  # enough for bisection from 100 us down to MOMENT
LEAST_SINE: Final = 0.05  # of an elbow angle, at the edge of the workspace
LEAST_CONDITION: Final = 0.01  # sigma_min / sigma_max of S there
FASTEST: Final = 1e3  # [m/s]; beyond: the trial step has left the equations' ground


@compiled
def net_torque(p: Floats, f: Floats, s: Floats, share: float) -> Triple:
    """Motor torque minus Coulomb friction at each joint [N·m], when `share` of the torque's change is still to come."""
    a = p[GEAR] * (s[DEMAND] + share * (s[TORQUE] - s[DEMAND])) - s[SIGN] * f[COULOMB]
    b = p[GEAR] * (s[DEMAND + 1] + share * (s[TORQUE + 1] - s[DEMAND + 1])) - s[SIGN + 1] * f[COULOMB + 1]
    c = p[GEAR] * (s[DEMAND + 2] + share * (s[TORQUE + 2] - s[DEMAND + 2])) - s[SIGN + 2] * f[COULOMB + 2]
    return a, b, c


@compiled
def acceleration(p: Floats, motion: Motion, torque: Triple, held: int) -> Triple:
    """Acceleration under joint torques [m/s²], and the friction that keeps joint `held` at its angle [N·m]."""
    x, y, vx, vy = motion
    mxx = mxy = myy = fx = fy = hx = hy = turn = 0.0
    for i in range(3):
        leg = leg_at(p, i, x, y)
        rows = rows_of(p, leg)
        rates = row_rates_of(p, leg, rows, vx, vy)
        xx, xy, yy = leg_inertia(p, i, leg, rows)
        bx, by = leg_bias(p, i, leg, rows, rates, vx, vy)
        mxx += xx
        mxy += xy
        myy += yy
        fx += torque[i] * rows[0] - bx
        fy += torque[i] * rows[1] - by
        if i == held:
            hx, hy = rows[0], rows[1]
            turn = rates[0] * vx + rates[1] * vy
    determinant = mxx * myy - mxy * mxy
    ax = (myy * fx - mxy * fy) / determinant
    ay = (mxx * fy - mxy * fx) / determinant
    if held == NOBODY:
        return ax, ay, 0.0
    gx = (myy * hx - mxy * hy) / determinant
    gy = (mxx * hy - mxy * hx) / determinant
    friction = (hx * ax + hy * ay + turn) / (hx * gx + hy * gy)
    return ax - friction * gx, ay - friction * gy, friction


@compiled
def rk4(p: Floats, f: Floats, s: Floats, held: int, h: float) -> Motion:
    """The motion after `h`, classic Runge-Kutta; torques at the stages are exact."""
    x, y, vx, vy = s[POSITION], s[POSITION + 1], s[VELOCITY], s[VELOCITY + 1]
    sum_x = sum_y = sum_vx = sum_vy = 0.0
    stage = (x, y, vx, vy)
    middle = remaining_share(0.5 * h, f[LAG])
    end = remaining_share(h, f[LAG])
    for k in range(4):  # a loop keeps the compiled code, and with it the compiler's work, a quarter the size
        share = end if k == 3 else (1.0 if k == 0 else middle)
        ax, ay, _ = acceleration(p, stage, net_torque(p, f, s, share), held)
        weight = h / 3.0 if 1 <= k <= 2 else h / 6.0
        sum_x += weight * stage[2]
        sum_y += weight * stage[3]
        sum_vx += weight * ax
        sum_vy += weight * ay
        ahead = h if k == 2 else 0.5 * h
        stage = (x + ahead * stage[2], y + ahead * stage[3], vx + ahead * ax, vy + ahead * ay)
    return x + sum_x, y + sum_y, vx + sum_vx, vy + sum_vy


@compiled
def margin(p: Floats, f: Floats, s: Floats, held: int, motion: Motion, share: float) -> tuple[float, int]:
    """How far the motion is from its next event, and at which joint.

    For a sliding joint: its rate in its direction [rad/s]. For the held one: what friction has left [N·m], unless
    events crowd. Joints without friction have no events.
    """
    x, y, vx, vy = motion
    least = NEVER
    joint = NOBODY
    for i in range(3):
        if i == held:
            if s[EVENTS] >= CROWD:
                continue
            room = f[BREAKAWAY + i] - abs(acceleration(p, motion, net_torque(p, f, s, share), held)[2])
        elif f[BREAKAWAY + i] > 0.0:
            rows = rows_of(p, leg_at(p, i, x, y))
            room = s[SIGN + i] * (rows[0] * vx + rows[1] * vy)
        else:
            continue
        if room < least:
            least = room
            joint = i
    return least, joint


@compiled
def stride(p: Floats, f: Floats, s: Floats, held: int, h: float) -> Stride:
    """One step of `h`, or the part of it that ends just past the first event (Illinois' false position).

    Returns:
        The motion then, the time taken, and the joint whose event it is, or NOBODY.
    """
    before = left = 0.0  # no margin is known at the start, and right after an event it is 0: bisect at first
    after = trial = h
    right = 0.0
    for _ in range(TRIALS):
        motion = rk4(p, f, s, held, trial)
        room, joint = margin(p, f, s, held, motion, remaining_share(trial, f[LAG]))
        if room < 0.0:
            after, right, left = trial, room, 0.5 * left
            if room >= -SHARP or after - before <= MOMENT:
                break
        elif trial == h:
            return motion, h, NOBODY
        else:
            before, left, right = trial, room, 0.5 * right
        trial = after - (after - before) * right / (right - left) if left > 0.0 else 0.5 * (before + after)
        if not before < trial < after:
            trial = after
    return motion, trial, joint


@compiled
def arrested(p: Floats, motion: Motion, joint: int) -> tuple[float, float]:
    """The velocity after an inelastic stop of one joint: v, projected onto S_i v = 0 in the inertia's metric [m/s]."""
    x, y, vx, vy = motion
    mxx = mxy = myy = hx = hy = 0.0
    for i in range(3):
        leg = leg_at(p, i, x, y)
        rows = rows_of(p, leg)
        xx, xy, yy = leg_inertia(p, i, leg, rows)
        mxx += xx
        mxy += xy
        myy += yy
        if i == joint:
            hx, hy = rows[0], rows[1]
    gx = myy * hx - mxy * hy
    gy = mxx * hy - mxy * hx
    impulse = (hx * vx + hy * vy) / (hx * gx + hy * gy)
    return vx - impulse * gx, vy - impulse * gy


@compiled
def on_circle(p: Floats, s: Floats, motion: Motion) -> Motion:
    """The motion with its position put back onto the circle about the held joint's elbow: no drift of its angle."""
    x, y, vx, vy = motion
    dx = x - s[ELBOW]
    dy = y - s[ELBOW + 1]
    scale = p[LENGTH] / (dx * dx + dy * dy) ** 0.5
    return s[ELBOW] + scale * dx, s[ELBOW + 1] + scale * dy, vx, vy


@compiled
def inside(p: Floats, motion: Motion) -> bool:
    """Whether the pose is clear of all singularities; nan is outside."""
    x, y, vx, vy = motion
    if not abs(vx) + abs(vy) < FASTEST:
        return False
    for i in range(3):
        dx, dy, _, _, sine, _ = leg_at(p, i, x, y)
        if not (dx * dx + dy * dy < 4.0 * p[LENGTH] * p[LENGTH] and abs(sine) > LEAST_SINE):
            return False
    return gram(p, x, y)[3] > LEAST_CONDITION * LEAST_CONDITION
