"""Four ways from the open chains' torques to those of a closed, redundant machine, compiled (thesis, chapter 3).

All start from the same tree of three open legs (`open_chain`) and end at the torques of least norm. They share nothing
between: W are the rows theta 1 2 3, phi 1 2 3 of qdot = W v, S the first three, P the last; tau_t are the torques
that the tree would need at all six joints; tau_a those of the three motors, at the joint [N·m].
"""

# ruff: noqa: PLR0917  -- a kernel takes plain numbers, as many as the equation has

from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import (
    ALPHA,
    BETA,
    GAMMA,
    K1,
    K2,
    NEAR_ZERO,
    OK,
    SINGULAR,
    Floats,
    leg_at,
    reach_status,
    row_rates_of,
    rows_of,
)


@compiled
def open_chain(
    p: Floats, position: Floats, velocity: Floats, acceleration: Floats, W: Floats, links: Floats, tau_t: Floats
) -> int:
    """tau_t = M qddot + C qdot + N of the cut tree, N viscous friction, for the closed machine's motion (3.61, 3.64).

    Also W, shape (6, 2), and each leg's d and b, shape (3, 4) [m].
    """
    status = reach_status(p, position[0], position[1])
    if status != OK:
        return status
    vx, vy = velocity[0], velocity[1]
    ax, ay = acceleration[0], acceleration[1]
    for i in range(3):
        leg = leg_at(p, i, position[0], position[1])
        rows = rows_of(p, leg)
        rates = row_rates_of(p, leg, rows, vx, vy)
        links[i, 0], links[i, 1], links[i, 2], links[i, 3], sine, cosine = leg
        W[i, 0], W[i, 1], W[i + 3, 0], W[i + 3, 1] = rows
        theta_rate = rows[0] * vx + rows[1] * vy
        phi_rate = rows[2] * vx + rows[3] * vy
        theta_acceleration = rows[0] * ax + rows[1] * ay + rates[0] * vx + rates[1] * vy
        phi_acceleration = rows[2] * ax + rows[3] * ay + rates[2] * vx + rates[3] * vy
        bend = p[BETA + i] * cosine
        swing = p[BETA + i] * sine
        across = p[GAMMA + i] + bend
        active = (p[ALPHA + i] + 2.0 * bend) * theta_acceleration + across * phi_acceleration
        tau_t[i] = active - swing * phi_rate * (2.0 * theta_rate + phi_rate) + p[K1] * theta_rate
        passive = across * theta_acceleration + p[GAMMA + i] * phi_acceleration
        tau_t[i + 3] = passive + swing * theta_rate * theta_rate + p[K2] * phi_rate
    return OK


@compiled
def lagrange_dalembert(W: Floats, tau_t: Floats, tau_a: Floats) -> int:
    """W'tau_t = S'tau_a (3.50), solved by tau_a = S (S'S)^-1 W'tau_t."""
    fx = fy = xx = xy = yy = 0.0
    for i in range(6):
        fx += W[i, 0] * tau_t[i]
        fy += W[i, 1] * tau_t[i]
    for i in range(3):
        xx += W[i, 0] * W[i, 0]
        xy += W[i, 0] * W[i, 1]
        yy += W[i, 1] * W[i, 1]
    determinant = xx * yy - xy * xy
    if not determinant > NEAR_ZERO * NEAR_ZERO * (xx + yy) * (xx + yy):
        return SINGULAR
    ux = (yy * fx - xy * fy) / determinant
    uy = (xx * fy - xy * fx) / determinant
    for i in range(3):
        tau_a[i] = W[i, 0] * ux + W[i, 1] * uy
    return OK


@compiled
def minor(W: Floats, i: int, j: int) -> float:
    """The determinant of rows i and j of S: 0 where legs i and j alone are singular [1/m²]."""
    determinant: float = W[i, 0] * W[j, 1] - W[i, 1] * W[j, 0]
    return determinant


@compiled
def by_two(W: Floats, i: int, j: int, row: int) -> tuple[float, float]:
    """Row `row` of W times the inverse of rows i and j of S: that joint's rate by those of legs i and j."""
    determinant = minor(W, i, j)
    by_i = (W[row, 0] * W[j, 1] - W[row, 1] * W[j, 0]) / determinant
    return by_i, (W[row, 1] * W[i, 0] - W[row, 0] * W[i, 1]) / determinant


