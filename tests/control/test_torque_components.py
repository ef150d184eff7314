"""What a motion's torques are made of (Figures 6.4 and 6.5)."""

import numpy as np
import pytest

from torquerig.control import thesis_motion
from torquerig.control.components import torque_components
from torquerig.mechanism import HOME, ReachError

PERIOD = 0.004


@pytest.fixture(params=[1, 2])
def motion(request):
    """Position, velocity and acceleration of a test motion at the thesis' samples."""
    chosen = thesis_motion(request.param)
    points = [chosen.at(k * PERIOD) for k in range(round(chosen.duration / PERIOD) + 1)]
    return tuple(np.array(column) for column in zip(*points, strict=True))


def test_inertia_coriolis_and_friction_add_up_to_the_inverse_dynamics(model, motion):
    parts = torque_components(model, *motion)
    expected = [model.inverse_dynamics(*row) for row in zip(*motion, strict=True)]
    assert parts.total == pytest.approx(np.array(expected), rel=1e-10, abs=1e-13)
    assert not parts.stiction.any()


def test_each_component_is_its_term_of_the_textbook(model, textbook, motion):
    parts = torque_components(model, *motion)
    for k, (x, v, a) in enumerate(zip(*motion, strict=True)):
        Mt, Ct, Ft, S = textbook.dynamics(x, v)
        least = S @ np.linalg.inv(S.T @ S) / textbook.gear
        assert parts.inertia[k] == pytest.approx(least @ Mt @ a, rel=1e-9, abs=1e-12)
        assert parts.coriolis[k] == pytest.approx(least @ Ct @ v, rel=1e-9, abs=1e-12)
        assert parts.friction[k] == pytest.approx(least @ Ft @ v, rel=1e-9, abs=1e-12)


def test_coriolis_and_centrifugal_torque_is_insignificant(model, motion):
    assert torque_components(model, *motion, stiction=(0.02, 0.0, 0.0)).share.coriolis < 0.05


def test_friction_dominates_at_constant_velocity(model, motion):
    cruising = ~motion[2].any(axis=1) & motion[1].any(axis=1)
    parts = torque_components(model, *(column[cruising] for column in motion))
    assert cruising.sum() > 5
    assert not parts.inertia.any()
    assert parts.share.friction > 0.9


def test_stiction_has_the_direction_of_each_joints_rate(model):
    v = np.array([[0.2, 0.2], [-0.2, -0.2], [0.0, 0.0]])
    parts = torque_components(model, np.tile(HOME, (3, 1)), v, np.zeros((3, 2)), stiction=0.02)
    rates = [model.joint_rates(HOME, row)[:3] for row in v]
    assert parts.stiction == pytest.approx(0.02 * np.sign(rates))
    only_first = torque_components(model, np.tile(HOME, (3, 1)), v, np.zeros((3, 2)), stiction=(0.02, 0.0, 0.0))
    assert only_first.stiction[:, 0] == pytest.approx(parts.stiction[:, 0])
    assert not only_first.stiction[:, 1:].any()


def test_shares_are_root_mean_squares_over_that_of_the_total(model, motion):
    parts = torque_components(model, *motion, stiction=0.02)
    total = np.sqrt(np.mean(parts.total**2))
    for name, share in parts.share._asdict().items():
        assert share == pytest.approx(np.sqrt(np.mean(getattr(parts, name) ** 2)) / total)


def test_a_skipped_cycle_is_nan_and_counts_in_no_share(model, motion):
    position, velocity, acceleration = (column.copy() for column in motion)
    position[3] = np.nan
    parts = torque_components(model, position, velocity, acceleration)
    assert np.isnan(parts.total[3]).all()
    others = torque_components(model, *(np.delete(column, 3, axis=0) for column in motion))
    assert parts.share == pytest.approx(others.share)


def test_a_motionless_machine_has_no_shares(model):
    still = torque_components(model, np.array([HOME]), np.zeros((1, 2)), np.zeros((1, 2)))
    assert np.isnan(still.share).all()


def test_arrays_that_do_not_match_are_named(model):
    with pytest.raises(ValueError, match=r"shapes \(2, 2\), \(1, 2\), \(2, 2\)"):
        torque_components(model, np.zeros((2, 2)), np.zeros((1, 2)), np.zeros((2, 2)))


def test_a_position_out_of_reach_is_named(model):
    with pytest.raises(ReachError, match="leg 1"):
        torque_components(model, np.array([[0.3, 0.0]]), np.zeros((1, 2)), np.zeros((1, 2)))
