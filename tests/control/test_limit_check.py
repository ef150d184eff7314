"""The compiled look at the limits and the sentence that tells a violation must agree."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.control import Desired, LimitExceeded, Limits, State
from torquerig.mechanism import HOME, Manipulator, ReachError

THESIS = Manipulator.thesis()
LIMITS = Limits(
    x=(0.06, 0.135),
    y=(0.03, 0.11),
    conditioning=0.3,
    joint_speed=15.0,
    position_error=0.010,
    torque=0.98,
    torque_stop=5.0,
    singularity_distance=0.008,
)
wild = st.one_of(st.floats(-20.0, 20.0), st.just(np.nan))


def situation(position, qd=(0.0, 0.0, 0.0), error=(0.0, 0.0)):
    x = np.array(position)
    state = State(np.zeros(3), np.array(qd), x, np.zeros(2))
    return state, Desired(x + np.array(error), np.zeros(2), np.zeros(2), np.zeros(3), np.zeros(3))


def told(limits, state, desired):
    """The first limit that is violated, each looked at alone."""
    (x, y), (x_d, y_d) = state.position, desired.position
    if not (limits.x[0] <= x <= limits.x[1] and limits.y[0] <= y <= limits.y[1]):
        return "workspace"
    singular_values = np.linalg.svd(THESIS.jacobians((x, y))[1], compute_uv=False)
    if not singular_values[1] / singular_values[0] >= limits.conditioning:
        return "conditioning"
    if not 0.14 - max(np.hypot(x - base[0], y - base[1]) for base in THESIS.bases) >= limits.singularity_distance:
        return "singularity distance"
    if not (np.abs(state.qd) <= limits.joint_speed).all():
        return "joint speed"
    return None if np.hypot(x_d - x, y_d - y) <= limits.position_error else "position error"


@given(
    st.tuples(st.floats(0.055, 0.137), st.floats(0.025, 0.115)),
    st.tuples(wild, wild, wild),
    st.tuples(*[st.floats(-0.012, 0.012)] * 2),
)
def test_the_first_violated_limit_is_the_one_that_is_told(position, qd, error):
    state, desired = situation(position, qd, error)
    try:
        expected = told(LIMITS, state, desired)
    except ReachError:
        with pytest.raises(ReachError):
            LIMITS.check_state(THESIS, state, desired)
        return
    if expected is None:
        LIMITS.check_state(THESIS, state, desired)
        return
    with pytest.raises(LimitExceeded) as caught:
        LIMITS.check_state(THESIS, state, desired)
    assert caught.value.limit == expected


def test_a_pose_too_near_a_stretched_leg_is_told_in_metres():
    state, desired = situation((0.1335, 0.062))
    limits = replace(LIMITS, conditioning=0.01)
    with pytest.raises(
        LimitExceeded, match=r"^singularity distance limit: end-effector at 0\.0065 m, the bound is 0\.008 m$"
    ):
        limits.check_state(THESIS, state, desired)


def test_arrays_of_any_layout_are_looked_at():
    state, desired = situation(HOME)
    locked = np.array((1.0, 2.0, 3.0))
    locked.setflags(write=False)
    LIMITS.check_state(THESIS, state._replace(qd=locked), desired)
    LIMITS.check_state(THESIS, state._replace(qd=np.zeros(6)[::2]), desired)
