"""The machine's equations on plain floats, compiled: what the methods of Manipulator and a plant's integrator call.

A *leg* is two links from the base joint A over the elbow B to the end-effector C. All entry points take the packed
constants `p` (layout below) and write into the caller's arrays; none allocates, none raises: the status tells.
"""

# ruff: noqa: PLR0917  -- a kernel takes plain numbers, as many as the equation has

from math import acos, atan2, cos, hypot, sin, sqrt
from typing import Final

from numpy import float64
from numpy.typing import NDArray

from torquerig.mechanism.compiled import compiled

Floats = NDArray[float64]
Leg = tuple[float, float, float, float, float, float]
Legs = tuple[Leg, Leg, Leg]
Rows = tuple[float, float, float, float]
AllRows = tuple[Rows, Rows, Rows]
Plane = tuple[float, float]

# layout of the packed constants p
BASES: Final = 0  # x1 y1 x2 y2 x3 y3 [m]
LENGTH: Final = 6  # [m]
ALPHA: Final = 7  # three each: alpha with the actuator's inertia, beta, gamma [kg·m²]
BETA: Final = 10
GAMMA: Final = 13
K1: Final = 16  # viscous, active joints [N·m·s/rad]
K2: Final = 17  # viscous, passive joints
GEAR: Final = 18
BRANCH: Final = 19  # three elbow signs
FACING: Final = 22  # three reference directions of theta [rad]
DIRECT_COUNT: Final = 25  # how many direct singularities the working mode has
DIRECT: Final = 26  # their places x1 y1 x2 y2 ... [m]: for each pair of legs up to two elbows, for each two poses
PACKED: Final = 50

OK: Final = 0
OUT_OF_REACH: Final = 1  # + leg index 0, 1, 2
SINGULAR_LEG: Final = 4  # + leg index
SINGULAR: Final = 7

NEAR_ZERO: Final = 1e-7
"""Sine of a leg's elbow angle, and relative determinant, from which on a pose counts as singular."""


@compiled
def leg_at(p: Floats, i: int, x: float, y: float) -> Leg:
    """Leg i with its end in (x, y): d_x, d_y, b_x, b_y [m], sin phi, cos phi (mechanism: geometry).

    Without trigonometry: B lies beside the middle of d, at half the chord's height k, with k² = L² - |d|² / 4. Out of
    reach, or folded on the base joint, both squares are held at a floor, so that an integrator's trial step gets
    numbers instead of nan.
    """
    area = p[LENGTH] * p[LENGTH]
    dx = x - p[BASES + 2 * i]
    dy = y - p[BASES + 2 * i + 1]
    square = max(dx * dx + dy * dy, 1e-18 * area)
    side = p[BRANCH + i] * sqrt(max(area - 0.25 * square, 1e-18 * area) / square)  # +-k / |d|
    bx = 0.5 * dx + side * dy
    by = 0.5 * dy - side * dx
    return dx, dy, bx, by, -side * square / area, 0.5 * square / area - 1.0


@compiled
def rows_of(p: Floats, leg: Leg) -> Rows:
    """The leg's two rows of W (5.12): theta row b / e, phi row -d / e, with e = L² sin phi."""
    dx, dy, bx, by, s, _ = leg
    e = p[LENGTH] * p[LENGTH] * s
    return bx / e, by / e, -dx / e, -dy / e


@compiled
def row_rates_of(p: Floats, leg: Leg, rows: Rows, vx: float, vy: float) -> Rows:
    """The leg's two rows of Wdot at the task velocity (vx, vy)."""
    _, _, bx, by, s, c = leg
    tx, ty, px, py = rows
    area = p[LENGTH] * p[LENGTH]
    e = area * s
    phi_rate = px * vx + py * vy
    world_rate = tx * vx + ty * vy + phi_rate
    stretch = area * c * phi_rate / e  # edot / e
    tdx = -world_rate * by / e - tx * stretch
    tdy = world_rate * bx / e - ty * stretch
    return tdx, tdy, -vx / e - px * stretch, -vy / e - py * stretch


@compiled
def legs_at(p: Floats, x: float, y: float) -> Legs:
    """All legs."""
    return leg_at(p, 0, x, y), leg_at(p, 1, x, y), leg_at(p, 2, x, y)


@compiled
def rows_at(p: Floats, legs: Legs) -> AllRows:
    """All legs' rows of W."""
    return rows_of(p, legs[0]), rows_of(p, legs[1]), rows_of(p, legs[2])


