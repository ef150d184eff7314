"""Four independent ways to the inverse dynamics of the redundant machine: they must agree."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from torquerig.mechanism import HOME, Manipulator, ReachError, SingularPoseError
from torquerig.mechanism.inverse_dynamics import METHODS, constraint_forces, nakamura

THESIS = Manipulator.thesis()
N = THESIS.gear_ratio
AGREE = 1e-9

positions = st.tuples(st.floats(0.08, 0.13), st.floats(0.04, 0.09))
velocities = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
accelerations = st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))
motions = st.tuples(positions, velocities, accelerations)
Motion = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


def tree(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """W, and the torques of the open chains, from the matrices of the open chains."""
    x, v, a = (np.array(part) for part in motion)
    W, _ = THESIS.jacobians(x)
    qd, qdd = W @ v, W @ a + THESIS.jacobian_rates(x, v) @ v
    phi = THESIS.inverse_kinematics(x).phi
    viscous = np.array([THESIS.active_viscous] * 3 + [THESIS.passive_viscous] * 3) * qd
    return W, THESIS.joint_inertia(phi) @ qdd + THESIS.joint_coriolis(phi, qd) @ qd + viscous


def alpha_counts(motion: Motion) -> bool:
    """Whether Nakamura's alpha moves the torques by more than rounding: (J_1 - J_2)'tau_p of the two best pairs."""
    W, tau_t = tree(motion)
    pairs = sorted([(0, 1), (0, 2), (1, 2)], key=lambda pair: -abs(np.linalg.det(W[list(pair)])))
    torques = np.zeros((2, 3))
    for torque, pair in zip(torques, pairs, strict=False):
        torque[list(pair)] = np.linalg.solve(W[list(pair)].T, W[3:].T @ tau_t[3:])
    return bool(np.linalg.norm(torques[0] - torques[1]) > 1e-4 * np.linalg.norm(torques))


@settings(max_examples=60)
@given(motions)
def test_the_four_ways_agree(motion: Motion) -> None:
    assume(alpha_counts(motion))
    found = {name: method(THESIS, *motion) for name, method in METHODS.items()}
    expected = found.pop("lagrange-dalembert")
    for torques in found.values():
        assert torques == pytest.approx(expected, rel=AGREE, abs=AGREE)


@settings(max_examples=60)
@given(motions)
def test_the_loops_own_inverse_dynamics_is_the_first_of_them(motion: Motion) -> None:
    expected = THESIS.inverse_dynamics(*motion)
    assert METHODS["lagrange-dalembert"](THESIS, *motion) == pytest.approx(expected, rel=AGREE, abs=1e-12)


@settings(max_examples=60)
@given(st.sampled_from(sorted(METHODS)), motions)
def test_every_way_balances_the_open_chains_at_least_norm(name: str, motion: Motion) -> None:
    W, tau_t = tree(motion)
    torques = N * METHODS[name](THESIS, *motion)
    assert W[:3].T @ torques == pytest.approx(W.T @ tau_t, rel=AGREE, abs=AGREE)  # (3.50)
    if name != "nakamura" or alpha_counts(motion):
        least = np.linalg.lstsq(W[:3].T, W.T @ tau_t, rcond=None)[0]
        assert torques == pytest.approx(least, rel=AGREE, abs=AGREE)


def test_there_are_motions_in_which_nakamuras_alpha_finds_no_least_norm() -> None:
    """At rest (J_1 - J_2)'tau_p is linear in the acceleration, and of one direction: some acceleration makes it 0."""
    rest, pairs = (0.0, 0.0), ([0, 2], [1, 2])  # at home legs 1 and 2 are the pair that is nearest to singular
    shifts = []
    for unit in np.eye(2):
        W, tau_t = tree((HOME, rest, unit))
        torques = np.zeros((2, 3))
        for torque, pair in zip(torques, pairs, strict=True):
            torque[pair] = np.linalg.solve(W[pair].T, W[3:].T @ tau_t[3:])
        shifts.append((torques[0] - torques[1])[2])
    motion = (HOME, rest, (shifts[1], -shifts[0]))
    found, least = nakamura(THESIS, *motion), THESIS.inverse_dynamics(*motion)
    S = THESIS.jacobians(HOME)[1]
    assert S.T @ found == pytest.approx(S.T @ least, rel=1e-9)
    assert np.linalg.norm(found) > np.linalg.norm(least)
    assert np.abs(found - least).max() > 0.02 * np.abs(least).max()


@settings(max_examples=30)
@given(motions)
def test_the_multipliers_are_those_that_the_torques_bring_about(motion: Motion) -> None:
    """(3.35) gives lambda from the applied torques alone, and knows nothing of the wanted acceleration."""
    x, v, _ = (np.array(part) for part in motion)
    tau = N * METHODS["lagrange-dalembert"](THESIS, *motion)
    phi = THESIS.inverse_kinematics(x).phi
    qd = THESIS.joint_rates(x, v)
    M, C = THESIS.joint_inertia(phi), THESIS.joint_coriolis(phi, qd)
    viscous = np.array([THESIS.active_viscous] * 3 + [THESIS.passive_viscous] * 3) * qd
    A, Adot = constraint_matrices(x, qd)
    free = np.linalg.solve(M, np.concatenate((tau, np.zeros(3))) - C @ qd - viscous)
    expected = np.linalg.solve(A @ np.linalg.solve(M, A.T), A @ free + Adot @ qd)
    # (3.32) has A'lambda on the left: what the joint takes from the legs, not what it gives them
    assert -constraint_forces(THESIS, *motion) == pytest.approx(-expected, rel=1e-8, abs=1e-8)


def constraint_matrices(x: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A of A qdot = 0, leg 1 less leg 2 and leg 1 less leg 3, and its rate."""
    theta, phi = THESIS.inverse_kinematics(x)
    A, Adot = np.zeros((4, 6)), np.zeros((4, 6))
    for i, signs in enumerate(((1, 1), (-1, 0), (0, -1))):
        world, rate = theta[i] + phi[i], qd[i] + qd[i + 3]
        a = THESIS.link_length * np.array((-np.sin(theta[i]), np.cos(theta[i])))
        b = THESIS.link_length * np.array((-np.sin(world), np.cos(world)))
        adot = -THESIS.link_length * qd[i] * np.array((np.cos(theta[i]), np.sin(theta[i])))
        bdot = -THESIS.link_length * rate * np.array((np.cos(world), np.sin(world)))
        A[:, i], A[:, i + 3] = np.kron(signs, a + b), np.kron(signs, b)
        Adot[:, i], Adot[:, i + 3] = np.kron(signs, adot + bdot), np.kron(signs, bdot)
    return A, Adot


@pytest.mark.parametrize("name", sorted(METHODS))
def test_no_torque_is_needed_to_stand_still(name: str) -> None:
    assert METHODS[name](THESIS, HOME, (0.0, 0.0), (0.0, 0.0)).tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("name", sorted(METHODS))
def test_places_without_inverse_dynamics_are_named(name: str) -> None:
    rest = ((0.0, 0.0), (1.0, 0.0))
    with pytest.raises(ReachError, match="leg 1"):
        METHODS[name](THESIS, (0.3, 0.062), *rest)
    with pytest.raises(SingularPoseError, match="leg 1"):
        METHODS[name](THESIS, (0.14, 0.062), *rest)
    other = replace(THESIS, branches=(1, -1, 1))
    with pytest.raises(SingularPoseError, match="direct singularity"):
        METHODS[name](other, other.direct_singularities[0], *rest)
