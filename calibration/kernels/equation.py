"""The equation of identification at many instants (calibration.regressor), on the mechanism's kernels."""

# ruff: noqa: PLR0917  -- a kernel takes plain arrays, as many as the equation has

import numpy as np

from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import GEAR, OK, Floats, jacobians, task_dynamics
from torquerig.mechanism.solvers import distribute


@compiled
def add_leg(W: Floats, i: int, v: Floats, a: Floats, Y: Floats, rates: Floats) -> None:
    """Add leg i to the columns at one instant, Y of shape (2, 4), and note its actuated joint's rate."""
    rate = W[i, 0] * v[0] + W[i, 1] * v[1]
    elbow = W[3 + i, 0] * v[0] + W[3 + i, 1] * v[1]
    slope = W[i, 0] * a[0] + W[i, 1] * a[1] + W[6 + i, 0] * v[0] + W[6 + i, 1] * v[1]
    for j in range(2):
        Y[j, 0] += W[i, j] * slope
        Y[j, 1] += W[i, j] * rate
        Y[j, 2] += W[3 + i, j] * elbow
        Y[j, 3] += W[i, j] * np.sign(rate)
    rates[i] = rate


@compiled
def equation(
    p: Floats,
    position: Floats,
    velocity: Floats,
    acceleration: Floats,
    tau_m: Floats,
    Y: Floats,
    force: Floats,
    rates: Floats,
) -> int:
    """Fill the columns of I1, K1, K2 and Fc, and the motors' force less what moves the links, until W is missing.

    Returns OK, or the status of the first position without W.

    Args:
        p: Constants of the links alone, I1 = K1 = K2 = 0.
        position: Shape (n, 2) [m].
        velocity: Shape (n, 2) [m/s].
        acceleration: Shape (n, 2) [m/s²].
        tau_m: Shape (n, 3) [N·m at the motor].
        Y: Filled, shape (n, 2, 4).
        force: Filled with n S' tau_m - Mt_l a - Ct_l v, shape (n, 2) [N].
        rates: Filled with S v, shape (n, 3) [rad/s].
    """
    W, task = np.empty((12, 2)), np.empty((9, 2))
    for k in range(len(position)):
        v, a = velocity[k], acceleration[k]
        status = jacobians(p, position[k], v, W)
        if status != OK:
            return status
        task_dynamics(p, position[k], v, task)
        Y[k] = 0.0
        for j in range(2):
            force[k, j] = -(task[j, 0] * a[0] + task[j, 1] * a[1] + task[2 + j, 0] * v[0] + task[2 + j, 1] * v[1])
        for i in range(3):
            add_leg(W, i, v, a, Y[k], rates[k])
            for j in range(2):
                force[k, j] += p[GEAR] * W[i, j] * tau_m[k, i]
    return OK


@compiled
def least_torques(p: Floats, position: Floats, force: Floats, tau_m: Floats) -> int:
    """Each row's S (S'S)^-1 F / n; OK, or the status of the first row that has none."""
    for k in range(len(position)):
        status = distribute(p, position[k], force[k], tau_m[k])
        if status != OK:
            return status
    return OK
