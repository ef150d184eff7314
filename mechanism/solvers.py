"""The kernels that solve: distribution of a force, task velocity from joint rates, dynamics both ways, compiled."""

# ruff: noqa: PLR0917  -- a kernel takes plain numbers, as many as the equation has

from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import (
    GEAR,
    NEAR_ZERO,
    OK,
    SINGULAR,
    AllRows,
    Floats,
    Plane,
    forward_kinematics,
    leg_at,
    leg_bias,
    leg_inertia,
    legs_at,
    reach_status,
    row_rates_of,
    rows_at,
    rows_of,
    status_of,
)

Gram = tuple[float, float, float, float]


@compiled
def gram_of(rows: AllRows) -> Gram:
    """S'S as xx, xy, yy [1/m²], and its determinant relative to the squared trace, 0 (singular) to 1/4."""
    xx = 0.0
    xy = 0.0
    yy = 0.0
    for i in range(3):
        tx, ty, _, _ = rows[i]
        xx += tx * tx
        xy += tx * ty
        yy += ty * ty
    return xx, xy, yy, (xx * yy - xy * xy) / ((xx + yy) * (xx + yy))


@compiled
def gram(p: Floats, x: float, y: float) -> Gram:
    """The same of a place."""
    return gram_of(rows_at(p, legs_at(p, x, y)))


@compiled
def torques_of(p: Floats, rows: AllRows, force: Plane) -> tuple[int, float, float, float]:
    """A status, and tau_m = S (S'S)^-1 F / n."""
    xx, xy, yy, relative = gram_of(rows)
    if not relative > NEAR_ZERO * NEAR_ZERO:
        return SINGULAR, 0.0, 0.0, 0.0
    scale = 1.0 / (p[GEAR] * (xx * yy - xy * xy))
    wx = (yy * force[0] - xy * force[1]) * scale
    wy = (xx * force[1] - xy * force[0]) * scale
    first, second, third = rows
    return (
        OK,
        first[0] * wx + first[1] * wy,
        second[0] * wx + second[1] * wy,
        third[0] * wx + third[1] * wy,
    )


@compiled
def distribute(p: Floats, position: Floats, force: Floats, tau_m: Floats) -> int:
    """tau_m = S (S'S)^-1 F / n."""
    legs = legs_at(p, position[0], position[1])
    status = status_of(p, legs)
    if status != OK:
        return status
    status, tau_1, tau_2, tau_3 = torques_of(p, rows_at(p, legs), (force[0], force[1]))
    if status == OK:
        tau_m[0], tau_m[1], tau_m[2] = tau_1, tau_2, tau_3
    return status


@compiled
def velocity_of(rows: AllRows, rate_1: float, rate_2: float, rate_3: float) -> tuple[int, float, float]:
    """A status, and by least squares v = (S'S)^-1 S' thetadot."""
    xx, xy, yy, relative = gram_of(rows)
    if not relative > NEAR_ZERO * NEAR_ZERO:
        return SINGULAR, 0.0, 0.0
    first, second, third = rows
    wx = first[0] * rate_1 + second[0] * rate_2 + third[0] * rate_3
    wy = first[1] * rate_1 + second[1] * rate_2 + third[1] * rate_3
    determinant = xx * yy - xy * xy
    return OK, (yy * wx - xy * wy) / determinant, (xx * wy - xy * wx) / determinant


@compiled
def task_velocity(p: Floats, position: Floats, theta_rate: Floats, velocity: Floats) -> int:
    """The same of a place."""
    legs = legs_at(p, position[0], position[1])
    status = status_of(p, legs)
    if status != OK:
        return status
    status, vx, vy = velocity_of(rows_at(p, legs), theta_rate[0], theta_rate[1], theta_rate[2])
    if status == OK:
        velocity[0], velocity[1] = vx, vy
    return status


@compiled
def end_effector(
    p: Floats, theta: Floats, theta_rate: Floats, position: Floats, velocity: Floats, residuals: Floats
) -> int:
    """Position and velocity from the active joints: `forward_kinematics`, then `task_velocity` there."""
    status = forward_kinematics(p, theta, position, residuals)
    return task_velocity(p, position, theta_rate, velocity) if status == OK else status


@compiled
def forward_dynamics(p: Floats, position: Floats, velocity: Floats, tau_m: Floats, acceleration: Floats) -> int:
    """The acceleration a = Mt^-1 (n S' tau_m - Ct v - Ft v)."""
    status = reach_status(p, position[0], position[1])
    if status != OK:
        return status
    vx = velocity[0]
    vy = velocity[1]
    mxx = mxy = myy = fx = fy = 0.0
    for i in range(3):
        leg = leg_at(p, i, position[0], position[1])
        rows = rows_of(p, leg)
        xx, xy, yy = leg_inertia(p, i, leg, rows)
        bx, by = leg_bias(p, i, leg, rows, row_rates_of(p, leg, rows, vx, vy), vx, vy)
        mxx += xx
        mxy += xy
        myy += yy
        fx += p[GEAR] * tau_m[i] * rows[0] - bx
        fy += p[GEAR] * tau_m[i] * rows[1] - by
    determinant = mxx * myy - mxy * mxy
    acceleration[0] = (myy * fx - mxy * fy) / determinant
    acceleration[1] = (mxx * fy - mxy * fx) / determinant
    return OK


@compiled
def inverse_dynamics(
    p: Floats, position: Floats, velocity: Floats, acceleration: Floats, force: Floats, tau_m: Floats
) -> int:
    """F = Mt a + Ct v + Ft v, distributed at minimum norm."""
    status = reach_status(p, position[0], position[1])
    if status != OK:
        return status
    vx = velocity[0]
    vy = velocity[1]
    ax = acceleration[0]
    ay = acceleration[1]
    force[:] = 0.0
    for i in range(3):
        leg = leg_at(p, i, position[0], position[1])
        rows = rows_of(p, leg)
        xx, xy, yy = leg_inertia(p, i, leg, rows)
        bx, by = leg_bias(p, i, leg, rows, row_rates_of(p, leg, rows, vx, vy), vx, vy)
        force[0] += xx * ax + xy * ay + bx
        force[1] += xy * ax + yy * ay + by
    return distribute(p, position, force, tau_m)
