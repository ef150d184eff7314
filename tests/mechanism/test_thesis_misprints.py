"""Each formula that the thesis misprints, evaluated as printed: wrong by the amount stated in docs/mechanism.md."""

import numpy as np
import pytest
from numpy.typing import NDArray

from torquerig.mechanism import HOME, Manipulator

Array = NDArray[np.float64]

THESIS = Manipulator.thesis()
L = THESIS.link_length
BASES = np.array(THESIS.bases)
PLACE = (0.101, 0.055)
VELOCITY = np.array([0.21, -0.13])


def printed_forward_kinematics(theta: Array, swapped: int) -> Array:
    """5.3 and 5.4, with the denominator's second bracket (y3 - y_swapped), in mm."""
    (x1, y1), (x2, y2), (x3, y3) = BASES + L * np.column_stack([np.cos(theta), np.sin(theta)])
    n1, n2, n3 = x1**2 + y1**2, x2**2 + y2**2, x3**2 + y3**2
    bracket = y3 - (y1 if swapped == 1 else y2)
    denominator = 2.0 * (x1 * (y2 - y3) + x2 * bracket + x3 * (y1 - y2))
    x = n1 * (y2 - y3) + n2 * (y3 - y1) + n3 * (y1 - y2)
    y = n1 * (x3 - x2) + n2 * (x1 - x3) + n3 * (x2 - x1)
    printed: Array = 1e3 * np.array([x, y]) / denominator
    return printed


def open_chain(position: tuple[float, float]) -> tuple[Array, Array, Array, Array]:
    """W, Wdot, M, C of a pose moving at VELOCITY."""
    W, _ = THESIS.jacobians(position)
    phi = THESIS.inverse_kinematics(position).phi
    rates = THESIS.joint_rates(position, VELOCITY)
    return W, THESIS.jacobian_rates(position, VELOCITY), THESIS.joint_inertia(phi), THESIS.joint_coriolis(phi, rates)


def skewness_residual(C: Array, inertia_rate: Array) -> float:
    """How far Mdot - 2 C is from skew symmetric, relative to Mdot."""
    difference = inertia_rate - 2.0 * C
    return float(np.linalg.norm(difference + difference.T) / np.linalg.norm(inertia_rate))


def open_chain_inertia_rate() -> Array:
    angles = THESIS.inverse_kinematics(PLACE)
    step = 1e-6 * THESIS.joint_rates(PLACE, VELOCITY)[3:]
    ahead, behind = THESIS.joint_inertia(angles.phi + step), THESIS.joint_inertia(angles.phi - step)
    rate: Array = (ahead - behind) / 2e-6
    return rate


def test_home_angles_as_printed_lead_elsewhere() -> None:
    printed = np.radians([48.918, 251.563, 183.609])
    assert printed_forward_kinematics(printed, 1) == pytest.approx([87.41, 13.61], abs=0.005)
    assert 1e3 * THESIS.forward_kinematics(printed) == pytest.approx([87.41, 13.61], abs=0.005)
    assert printed_forward_kinematics(printed[[0, 2, 1]], 1) == pytest.approx([92.0, 62.0], abs=0.001)


def test_denominator_of_5_3_and_5_4_as_printed_sends_home_elsewhere() -> None:
    theta = THESIS.inverse_kinematics(HOME).theta
    assert printed_forward_kinematics(theta, 2) == pytest.approx([38.78, 26.14], abs=0.01)
    assert printed_forward_kinematics(theta, 1) == pytest.approx([92.0, 62.0], abs=1e-9)


def test_arctan_of_5_5_turns_legs_two_and_three_around() -> None:
    d = np.array(HOME) - BASES
    world = np.arctan(d[:, 1] / d[:, 0])
    h = np.arccos(np.hypot(d[:, 0], d[:, 1]) / (2.0 * L))
    off = np.degrees(THESIS.inverse_kinematics(HOME).theta - (world + h)) % 360.0
    assert off == pytest.approx([0.0, 180.0, 180.0], abs=1e-9)