@compiled
def status_of(p: Floats, legs: Legs) -> int:
    """OK, or OUT_OF_REACH + leg, or SINGULAR_LEG + leg: what W needs before it may be computed."""
    for i in range(3):
        if not hypot(legs[i][0], legs[i][1]) <= 2.0 * p[LENGTH]:
            return OUT_OF_REACH + i
    for i in range(3):
        if abs(legs[i][4]) < NEAR_ZERO:
            return SINGULAR_LEG + i
    return OK


@compiled
def reach_status(p: Floats, x: float, y: float) -> int:
    """The same of a place."""
    return status_of(p, legs_at(p, x, y))


@compiled
def leg_angles(p: Floats, i: int, x: float, y: float) -> tuple[float, float]:
    """The leg's theta = psi + s h and phi = -2 s h [rad] (5.6); theta is cut behind the base joint, never inside."""
    dx = x - p[BASES + 2 * i]
    dy = y - p[BASES + 2 * i + 1]
    ux = cos(p[FACING + i])
    uy = sin(p[FACING + i])
    h = acos(min(0.5 * hypot(dx, dy) / p[LENGTH], 1.0))
    psi = p[FACING + i] + atan2(ux * dy - uy * dx, ux * dx + uy * dy)
    return psi + p[BRANCH + i] * h, -2.0 * p[BRANCH + i] * h


@compiled
def inverse_kinematics(p: Floats, position: Floats, theta: Floats, phi: Floats) -> int:
    """All joint angles, or OUT_OF_REACH + leg."""
    for i in range(3):
        if not hypot(position[0] - p[BASES + 2 * i], position[1] - p[BASES + 2 * i + 1]) <= 2.0 * p[LENGTH]:
            return OUT_OF_REACH + i
        theta[i], phi[i] = leg_angles(p, i, position[0], position[1])
    return OK


@compiled
def meeting(p: Floats, theta_1: float, theta_2: float, theta_3: float) -> tuple[int, Plane, Plane, Plane, Plane]:
    """A status, the first elbow, and relative to it the two others and the point at equal distance from all three.

    (5.3), (5.4) with the denominator put right. The printed form subtracts squares of distances from the origin.
    """
    length = p[LENGTH]
    x1 = p[BASES] + length * cos(theta_1)
    y1 = p[BASES + 1] + length * sin(theta_1)
    x2 = p[BASES + 2] + length * cos(theta_2) - x1
    y2 = p[BASES + 3] + length * sin(theta_2) - y1
    x3 = p[BASES + 4] + length * cos(theta_3) - x1
    y3 = p[BASES + 5] + length * sin(theta_3) - y1
    n2 = x2 * x2 + y2 * y2
    n3 = x3 * x3 + y3 * y3
    denominator = 2.0 * (x2 * y3 - x3 * y2)
    status = OK if abs(denominator) > NEAR_ZERO * length * length else SINGULAR
    x = (n2 * y3 - n3 * y2) / denominator
    y = (n3 * x2 - n2 * x3) / denominator
    return status, (x1, y1), (x2, y2), (x3, y3), (x, y)


@compiled
def forward_kinematics(p: Floats, theta: Floats, position: Floats, residuals: Floats) -> int:
    """The point at equal distance from the three elbows, and |C - B_i| - L."""
    status, (x1, y1), (x2, y2), (x3, y3), (x, y) = meeting(p, theta[0], theta[1], theta[2])
    if status != OK:
        return status
    position[0] = x1 + x
    position[1] = y1 + y
    residuals[0] = hypot(x, y) - p[LENGTH]
    residuals[1] = hypot(x - x2, y - y2) - p[LENGTH]
    residuals[2] = hypot(x - x3, y - y3) - p[LENGTH]
    return OK


@compiled
def jacobians(p: Floats, position: Floats, velocity: Floats, out: Floats) -> int:
    """W and Wdot, one above the other in `out`, shape (12, 2); rows theta 1 2 3, phi 1 2 3 (5.12)."""
    status = reach_status(p, position[0], position[1])
    if status != OK:
        return status
    for i in range(3):
        leg = leg_at(p, i, position[0], position[1])
        rows = rows_of(p, leg)
        rates = row_rates_of(p, leg, rows, velocity[0], velocity[1])
        out[i, 0], out[i, 1], out[i + 3, 0], out[i + 3, 1] = rows
        out[i + 6, 0], out[i + 6, 1], out[i + 9, 0], out[i + 9, 1] = rates
    return OK


