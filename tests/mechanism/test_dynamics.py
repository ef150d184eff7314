"""The closed chain's dynamics: what must hold of them anywhere, at any speed."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from torquerig.mechanism import HOME, Manipulator

THESIS = Manipulator.thesis()
N = THESIS.gear_ratio

positions = st.tuples(st.floats(0.08, 0.13), st.floats(0.04, 0.09))
velocities = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
accelerations = st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))
forces = st.tuples(st.floats(-100.0, 100.0), st.floats(-100.0, 100.0))
torques = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@given(positions)
def test_task_inertia_is_symmetric_and_positive_definite(position: tuple[float, float]) -> None:
    Mt = THESIS.task_inertia(position)
    assert Mt[0, 1] == pytest.approx(Mt[1, 0], rel=1e-15)
    assert np.linalg.eigvalsh(Mt).min() > 0.0


@given(positions, velocities)
def test_inertia_rate_minus_twice_coriolis_is_skew(
    position: tuple[float, float], velocity: tuple[float, float]
) -> None:
    step = 1e-6 * np.array(velocity)
    rate = (THESIS.task_inertia(np.add(position, step)) - THESIS.task_inertia(np.subtract(position, step))) / 2e-6
    difference = rate - 2.0 * THESIS.task_coriolis(position, velocity)
    assert difference + difference.T == pytest.approx(np.zeros((2, 2)), abs=1e-4 + 1e-7 * np.abs(rate).max())


@given(positions, velocities)
def test_task_matrices_are_the_open_chains_projected(
    position: tuple[float, float], velocity: tuple[float, float]
) -> None:
    W, S = THESIS.jacobians(position)
    Wdot = THESIS.jacobian_rates(position, velocity)
    phi = THESIS.inverse_kinematics(position).phi
    M, C = THESIS.joint_inertia(phi), THESIS.joint_coriolis(phi, W @ np.array(velocity))
    F = np.diag([THESIS.active_viscous] * 3 + [THESIS.passive_viscous] * 3)
    terms = THESIS.dynamics(position, velocity)
    scale = np.abs(W.T @ M @ W).max()
    assert terms.Mt == pytest.approx(W.T @ M @ W, rel=1e-12)
    assert terms.Ct == pytest.approx(W.T @ M @ Wdot + W.T @ C @ W, rel=1e-11, abs=1e-12 * scale)
    assert terms.Ft == pytest.approx(W.T @ F @ W, rel=1e-12)
    assert terms.S.tolist() == S.tolist()


@given(positions, velocities, accelerations)
def test_forward_dynamics_undoes_inverse_dynamics(
    position: tuple[float, float], velocity: tuple[float, float], acceleration: tuple[float, float]
) -> None:
    tau_m = THESIS.inverse_dynamics(position, velocity, acceleration)
    found = THESIS.forward_dynamics(position, velocity, tau_m)
    assert found == pytest.approx(acceleration, rel=1e-10, abs=1e-10)


@given(positions, velocities, torques)
def test_forward_dynamics_solves_the_equation_of_motion(
    position: tuple[float, float], velocity: tuple[float, float], tau_m: tuple[float, float, float]
) -> None:
    Mt, Ct, Ft, S = THESIS.dynamics(position, velocity)
    force = N * S.T @ np.array(tau_m) - (Ct + Ft) @ np.array(velocity)
    assert THESIS.forward_dynamics(position, velocity, tau_m) == pytest.approx(
        np.linalg.solve(Mt, force), rel=1e-9, abs=1e-9
    )


@given(positions, forces)
def test_distribution_gives_the_force_with_the_smallest_norm(
    position: tuple[float, float], force: tuple[float, float]
) -> None:
    _, S = THESIS.jacobians(position)
    tau_m = THESIS.distribute(position, force)
    smallest = np.linalg.lstsq(N * S.T, np.array(force), rcond=None)[0]
    assert N * S.T @ tau_m == pytest.approx(force, rel=1e-10, abs=1e-10)
    assert tau_m == pytest.approx(smallest, rel=1e-9, abs=1e-12)


@given(positions, velocities, torques, st.floats(-2.0, 2.0))
def test_null_space_of_s_transposed_moves_nothing(
    position: tuple[float, float], velocity: tuple[float, float], tau_m: tuple[float, float, float], preload: float
) -> None:
    _, S = THESIS.jacobians(position)
    null = np.cross(S[:, 0], S[:, 1])
    with_preload = np.array(tau_m) + preload * null / np.linalg.norm(null)
    plain = THESIS.forward_dynamics(position, velocity, tau_m)
    assert THESIS.forward_dynamics(position, velocity, with_preload) == pytest.approx(plain, rel=1e-9, abs=1e-9)


@given(positions, forces, st.floats(-1.0, 1.0))
def test_any_preload_makes_the_distribution_larger(
    position: tuple[float, float], force: tuple[float, float], preload: float
) -> None:
    assume(abs(preload) > 1e-6)
    _, S = THESIS.jacobians(position)
    null = np.cross(S[:, 0], S[:, 1])
    tau_m = THESIS.distribute(position, force)
    assert np.linalg.norm(tau_m + preload * null / np.linalg.norm(null)) > np.linalg.norm(tau_m)


@pytest.mark.parametrize("viscous", [(0.0, 0.0), (0.8315, 0.0938)])
def test_kinetic_energy_is_the_work_done_along_a_trajectory(viscous: tuple[float, float]) -> None:
    machine = replace(THESIS, active_viscous=viscous[0], passive_viscous=viscous[1])

    def rates(t: float, state: np.ndarray) -> np.ndarray:
        x, v = state[:2], state[2:4]
        tau_m = 0.2 * np.sin(40.0 * t + np.arange(3.0))
        terms = machine.dynamics(x, v)
        power = N * (terms.S @ v) @ tau_m - v @ terms.Ft @ v
        return np.concatenate([v, machine.forward_dynamics(x, v, tau_m), [power]])

    start = np.array([*HOME, 0.1, 0.05, 0.0])
    path = solve_ivp(rates, (0.0, 0.15), start, method="DOP853", rtol=1e-11, atol=1e-13)
    energies = [0.5 * s[2:4] @ machine.task_inertia(s[:2]) @ s[2:4] for s in path.y.T]
    assert np.ptp(energies) > 1e-3
    assert np.array(energies) - energies[0] == pytest.approx(path.y[4], abs=1e-9)