@compiled
def without(W: Floats, leg: int) -> float:
    """How far from singular the other two legs alone are: the size of their minor [1/m²]."""
    return abs(minor(W, (leg + 1) % 3, (leg + 2) % 3))


@compiled
def least(W: Floats) -> float:
    """Size of a minor from which on it counts as 0 [1/m²]."""
    square = 0.0
    for i in range(3):
        square += W[i, 0] * W[i, 0] + W[i, 1] * W[i, 1]
    return NEAR_ZERO * square


@compiled
def nakamura(W: Floats, tau_t: Floats, tau_a: Floats) -> int:
    """tau_a = (I; J_2)'tau_t + alpha (0; J_1 - J_2)'tau_t (3.15, 3.18), alpha for the least norm.

    J_1 and J_2 give the passive rates by those of two legs (3.17): of the three pairs of legs the two that are
    farthest from singular. Where (J_1 - J_2)'tau_p is 0, or rounding, no alpha changes anything: the torques are
    right, and not the least.
    """
    shared = 0  # the leg whose two pairs are taken: without it the others are nearest to singular
    for leg in range(1, 3):
        if without(W, leg) < without(W, shared):
            shared = leg
    i, j = (shared + 1) % 3, (shared + 2) % 3
    if not min(without(W, i), without(W, j)) > least(W):
        return SINGULAR
    for leg in range(3):
        tau_a[leg] = tau_t[leg]
    along_shared = along_i = 0.0  # (J_1 - J_2)'tau_p
    from_shared = from_j = 0.0  # J_2'tau_p
    for row in range(3, 6):
        one_shared, one_i = by_two(W, shared, i, row)  # of J_1, what is not 0
        two_shared, two_j = by_two(W, shared, j, row)  # of J_2
        from_shared += two_shared * tau_t[row]
        from_j += two_j * tau_t[row]
        along_shared += (one_shared - two_shared) * tau_t[row]
        along_i += one_i * tau_t[row]
    along_j = -from_j
    tau_a[shared] += from_shared
    tau_a[j] += from_j
    square = along_shared * along_shared + along_i * along_i + along_j * along_j
    if square > NEAR_ZERO * NEAR_ZERO * (from_shared * from_shared + from_j * from_j):
        alpha = -(along_shared * tau_a[shared] + along_i * tau_a[i] + along_j * tau_a[j]) / square
        tau_a[shared] += alpha * along_shared
        tau_a[i] += alpha * along_i
        tau_a[j] += alpha * along_j
    return OK


@compiled
def ropponen(W: Floats, tau_t: Floats, tau_a: Floats) -> int:
    """S_r'tau_a = S_r'W_0'tau_t (3.24), with one representation W_0 = (I; J_1) (3.19), S_r = dq_a/dq_in (3.22).

    q_in are the two actuated angles whose legs alone are farthest from singular.
    """
    left_out = 0
    for leg in range(1, 3):
        if without(W, leg) > without(W, left_out):
            left_out = leg
    if not without(W, left_out) > least(W):
        return SINGULAR
    i, j = (left_out + 1) % 3, (left_out + 2) % 3
    si, sj = by_two(W, i, j, left_out)  # S_r: this row, and the identity's for legs i and j
    gi = tau_t[i] + si * tau_t[left_out]
    gj = tau_t[j] + sj * tau_t[left_out]
    for row in range(3, 6):  # J_1 has no column for the leg left out, so S_r'J_1' is J_1's other two
        by_i, by_j = by_two(W, i, j, row)
        gi += by_i * tau_t[row]
        gj += by_j * tau_t[row]
    xx = 1.0 + si * si
    xy = si * sj
    yy = 1.0 + sj * sj
    determinant = xx * yy - xy * xy
    tau_a[i] = (yy * gi - xy * gj) / determinant
    tau_a[j] = (xx * gj - xy * gi) / determinant
    tau_a[left_out] = si * tau_a[i] + sj * tau_a[j]
    return OK
