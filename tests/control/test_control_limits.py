from dataclasses import replace

import numpy as np
import pytest

from torquerig.control import (
    Desired,
    LimitExceeded,
    State,
    Surroundings,
    experiment_table,
    thesis_motion,
)
from torquerig.mechanism import HOME, ReachError


@pytest.fixture
def check(model, limits):
    """Checks a state: its position, a joint's rate, its distance to the reference along x."""

    def run(position=HOME, qd=(0.0, 0.0, 0.0), error=0.0, **other):
        x = np.array(position)
        state = State(model.inverse_kinematics(HOME).theta, np.array(qd), x, np.zeros(2))
        desired = Desired(x + np.array((error, 0.0)), np.zeros(2), np.zeros(2), np.zeros(3), np.zeros(3))
        replace(limits, **other).check_state(model, state, desired)

    return run


def test_a_machine_at_home_is_within_all_limits(check):
    check()


@pytest.mark.parametrize(
    ("situation", "limit", "axis", "value", "bound"),
    [
        ({"position": (0.06, 0.062)}, "workspace", "x", 0.06, 0.07),
        ({"position": (0.092, 0.095)}, "workspace", "y", 0.095, 0.09),
        ({"qd": (0.0, -15.5, 0.0)}, "joint speed", "joint 2", -15.5, 15.0),
        ({"error": 0.012}, "position error", "end-effector", 0.012, 0.010),
    ],
)
def test_a_violated_limit_names_limit_axis_value_and_bound(check, situation, limit, axis, value, bound):
    with pytest.raises(LimitExceeded) as caught:
        check(**situation)
    error = caught.value
    assert (error.limit, error.axis, error.bound) == (limit, axis, bound)
    assert error.value == pytest.approx(value)


def test_the_message_is_one_sentence_with_units(check):
    with pytest.raises(LimitExceeded, match=r"^joint speed limit: joint 3 at 16 rad/s, the bound is 15 rad/s$"):
        check(qd=(0.0, 0.0, 16.0))
    with pytest.raises(LimitExceeded, match=r"^conditioning limit: S at 0\.\d+, the bound is 0\.9$"):
        check(conditioning=0.9)


@pytest.mark.parametrize("situation", [{"position": (np.nan, 0.062)}, {"qd": (0.0, np.nan, 0.0)}, {"error": np.nan}])
def test_what_is_not_a_number_violates_its_limit(check, situation):
    with pytest.raises(LimitExceeded, match="nan"):
        check(**situation)


def test_torques_are_cut_to_the_limit_and_counted(limits):
    command = np.zeros(3)
    assert limits.clip(np.array((0.5, -0.98, 0.98)), command) == 0
    assert command.tolist() == [0.5, -0.98, 0.98]
    tau = np.array((1.2, -0.3, -4.0))
    assert limits.clip(tau, command) == 2
    assert command.tolist() == [0.98, -0.3, -0.98]
    assert tau.tolist() == [1.2, -0.3, -4.0]


@pytest.mark.parametrize("wild", [5.1, -5.1, np.nan, np.inf])
def test_a_wild_torque_stops_the_machine(limits, wild):
    with pytest.raises(LimitExceeded, match=r"torque limit: joint 2 at .*, the bound is 5 N·m"):
        limits.clip(np.array((0.0, wild, 0.0)), np.zeros(3))


@pytest.fixture
def table(model):
    return experiment_table(
        model,
        thesis_motion(2),
        stands_at=(0.09, 0.06),
        repeats=1,
        period_ns=4_000_000,
        around=Surroundings(speed=0.05, acceleration=0.5, before=0.02, after=0.02),
    )


def test_the_thesis_motion_is_within_the_limits(model, limits, table):
    limits.check_reference(model, table)


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({"x": (0.07, 0.1)}, "workspace limit: x"),
        ({"y": (0.0615, 0.09)}, "workspace limit: y"),
        ({"joint_speed": 3.0}, "joint speed limit: joint"),
        ({"conditioning": 0.9}, "conditioning limit"),
    ],
)
def test_a_reference_outside_the_limits_is_refused_before_anything_moves(model, limits, table, other, words):
    with pytest.raises(LimitExceeded, match=words):
        replace(limits, **other).check_reference(model, table)


def test_a_reference_out_of_reach_names_the_leg(model):
    with pytest.raises(ReachError, match="leg 1"):
        experiment_table(
            model,
            thesis_motion(1, start=(0.135, 0.06)),
            stands_at=HOME,
            repeats=1,
            period_ns=4_000_000,
            around=Surroundings(speed=0.1, acceleration=1.0, before=0.0, after=0.0),
        )
