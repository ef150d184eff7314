"""Lagrange's equations with constraints (3.32), compiled: the torques with the forces that hold the legs together."""

import numpy as np

from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import NEAR_ZERO, OK, SINGULAR, Floats

CONSTRAINTS = 4
"""Legs 1 and 2 end in one point, and legs 1 and 3: two each."""
UNKNOWNS = 7
"""Four multipliers, and three rates that say the passive joints bear no torque."""


@compiled
def constraints(links: Floats, A: Floats) -> None:
    """A of A qdot = 0 (3.30), shape (4, 6) [m]: leg 1's end less leg 2's, and less leg 3's; into zeros."""
    for i in range(3):
        dx, dy, bx, by = links[i, 0], links[i, 1], links[i, 2], links[i, 3]
        for block in range(2):
            if i in {0, block + 1}:
                sign = 1.0 if i == 0 else -1.0
                A[2 * block, i] = -sign * dy
                A[2 * block + 1, i] = sign * dx
                A[2 * block, i + 3] = -sign * by
                A[2 * block + 1, i + 3] = sign * bx


@compiled
def lagrange_multipliers(links: Floats, tau_t: Floats, tau_a: Floats, multipliers: Floats) -> int:
    """tau_t + A'lambda = (tau_a; 0) (3.32) with the least tau_a.

    There are six equations for three torques and four multipliers. Least |tau_a|² subject to tau_p + A_p'lambda = 0:

        [A_a A_a'  A_p] [lambda]   [-A_a tau_ta]
        [A_p'      0  ] [  mu  ] = [-tau_tp    ]

    Args:
        links: Each leg's d and b, shape (3, 4) [m].
        tau_t: Torques of the cut tree, shape (6,) [N·m].
        tau_a: Filled with the motors' torques at the joint, shape (3,) [N·m].
        multipliers: Filled with lambda, shape (4,): forces on the ends of legs 2 and 3 [N].
    """
    A = np.zeros((CONSTRAINTS, 6))
    constraints(links, A)
    system = np.zeros((UNKNOWNS, UNKNOWNS + 1))
    for i in range(CONSTRAINTS):
        for leg in range(3):
            for j in range(CONSTRAINTS):
                system[i, j] += A[i, leg] * A[j, leg]
            system[i, CONSTRAINTS + leg] = A[i, leg + 3]
            system[CONSTRAINTS + leg, i] = A[i, leg + 3]
            system[i, UNKNOWNS] -= A[i, leg] * tau_t[leg]
    for leg in range(3):
        system[CONSTRAINTS + leg, UNKNOWNS] = -tau_t[leg + 3]
    status = solve(system)
    for i in range(CONSTRAINTS):
        multipliers[i] = system[i, UNKNOWNS]
    for leg in range(3):
        tau_a[leg] = tau_t[leg]
        for i in range(CONSTRAINTS):
            tau_a[leg] += A[i, leg] * multipliers[i]
    return status


@compiled
def solve(system: Floats) -> int:
    """Gauss' elimination of [matrix | right side], shape (n, n + 1), with row exchanges, into its last column."""
    n = system.shape[0]
    largest = 0.0
    for i in range(n):
        for j in range(n):
            largest = max(largest, abs(system[i, j]))
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(system[i, k]) > abs(system[pivot, k]):
                pivot = i
        if not abs(system[pivot, k]) > NEAR_ZERO * largest:
            return SINGULAR
        for j in range(k, n + 1):
            system[k, j], system[pivot, j] = system[pivot, j], system[k, j]
        for i in range(k + 1, n):
            factor = system[i, k] / system[k, k]
            for j in range(k + 1, n + 1):
                system[i, j] -= factor * system[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            system[k, n] -= system[k, j] * system[j, n]
        system[k, n] /= system[k, k]
    return OK
