"""Kinematics: round trips, both elbow branches, Jacobians against finite differences."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from torquerig.mechanism import HOME, Manipulator, MechanismError, ReachError, SingularPoseError

THESIS = Manipulator.thesis()
L = THESIS.link_length
MODES: list[tuple[int, int, int]] = [(a, b, c) for a, b, c in product((1, -1), repeat=3)]

positions = st.tuples(st.floats(0.08, 0.13), st.floats(0.04, 0.09))
velocities = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
modes = st.sampled_from(MODES)


def ends(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Where each leg's two links lead, shape (3, 2)."""
    elbows = np.array(THESIS.bases) + L * np.column_stack([np.cos(theta), np.sin(theta)])
    return elbows + L * np.column_stack([np.cos(theta + phi), np.sin(theta + phi)])


@given(positions, modes)
def test_both_branches_of_every_leg_lead_to_the_position(position: tuple[float, float], mode: tuple[int, ...]) -> None:
    theta, phi = THESIS.inverse_kinematics(position, branches=mode)
    assert ends(theta, phi) == pytest.approx(np.tile(position, (3, 1)), abs=1e-15)
    assert (np.sign(phi) == -np.array(mode)).all()


@given(positions, modes)
def test_forward_kinematics_returns_from_every_branch(position: tuple[float, float], mode: tuple[int, ...]) -> None:
    theta = THESIS.inverse_kinematics(position, branches=mode).theta
    try:
        found = THESIS.forward_kinematics(theta)
    except SingularPoseError:  # some mixed modes put the elbows in a line somewhere
        return
    elbows = np.array(THESIS.bases) + L * np.column_stack([np.cos(theta), np.sin(theta)])
    edges = elbows[1:] - elbows[0]
    spread = abs(edges[0, 0] * edges[1, 1] - edges[0, 1] * edges[1, 0]) / L**2
    assert found == pytest.approx(position, abs=1e-15 / spread)


def test_working_mode_is_the_default_branch() -> None:
    for mode in MODES:
        other = replace(THESIS, branches=mode)
        assert other.inverse_kinematics(HOME).theta.tolist() == THESIS.inverse_kinematics(HOME, mode).theta.tolist()


@given(positions, velocities)
def test_jacobian_is_the_derivative_of_inverse_kinematics(
    position: tuple[float, float], velocity: tuple[float, float]
) -> None:
    step = 1e-6 * np.array(velocity)
    ahead = np.concatenate(THESIS.inverse_kinematics(np.add(position, step)))
    behind = np.concatenate(THESIS.inverse_kinematics(np.subtract(position, step)))
    assert THESIS.joint_rates(position, velocity) == pytest.approx((ahead - behind) / 2e-6, rel=1e-6, abs=1e-7)


@given(positions, velocities)
def test_jacobian_rate_is_the_derivative_of_the_jacobian(
    position: tuple[float, float], velocity: tuple[float, float]
) -> None:
    step = 1e-6 * np.array(velocity)
    ahead, _ = THESIS.jacobians(np.add(position, step))
    behind, _ = THESIS.jacobians(np.subtract(position, step))
    assert THESIS.jacobian_rates(position, velocity) == pytest.approx((ahead - behind) / 2e-6, rel=1e-6, abs=1e-5)


@given(positions, modes, velocities)
def test_jacobians_hold_in_every_working_mode(
    position: tuple[float, float], mode: tuple[int, int, int], velocity: tuple[float, float]
) -> None:
    other = replace(THESIS, branches=mode)
    theta, phi = other.inverse_kinematics(position)
    rates = other.joint_rates(position, velocity)
    turned = theta + phi
    along_x = -L * (np.sin(theta) * rates[:3] + np.sin(turned) * (rates[:3] + rates[3:]))
    along_y = L * (np.cos(theta) * rates[:3] + np.cos(turned) * (rates[:3] + rates[3:]))
    assert along_x == pytest.approx(np.full(3, velocity[0]), abs=1e-14)
    assert along_y == pytest.approx(np.full(3, velocity[1]), abs=1e-14)


