"""The kernels that solve: distribution of a force, task velocity from joint rates, dynamics both ways, compiled."""

# ruff: noqa: PLR0917  -- a kernel takes plain numbers, as many as the equation has

from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import (
    GEAR,
    NEAR_ZERO,
    OK,
    SINGULAR,
    Floats,
    forward_kinematics,
    leg_at,
    leg_bias,
    leg_inertia,
    reach_status,
    row_rates_of,
    rows_of,
)


@compiled
def gram(p: Floats, x: float, y: float) -> tuple[float, float, float, float]:
    """S'S as xx, xy, yy [1/m²], and its determinant relative to the squared trace, 0 (singular) to 1/4."""
    xx = 0.0
    xy = 0.0
    yy = 0.0
    for i in range(3):
        tx, ty, _, _ = rows_of(p, leg_at(p, i, x, y))
        xx += tx * tx
        xy += tx * ty
        yy += ty * ty
    return xx, xy, yy, (xx * yy - xy * xy) / ((xx + yy) * (xx + yy))


@compiled
def distribute(p: Floats, position: Floats, force: Floats, tau_m: Floats) -> int:
    """tau_m = S (S'S)^-1 F / n."""
    status = reach_status(p, position[0], position[1])
    if status != OK:
        return status
    xx, xy, yy, relative = gram(p, position[0], position[1])
    if not relative > NEAR_ZERO * NEAR_ZERO:
        return SINGULAR
    scale = 1.0 / (p[GEAR] * (xx * yy - xy * xy))
    wx = (yy * force[0] - xy * force[1]) * scale
    wy = (xx * force[1] - xy * force[0]) * scale
    for i in range(3):
        tx, ty, _, _ = rows_of(p, leg_at(p, i, position[0], position[1]))
        tau_m[i] = tx * wx + ty * wy
    return OK


@compiled
def task_velocity(p: Floats, position: Floats, theta_rate: Floats, velocity: Floats) -> int:
    """Least squares, v = (S'S)^-1 S' thetadot."""
    status = reach_status(p, position[0], position[1])
    if status != OK:
        return status
    xx, xy, yy, relative = gram(p, position[0], position[1])
    if not relative > NEAR_ZERO * NEAR_ZERO:
        return SINGULAR
    wx = 0.0
    wy = 0.0
    for i in range(3):
        tx, ty, _, _ = rows_of(p, leg_at(p, i, position[0], position[1]))
        wx += tx * theta_rate[i]
        wy += ty * theta_rate[i]
    determinant = xx * yy - xy * xy
    velocity[0] = (yy * wx - xy * wy) / determinant
    velocity[1] = (xx * wy - xy * wx) / determinant
    return OK


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
