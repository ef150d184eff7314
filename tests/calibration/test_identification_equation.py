"""The regressor against the manipulator's own dynamics, and what differentiation does to torques."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.calibration.differentiation import acting_torque, savitzky_golay
from torquerig.calibration.regression import least_squares_in_time
from torquerig.calibration.regressor import Actuation, Movement, equation, motor_torques
from torquerig.mechanism import HOME, Manipulator, ReachError

THESIS = Manipulator.thesis()
near_home = st.tuples(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02)).map(lambda d: np.array([HOME + np.array(d)]))
vectors = st.tuples(st.floats(-1, 1), st.floats(-1, 1)).map(lambda v: np.array([v]))
shares = st.tuples(*[st.floats(0.2, 3.0)] * 4)


@given(near_home, vectors, vectors.map(lambda a: 20 * a), shares)
def test_the_regressor_times_the_truth_is_the_actuators_force_of_inverse_dynamics(x, v, a, share):
    truth = Actuation(*np.array([0.0289, 0.8315, 0.0938, 1.64]) * share)
    machine = replace(THESIS, actuator_inertia=truth.I1, active_viscous=truth.K1, passive_viscous=truth.K2)
    S = machine.jacobians(x[0])[1]
    dry = machine.distribute(x[0], S.T @ (truth.Fc * np.sign(S @ v[0])))
    tau = machine.inverse_dynamics(x[0], v[0], a[0]) + dry
    both = equation(THESIS, Movement(x, v, a), tau[None])
    np.testing.assert_allclose(both.Y[0] @ truth, both.force[0], atol=1e-9 * max(1.0, np.abs(both.force).max()))


@given(near_home, vectors)
def test_a_force_as_least_motor_torques_is_that_force(x, force):
    tau = motor_torques(THESIS, x, force)
    S = THESIS.jacobians(x[0])[1]
    np.testing.assert_allclose(THESIS.gear_ratio * S.T @ tau[0], force[0], atol=1e-9)


def test_a_position_out_of_reach_is_named():
    far = np.array([[0.092, 0.062], [0.3, 0.3]])
    with pytest.raises(ReachError, match="leg 1"):
        equation(THESIS, Movement(far, np.zeros((2, 2)), np.zeros((2, 2))))


def test_a_steady_torque_is_its_own_average_and_a_ramp_is_late_by_half_a_hold_and_the_delay():
    period, n = 0.005, 40
    x = np.tile(THESIS.inverse_kinematics(HOME).theta, (n, 1))
    weights = savitzky_golay(THESIS, x, period).weights
    delay = np.array([0.0, 0.001, 0.002])
    steady = acting_torque(np.full((n, 3), 0.2), period, delay, weights)
    np.testing.assert_allclose(steady, 0.2, rtol=1e-12)
    ramp = np.tile(np.arange(n, dtype=float)[:, None], (1, 3))
    average = acting_torque(ramp, period, delay, weights)[10:-10]
    np.testing.assert_allclose(average, ramp[10:-10] - 0.5 - delay / period, atol=1e-12)


def test_the_average_weighs_torque_as_the_second_derivative_weighs_acceleration():
    """A free mass under held, random forces: Savitzky and Golay's acceleration is exactly the averaged force."""
    period, late, n = 0.005, 0.0017, 60
    rng = np.random.default_rng(4)
    force = rng.normal(size=n)
    fine = 1000
    t = np.arange(n * fine) * period / fine
    k = np.floor((t - late) / period).astype(int)
    acceleration = np.where(k >= 0, force[np.maximum(k, 0)], 0.0)
    speed = np.concatenate([[0.0], np.cumsum(acceleration) * period / fine])[:-1]
    place = np.concatenate([[0.0], np.cumsum(speed + acceleration * period / fine / 2) * period / fine])[:-1]
    samples = place[::fine]
    weights = savitzky_golay(THESIS, np.tile(THESIS.inverse_kinematics(HOME).theta, (n, 1)), period).weights
    seen = np.convolve(samples, weights[::-1], mode="same")[10:-10] / period**2
    expected = acting_torque(np.tile(force[:, None], (1, 3)), period, np.full(3, late), weights)[10:-10, 0]
    np.testing.assert_allclose(seen, expected, atol=2e-3)


def test_intervals_of_correlated_residuals_cover_the_truth():
    rng = np.random.default_rng(1)
    truth, covered = np.array([2.0, -1.0]), []
    for _ in range(200):
        Y = rng.normal(size=(700, 1, 2)).cumsum(axis=0) / 10
        noise = np.convolve(rng.normal(size=708), np.ones(9) / 3, mode="valid")
        fit = least_squares_in_time(Y, Y @ truth + noise[:, None], np.ones(700, dtype=bool), lags=18)
        covered.append((fit.low < truth) & (truth < fit.high))
    assert 0.91 <= np.mean(covered) <= 0.985


def test_samples_that_do_not_determine_the_unknowns_are_refused():
    Y = np.ones((100, 1, 2))
    with pytest.raises(ValueError, match="100 samples that can be used do not determine 2 unknowns"):
        least_squares_in_time(Y, np.ones((100, 1)), np.ones(100, dtype=bool), lags=5)