@given(positions, velocities)
def test_task_velocity_undoes_joint_rates(position: tuple[float, float], velocity: tuple[float, float]) -> None:
    theta_rate = THESIS.joint_rates(position, velocity)[:3]
    assert THESIS.task_velocity(position, theta_rate) == pytest.approx(velocity, rel=1e-12, abs=1e-14)


@given(positions, st.tuples(*[st.floats(-5.0, 5.0)] * 3))
def test_task_velocity_is_the_least_squares_one(
    position: tuple[float, float], theta_rate: tuple[float, float, float]
) -> None:
    _, S = THESIS.jacobians(position)
    expected = np.linalg.lstsq(S, np.array(theta_rate), rcond=None)[0]
    assert THESIS.task_velocity(position, theta_rate) == pytest.approx(expected, rel=1e-9, abs=1e-12)


@given(positions)
def test_conditioning_is_the_ratio_of_singular_values(position: tuple[float, float]) -> None:
    values = np.linalg.svd(THESIS.jacobians(position)[1], compute_uv=False)
    assert THESIS.conditioning(position) == pytest.approx(values[1] / values[0], rel=1e-12)


@given(positions, st.tuples(*[st.floats(-1e-3, 1e-3)] * 3))
def test_closure_residuals_show_measured_angles_that_do_not_close(
    position: tuple[float, float], error: tuple[float, float, float]
) -> None:
    theta = THESIS.inverse_kinematics(position).theta + error
    found = THESIS.forward_kinematics(theta)
    elbows = np.array(THESIS.bases) + L * np.column_stack([np.cos(theta), np.sin(theta)])
    distances = np.hypot(*(found - elbows).T)
    assert THESIS.closure_residuals(theta) == pytest.approx(distances - L, abs=1e-14)
    assert distances == pytest.approx(np.full(3, distances[0]), abs=1e-13)


def test_theta_is_continuous_all_around_the_reachable_workspace() -> None:
    around = np.linspace(0.0, 2.0 * np.pi, 2000)
    path = np.column_stack([0.115 + 0.02 * np.cos(around), 0.062 + 0.02 * np.sin(around)])
    angles = np.array([THESIS.inverse_kinematics(point).theta for point in path])
    assert np.abs(np.diff(angles, axis=0)).max() < 0.02


@settings(max_examples=50)
@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_unreachable_positions_name_leg_distance_and_reach(x: float, y: float) -> None:
    distances = np.hypot(x - np.array(THESIS.bases)[:, 0], y - np.array(THESIS.bases)[:, 1])
    if (distances <= 2.0 * L).all():
        THESIS.inverse_kinematics((x, y))
        return
    leg = int(np.argmax(distances > 2.0 * L))
    with pytest.raises(ReachError, match=rf"leg {leg + 1}, at distance .* with reach 0\.14 m") as complaint:
        THESIS.inverse_kinematics((x, y))
    assert f"{distances[leg]:.6g}" in str(complaint.value)


def test_a_stretched_leg_is_a_singular_pose() -> None:
    stretched = (THESIS.bases[0][0] + 2.0 * L, THESIS.bases[0][1])
    assert THESIS.inverse_kinematics(stretched).phi[0] == 0.0
    assert THESIS.conditioning(stretched) == 0.0
    with pytest.raises(SingularPoseError, match=r"leg 1, at distance 0\.14 m .* stretched or folded"):
        THESIS.jacobians(stretched)


def test_elbows_in_a_line_are_a_singular_pose() -> None:
    inline = replace(THESIS, bases=((0.0, 0.0), (0.1, 0.0), (0.2, 0.0)))
    with pytest.raises(SingularPoseError, match="elbows"):
        inline.forward_kinematics((0.5, 0.5, 0.5))


def test_errors_are_value_errors_of_the_mechanism() -> None:
    for error in (ReachError, SingularPoseError):
        assert issubclass(error, MechanismError)
        assert issubclass(error, ValueError)
