"""The thesis' printed numbers, and those derived from its tables, come out of Manipulator.thesis()."""

import numpy as np
import pytest

from torquerig.mechanism import HOME, Manipulator
from torquerig.mechanism.kernels import ALPHA, BETA, GAMMA

THESIS = Manipulator.thesis()


def test_home_angles_are_the_thesis_ones_with_legs_two_and_three_exchanged() -> None:
    theta, phi = THESIS.inverse_kinematics(HOME)
    assert np.degrees(theta) == pytest.approx([48.918, 183.609, 251.563], abs=5e-4)
    assert np.degrees(theta) == pytest.approx([48.9177, 183.6095, 251.5625], abs=5e-5)
    assert np.degrees(phi) == pytest.approx([-97.8353, -75.1720, -75.1720], abs=5e-5)


def test_home_angles_map_to_home() -> None:
    theta = THESIS.inverse_kinematics(HOME).theta
    assert THESIS.forward_kinematics(theta) == pytest.approx([0.092, 0.062], abs=1e-15)
    assert THESIS.closure_residuals(theta) == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)


def test_inertia_constants_follow_from_table_5_1_at_full_precision() -> None:
    alpha, beta, gamma = THESIS.inertia_constants()
    assert alpha == pytest.approx([5.81339256e-3, 4.86971144e-3, 2.600875e-3], rel=1e-14)
    assert beta == pytest.approx([1.792224e-3, 1.347584e-3, 3.0625e-4], rel=1e-14)
    assert gamma == pytest.approx([1.60864256e-3, 1.29216144e-3, 2.53225e-4], rel=1e-14)


def test_inertia_constants_round_to_tables_5_2_and_5_3() -> None:
    alpha, beta, gamma = np.array(THESIS.inertia_constants())
    assert np.round(alpha, 4).tolist() == [0.0058, 0.0049, 0.0026]
    assert np.round(beta, 4).tolist() == [0.0018, 0.0013, 0.0003]
    assert np.round(gamma, 4).tolist() == [0.0016, 0.0013, 0.0003]
    assert np.round(alpha + THESIS.actuator_inertia, 4).tolist() == [0.0347, 0.0338, 0.0315]


def test_actuator_constants_are_the_identified_ones() -> None:
    constants = (THESIS.actuator_inertia, THESIS.active_viscous, THESIS.passive_viscous, THESIS.gear_ratio)
    assert constants == (0.0289, 0.8315, 0.0938, 25.0)


def test_viscous_friction_at_home() -> None:
    assert THESIS.task_viscous(HOME) == pytest.approx(np.array([[378.2, -151.5], [-151.5, 294.5]]), abs=0.05)


def test_inertia_at_home_with_the_four_decimals_of_table_5_3() -> None:
    phi = THESIS.inverse_kinematics(HOME).phi
    alpha, beta, gamma = [0.0347, 0.0338, 0.0315], [0.0018, 0.0013, 0.0003], [0.0016, 0.0013, 0.0003]
    across = np.diag(gamma + beta * np.cos(phi))
    M = np.block([[np.diag(alpha + 2.0 * np.multiply(beta, np.cos(phi))), across], [across, np.diag(gamma)]])
    W, _ = THESIS.jacobians(HOME)
    inertia = W.T @ M @ W
    assert inertia == pytest.approx(np.array([[10.889, -5.713], [-5.713, 10.527]]), abs=5e-4)


def test_inertia_at_home_at_full_precision_differs_in_the_third_decimal() -> None:
    expected = np.array([[10.89575913, -5.71269258], [-5.71269258, 10.51568844]])
    assert THESIS.task_inertia(HOME) == pytest.approx(expected, rel=1e-8)


def test_packed_constants_carry_the_actuator_in_alpha() -> None:
    alpha, beta, gamma = THESIS.inertia_constants()
    packed = THESIS.packed
    assert packed[ALPHA : ALPHA + 3] == pytest.approx(np.array(alpha) + 0.0289, rel=1e-15)
    assert packed[BETA : BETA + 3].tolist() == list(beta)
    assert packed[GAMMA : GAMMA + 3].tolist() == list(gamma)


def test_redundant_force_transmission_is_conditioned_as_in_chapter_2() -> None:
    grid = [(x, y) for x in np.linspace(0.08, 0.13, 51) for y in np.linspace(0.04, 0.09, 51)]
    ratios = np.array([THESIS.conditioning(point) for point in grid])
    assert ratios.min() == pytest.approx(0.185, abs=0.005)
    assert ratios.max() == pytest.approx(0.875, abs=0.005)
    assert ratios.mean() == pytest.approx(0.58, abs=0.01)


def test_redundant_stiffness_spans_the_norms_of_chapter_2() -> None:
    grid = [(x, y) for x in np.linspace(0.08, 0.13, 51) for y in np.linspace(0.04, 0.09, 51)]
    norms = [np.linalg.norm(S.T @ S, 2) for S in (THESIS.jacobians(point)[1] for point in grid)]
    assert min(norms) == pytest.approx(428, abs=2)
    assert max(norms) == pytest.approx(1885, abs=5)
    assert np.median(norms) == pytest.approx(510, abs=5)