def test_angle_of_5_5_is_not_the_relative_angle_of_5_7() -> None:
    world = np.degrees(np.arctan2(*(np.array(HOME) - BASES).T[::-1])) % 360.0
    phi = np.degrees(THESIS.inverse_kinematics(HOME).phi) % 360.0
    assert (np.abs(world - phi) > 70.0).all()


def test_c11_of_5_7_as_printed_breaks_skew_symmetry() -> None:
    _, _, _, C = open_chain(PLACE)
    phi = THESIS.inverse_kinematics(PLACE).phi
    theta_rate = THESIS.joint_rates(PLACE, VELOCITY)[:3]
    _, beta, _ = np.array(THESIS.inertia_constants())
    printed = C.copy()
    printed[range(3), range(3)] = beta * np.sin(phi) * theta_rate
    assert skewness_residual(C, open_chain_inertia_rate()) < 1e-8
    assert skewness_residual(printed, open_chain_inertia_rate()) > 0.3


def test_lower_blocks_of_5_10_as_printed_break_skew_symmetry() -> None:
    _, _, M, C = open_chain(PLACE)
    printed = C.copy()
    printed[3:, :3] = C[:3, 3:]
    assert skewness_residual(printed, open_chain_inertia_rate()) > 0.3
    printed = C.copy()
    printed[3:, 3:] = M[3:, 3:]
    assert skewness_residual(printed, open_chain_inertia_rate()) > 0.3


def test_pseudo_inverse_after_3_67_is_a_projector_not_the_identity() -> None:
    _, S = THESIS.jacobians(HOME)
    product = np.linalg.pinv(S.T) @ S.T
    assert np.linalg.matrix_rank(product) == 2
    assert product @ product == pytest.approx(product, abs=1e-12)
    assert np.abs(product - np.eye(3)).max() == pytest.approx(0.58, abs=0.005)


def test_5_16_to_5_18_as_printed_miss_the_identified_terms() -> None:
    W, Wdot, with_actuators, C = open_chain(PLACE)
    actuators = np.diag([THESIS.actuator_inertia] * 3 + [0.0] * 3)
    M = with_actuators - actuators
    viscous = np.diag([THESIS.active_viscous] * 3 + [THESIS.passive_viscous] * 3)
    a, v = np.array([3.0, -2.0]), VELOCITY
    _, S = THESIS.jacobians(PLACE)
    drive = THESIS.gear_ratio * S.T @ THESIS.inverse_dynamics(PLACE, v, a)
    identified = W.T @ actuators @ (W @ a + Wdot @ v) + W.T @ viscous @ W @ v
    rigid = (W.T @ M @ Wdot + W.T @ C @ W) @ v
    right = drive - W.T @ M @ W @ a - rigid
    printed_sign = drive - W.T @ M @ W @ a + rigid
    assert right == pytest.approx(identified, rel=1e-10)
    assert np.linalg.norm(printed_sign - identified) / np.linalg.norm(rigid) == pytest.approx(2.0, rel=1e-9)
    with pytest.raises(ValueError, match="mismatch"):  # printed with M where W belongs, the factors do not even fit
        _ = (W.T @ M @ M + W.T @ C @ M) @ v


@pytest.mark.parametrize(
    ("vmax", "paired", "samples", "exchanged"), [(0.216, 17.11e-3, 14.003, 16.66), (0.3, 20.36e-3, 11.997, 10.08)]
)
def test_displacements_of_6_1_fit_whole_samples_only_when_exchanged(
    vmax: float, paired: float, samples: float, exchanged: float
) -> None:
    other = 20.36e-3 + 17.11e-3 - paired
    assert paired / (np.sqrt(2.0) * vmax * 4e-3) == pytest.approx(samples, abs=0.005)
    assert other / (np.sqrt(2.0) * vmax * 4e-3) == pytest.approx(exchanged, abs=0.005)