@compiled
def task_dynamics(p: Floats, position: Floats, velocity: Floats, out: Floats) -> int:
    """Mt = W'MW, Ct = W'M Wdot + W'CW, Ft = W'FW, two rows each, and S, three rows, in `out`, shape (9, 2)."""
    status = reach_status(p, position[0], position[1])
    if status != OK:
        return status
    out[:6] = 0.0
    vx = velocity[0]
    vy = velocity[1]
    for i in range(3):
        leg = leg_at(p, i, position[0], position[1])
        rows = rows_of(p, leg)
        rates = row_rates_of(p, leg, rows, vx, vy)
        bend = p[BETA + i] * leg[5]
        m11 = p[ALPHA + i] + 2.0 * bend
        m12 = p[GAMMA + i] + bend
        m22 = p[GAMMA + i]
        swing = p[BETA + i] * leg[4]
        theta_rate = rows[0] * vx + rows[1] * vy
        phi_rate = rows[2] * vx + rows[3] * vy
        c11 = -swing * phi_rate
        c12 = -swing * (theta_rate + phi_rate)
        c21 = swing * theta_rate
        for j in range(2):
            t = rows[j]
            f = rows[2 + j]
            out[6 + i, j] = t
            for k in range(2):
                tk = rows[k]
                fk = rows[2 + k]
                out[j, k] += m11 * t * tk + m12 * (t * fk + f * tk) + m22 * f * fk
                out[4 + j, k] += p[K1] * t * tk + p[K2] * f * fk
                along = m11 * rates[k] + m12 * rates[2 + k] + c11 * tk + c12 * fk
                across = m12 * rates[k] + m22 * rates[2 + k] + c21 * tk
                out[2 + j, k] += t * along + f * across
    return OK


@compiled
def leg_inertia(p: Floats, i: int, leg: Leg, rows: Rows) -> tuple[float, float, float]:
    """The leg's part of Mt: xx, xy, yy [kg]."""
    bend = p[BETA + i] * leg[5]
    m11 = p[ALPHA + i] + 2.0 * bend
    m12 = p[GAMMA + i] + bend
    m22 = p[GAMMA + i]
    tx, ty, px, py = rows
    xx = m11 * tx * tx + 2.0 * m12 * tx * px + m22 * px * px
    xy = m11 * tx * ty + m12 * (tx * py + ty * px) + m22 * px * py
    yy = m11 * ty * ty + 2.0 * m12 * ty * py + m22 * py * py
    return xx, xy, yy


@compiled
def leg_bias(p: Floats, i: int, leg: Leg, rows: Rows, rates: Rows, vx: float, vy: float) -> tuple[float, float]:
    """The leg's part of (Ct + Ft) v [N]."""
    tx, ty, px, py = rows
    theta_rate = tx * vx + ty * vy
    phi_rate = px * vx + py * vy
    theta_lag = rates[0] * vx + rates[1] * vy
    phi_lag = rates[2] * vx + rates[3] * vy
    bend = p[BETA + i] * leg[5]
    swing = p[BETA + i] * leg[4]
    active = (p[ALPHA + i] + 2.0 * bend) * theta_lag + (p[GAMMA + i] + bend) * phi_lag
    active += p[K1] * theta_rate - swing * phi_rate * (2.0 * theta_rate + phi_rate)
    passive = (p[GAMMA + i] + bend) * theta_lag + p[GAMMA + i] * phi_lag
    passive += p[K2] * phi_rate + swing * theta_rate * theta_rate
    return tx * active + px * passive, ty * active + py * passive


@compiled
def leg_force(p: Floats, i: int, leg: Leg, rows: Rows, velocity: Plane, a: Plane, c: Plane, f: Plane) -> Plane:
    """The leg's part of Mt a + Ct c + Ft f [N], Ct being that at a velocity."""
    tx, ty, px, py = rows
    rates = row_rates_of(p, leg, rows, velocity[0], velocity[1])
    theta_rate = tx * velocity[0] + ty * velocity[1]
    phi_rate = px * velocity[0] + py * velocity[1]
    bend = p[BETA + i] * leg[5]
    swing = p[BETA + i] * leg[4]
    theta = tx * c[0] + ty * c[1]
    theta_lag = tx * a[0] + ty * a[1] + rates[0] * c[0] + rates[1] * c[1]
    phi_lag = px * a[0] + py * a[1] + rates[2] * c[0] + rates[3] * c[1]
    active = (p[ALPHA + i] + 2.0 * bend) * theta_lag + (p[GAMMA + i] + bend) * phi_lag
    active -= swing * (phi_rate * theta + (theta_rate + phi_rate) * (px * c[0] + py * c[1]))
    active += p[K1] * (tx * f[0] + ty * f[1])
    passive = (p[GAMMA + i] + bend) * theta_lag + p[GAMMA + i] * phi_lag + swing * theta_rate * theta
    passive += p[K2] * (px * f[0] + py * f[1])
    return tx * active + px * passive, ty * active + py * passive
