"""All that a cycle computes after the joint rates, in one compiled call: kinematics, limits, a law of `Terms`, cutting.

Handing arrays over costs more than the mathematics: one call with ten arrays instead of three with two dozen.
"""

# ruff: noqa: PLR0917  -- a kernel takes plain numbers and arrays, as many as the equation has

from math import nan
from typing import Final

from torquerig.control.limit_check import TORQUE, TORQUE_STOP, within
from torquerig.control.row import POSITION, QD, STATE, TAU, TAU_LAW, VELOCITY, Q
from torquerig.control.terms import torque_of_terms
from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import OK, Floats, legs_at, meeting, rows_at, status_of
from torquerig.mechanism.solvers import velocity_of

# what a cycle can end with beside the mechanism's statuses, which are 1 to 7, and minus the number of axes cut
OUTSIDE: Final = 8
"""The state is outside the limits."""
WILD: Final = 9
"""A torque is beyond what stops the machine, or not a number."""


@compiled
def locate(p: Floats, row: Floats) -> int:
    """Where the end-effector is and how fast, from the joints, into the row; a status of the mechanism's."""
    status, elbow, _, _, beside = meeting(p, row[Q], row[Q + 1], row[Q + 2])
    x, y, vx, vy = elbow[0] + beside[0], elbow[1] + beside[1], nan, nan
    if status == OK:
        legs = legs_at(p, x, y)
        status = status_of(p, legs)
        if status == OK:
            status, vx, vy = velocity_of(rows_at(p, legs), row[QD], row[QD + 1], row[QD + 2])
    row[POSITION], row[POSITION + 1], row[VELOCITY], row[VELOCITY + 1] = x, y, vx, vy
    return status


@compiled
def cut(row: Floats, most: float, stop: float) -> int:
    """From the law's torques to those that are commanded: WILD, or minus the number of axes that were cut."""
    for i in range(3):
        if not abs(row[TAU_LAW + i]) <= stop:
            return WILD
    code = 0
    for i in range(3):
        tau = row[TAU_LAW + i]
        if abs(tau) > most:
            code -= 1
            tau = most if tau > 0.0 else -most
        row[TAU + i] = tau
    return code


@compiled
def cycle(
    p: Floats,
    terms: Floats,
    coulomb: Floats,
    bounds: Floats,
    q: Floats,
    rate: Floats,
    row: Floats,
    expected: Floats,
    reference: Floats,
    ahead: Floats,
    k: int,
) -> int:
    """From joint angles and rates to what is to be commanded; a code as above.

    Args:
        p: The manipulator's packed constants.
        terms: Coefficients of `Terms`.
        coulomb: Torque on each joint in the direction of its desired rate, shape (3,) [N·m at the motor].
        bounds: Of the limits, in the layout of `limit_check`.
        q: Joint angles, shape (3,) [rad].
        rate: Joint rates, shape (3,) [rad/s].
        row: Filled up to the commanded torques, NaN where it did not come to that; in the layout of `Row`.
        expected: Filled with the state that the law is given, shape (10,); its position is where a status arose.
        reference: Rows of the reference table, in its layout.
        ahead: Rows that the law is asked for; the reference's own where there is no lead.
        k: The row.
    """
    for i in range(3):
        row[Q + i] = q[i]
        row[QD + i] = rate[i]
        row[TAU_LAW + i] = nan
        row[TAU + i] = nan
    status = locate(p, row)
    if status != OK:
        expected[POSITION], expected[POSITION + 1] = row[POSITION], row[POSITION + 1]
        return status
    for i in range(STATE):
        expected[i] = row[i] + (ahead[k, i] - reference[k, i])
    x, y, x_d, y_d = row[POSITION], row[POSITION + 1], reference[k, POSITION], reference[k, POSITION + 1]
    if not within(p, bounds, x, y, x_d, y_d, rate[0], rate[1], rate[2]):
        return OUTSIDE
    status, tau_1, tau_2, tau_3 = torque_of_terms(p, terms, coulomb, expected, ahead, k)
    if status != OK:
        return status
    row[TAU_LAW], row[TAU_LAW + 1], row[TAU_LAW + 2] = tau_1, tau_2, tau_3
    return cut(row, bounds[TORQUE], bounds[TORQUE_STOP])
