"""One force, many torques: least norm, weighted, preloaded."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from torquerig.mechanism import HOME, Manipulator, SingularPoseError
from torquerig.mechanism.distribution import preload_against_backlash, preload_direction, preloaded, weighted
from torquerig.mechanism.redundancy import alignment

THESIS = Manipulator.thesis()
N = THESIS.gear_ratio

positions = st.tuples(st.floats(0.08, 0.13), st.floats(0.04, 0.09))
velocities = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
forces = st.tuples(st.floats(-100.0, 100.0), st.floats(-100.0, 100.0))
weights = st.tuples(*[st.floats(0.1, 10.0)] * 3)
preloads = st.floats(-2.0, 2.0)


@given(positions, forces, weights)
def test_weighted_torques_give_the_force_at_the_least_weighted_square(
    position: tuple[float, float], force: tuple[float, float], weight: tuple[float, float, float]
) -> None:
    S = THESIS.jacobians(position)[1]
    torques = weighted(THESIS, position, force, weight)
    R = np.diag(1.0 / np.array(weight))
    expected = R @ S @ np.linalg.solve(S.T @ R @ S, np.array(force)) / N
    assert N * S.T @ torques == pytest.approx(force, rel=1e-9, abs=1e-9)
    assert torques == pytest.approx(expected, rel=1e-9, abs=1e-9)


@given(positions, forces)
def test_equal_weights_are_least_norm(position: tuple[float, float], force: tuple[float, float]) -> None:
    expected = THESIS.distribute(position, force)
    assert weighted(THESIS, position, force, (3.0, 3.0, 3.0)) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_a_heavy_weight_spares_its_motor() -> None:
    plain = THESIS.distribute(HOME, (20.0, 10.0))
    spared = weighted(THESIS, HOME, (20.0, 10.0), (1.0, 1.0, 1e9))
    assert abs(plain[2]) > 0.01
    assert abs(spared[2]) < 1e-8


def test_a_weight_below_zero_is_named() -> None:
    with pytest.raises(ValueError, match=r"weight 2 is -1\.0"):
        weighted(THESIS, HOME, (1.0, 0.0), (1.0, -1.0, 1.0))


@given(positions)
def test_the_end_effector_does_not_feel_a_preload(position: tuple[float, float]) -> None:
    null = preload_direction(THESIS, position)
    S = THESIS.jacobians(position)[1]
    assert np.linalg.norm(null) == pytest.approx(1.0, rel=1e-15)
    assert S.T @ null == pytest.approx((0.0, 0.0), abs=1e-13 * np.linalg.norm(S))


@given(positions, velocities, forces, preloads)
def test_preload_accelerates_nothing(
    position: tuple[float, float], velocity: tuple[float, float], force: tuple[float, float], preload: float
) -> None:
    plain = THESIS.forward_dynamics(position, velocity, THESIS.distribute(position, force))
    strained = preloaded(THESIS, position, force, preload)
    assert THESIS.forward_dynamics(position, velocity, strained) == pytest.approx(plain, rel=1e-10, abs=1e-10)


def test_the_direction_of_preload_goes_smoothly_with_the_position() -> None:
    path = np.stack((np.linspace(0.08, 0.13, 400), np.linspace(0.09, 0.04, 400)), axis=-1)
    directions = np.array([preload_direction(THESIS, point) for point in path])
    assert np.linalg.norm(np.diff(directions, axis=0), axis=1).max() < 0.02


@given(positions, forces, st.floats(0.0, 0.1))
def test_with_the_preload_against_backlash_no_torque_changes_sign(
    position: tuple[float, float], force: tuple[float, float], margin: float
) -> None:
    null = preload_direction(THESIS, position)
    if np.abs(null).min() < 1e-3:
        return
    preload = preload_against_backlash(THESIS, position, force, margin)
    sizes = preloaded(THESIS, position, force, preload) * np.sign(null)
    assert sizes.min() == pytest.approx(margin, rel=1e-7, abs=1e-7)  # enough, and not more


def test_where_two_legs_pull_along_one_line_the_third_motor_cannot_be_preloaded() -> None:
    x = brentq(lambda x: float(alignment(THESIS, (x, 0.08), (0, 2))), 0.08, 0.13, xtol=1e-15)
    assert abs(preload_direction(THESIS, (x, 0.08))[1]) < 1e-9
    with pytest.raises(SingularPoseError, match="motor 2 cannot be preloaded"):
        preload_against_backlash(THESIS, (x, 0.08), (1.0, 1.0), 0.02)


def test_a_preload_that_follows_the_machine_does_not_change_its_motion() -> None:
    def end(preload: float) -> np.ndarray:
        def rates(t: float, state: np.ndarray) -> np.ndarray:
            tau_m = 0.2 * np.sin(40.0 * t + np.arange(3.0)) + preload * preload_direction(THESIS, state[:2])
            return np.concatenate((state[2:], THESIS.forward_dynamics(state[:2], state[2:], tau_m)))

        return solve_ivp(rates, (0.0, 0.1), [*HOME, 0.1, 0.05], method="DOP853", rtol=1e-11, atol=1e-13).y

    plain, strained = end(0.0)[:, -1], end(0.5)[:, -1]
    assert np.abs(plain[:2] - HOME).max() > 0.002
    assert strained == pytest.approx(plain, abs=1e-11)
