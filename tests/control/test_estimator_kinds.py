"""Each estimator against an independent reckoning of the same: numpy, scipy, filterpy."""

import math

import numpy as np
import pytest
from filterpy.common import Q_continuous_white_noise
from filterpy.kalman import KalmanFilter
from hypothesis import given
from hypothesis import strategies as st
from scipy import linalg, signal

from torquerig.control.estimators import THESIS_SAMPLING, Sampling, make_estimator
from torquerig.control.estimators.kalman import steady_gain

PERIOD = 4_000_000
EVEN = [k * PERIOD for k in range(300)]
UNEVEN = np.cumsum(np.random.default_rng(3).integers(1, 4, 300) * PERIOD).tolist()


def fed(estimator, angles, times=EVEN):
    """The estimate after each of the angles."""
    return np.array([estimator.update(q, at).copy() for q, at in zip(angles, times, strict=False)])


def motion(times):
    """A joint's angle in a swift motion, as an encoder tells it, shape (n, 1) [rad]."""
    angle = 1.2 + 0.3 * np.sin(12.0 * np.array(times) * 1e-9)
    return (np.floor(angle / THESIS_SAMPLING.resolution) * THESIS_SAMPLING.resolution)[:, None]


@given(rate=st.floats(-100, 100), length=st.integers(1, 12))
def test_a_window_of_any_length_gives_a_ramps_slope_from_the_second_sample_on(rate, length):
    ramp = 0.3 + rate * 0.004 * np.arange(30)[:, None] * np.ones(3)
    estimates = fed(make_estimator("moving-window", 3, length=length), ramp)
    assert estimates[1:] == pytest.approx(rate, rel=1e-9, abs=1e-9)


def test_the_window_of_nine_is_the_mean_of_nine_backward_differences():
    angles = np.random.default_rng(3).normal(size=(40, 3))
    differences = np.diff(angles, axis=0) / 0.004
    expected = [differences[k - 9 : k].mean(axis=0) for k in range(9, 40)]
    assert fed(make_estimator("moving-window", 3), angles)[9:] == pytest.approx(np.array(expected))


@pytest.mark.parametrize("length", [1, 9])
def test_a_quantised_ramp_errs_by_less_than_a_count_in_a_window(length):
    count = THESIS_SAMPLING.resolution
    angles = np.floor(1.2345 * 0.004 * np.arange(300)[:, None] / count) * count
    estimates = fed(make_estimator("moving-window", 1, length=length), angles)[length:]
    assert np.max(np.abs(estimates - 1.2345)) < count / (length * 0.004)


def test_the_backward_difference_is_the_window_of_one_to_the_last_bit():
    angles = np.random.default_rng(3).normal(size=(60, 3))
    one = fed(make_estimator("moving-window", 3, length=1), angles, UNEVEN)
    assert fed(make_estimator("backward-difference", 3), angles, UNEVEN).tolist() == one.tolist()
    by_hand = np.diff(angles, axis=0) * (1e9 / np.diff(UNEVEN[:60]))[:, None]
    assert one[1:].tolist() == by_hand.tolist()


@pytest.mark.parametrize(("length", "order"), [(5, 2), (2, 1), (9, 4), (7, 1), (30, 5), (100, 3), (6, 5)])
def test_at_even_intervals_these_are_the_coefficients_of_savitzky_and_golay(length, order):
    angles = np.random.default_rng(length).normal(size=(300, 1))
    taps = signal.savgol_coeffs(length, order, deriv=1, delta=0.004, pos=length - 1)
    expected = np.convolve(angles[:, 0], taps, mode="valid")
    estimator = make_estimator("savitzky-golay", 1, length=length, order=order)
    assert fed(estimator, angles)[length - 1 :, 0] == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.max(np.abs(taps)))
    assert estimator.noise_gain == pytest.approx(0.004 * np.linalg.norm(taps), rel=1e-9)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_a_polynomial_of_its_order_is_differentiated_exactly_at_any_instants(order):
    polynomial = np.polynomial.Polynomial(np.random.default_rng(order).normal(size=order + 1))
    seconds = np.array(UNEVEN) * 1e-9
    estimator = make_estimator("savitzky-golay", 1, length=12, order=order)
    estimates = fed(estimator, polynomial(seconds)[:, None], UNEVEN)
    assert estimates[order:, 0] == pytest.approx(polynomial.deriv()(seconds[order:]), rel=1e-8, abs=1e-8)


def test_at_uneven_intervals_it_is_numpys_fit():
    angles, seconds = np.random.default_rng(8).normal(size=60), np.array(UNEVEN[:60]) * 1e-9
    estimates = fed(make_estimator("savitzky-golay", 1, length=9, order=3), angles[:, None], UNEVEN)
    for k in range(8, 60):
        fit = np.polynomial.Polynomial.fit(seconds[k - 8 : k + 1], angles[k - 8 : k + 1], 3)
        assert estimates[k, 0] == pytest.approx(fit.deriv()(seconds[k]), rel=1e-9, abs=1e-9)


def test_order_one_is_half_its_span_late():
    assert make_estimator("savitzky-golay", 1, length=7, order=1).delay == 3.0


def test_the_low_pass_answers_straight_pieces_as_scipy_does():
    angles = motion(UNEVEN)
    cutoff = 25.0
    estimates = fed(make_estimator("low-pass-derivative", 1, cutoff=cutoff), angles, UNEVEN)[:, 0]
    low_pass = signal.TransferFunction([1.0, 0.0], [1 / (2 * math.pi * cutoff), 1.0])
    grid = np.arange(UNEVEN[0], UNEVEN[-1] + 1, PERIOD)  # all intervals are whole periods
    pieces = np.interp(grid, UNEVEN, angles[:, 0] - angles[0, 0])
    _, answer, _ = signal.lsim(low_pass, pieces, (grid - grid[0]) * 1e-9)
    assert estimates == pytest.approx(answer[np.searchsorted(grid, UNEVEN)], rel=1e-9, abs=1e-9)


def test_a_skipped_cycle_forgets_as_much_as_the_cycles_between_would_have():
    whole, holed = make_estimator("low-pass-derivative", 1), make_estimator("low-pass-derivative", 1)
    angles = np.cumsum(np.r_[np.random.default_rng(4).normal(size=20), 0.3, 0.3, 0.3])[:, None]
    through = fed(whole, angles)[-1]
    holes = fed(holed, np.delete(angles, [20, 21], axis=0), np.delete(EVEN[:23], [20, 21]).tolist())[-1]
    assert holes == pytest.approx(through, rel=1e-12)


def test_alpha_beta_with_full_gains_is_the_backward_difference():
    angles = motion(UNEVEN)
    full = fed(make_estimator("alpha-beta", 1, alpha=1.0, beta=1.0), angles, UNEVEN)
    assert full == pytest.approx(fed(make_estimator("backward-difference", 1), angles, UNEVEN), abs=1e-9)


def test_alpha_beta_is_the_textbooks_linear_filter():
    alpha, beta, angles = 0.7, 0.2, np.random.default_rng(9).normal(size=300)
    numerator, denominator = [beta, -beta, 0.0], [1.0, alpha + beta - 2.0, 1.0 - alpha]
    expected = signal.lfilter(numerator, denominator, angles - angles[0]) / 0.004
    assert fed(make_estimator("alpha-beta", 1, alpha=alpha, beta=beta), angles[:, None])[:, 0] == pytest.approx(
        expected
    )


def filterpys(gain, angles, times):
    """The rates of filterpy's filter with a steady gain, whose parts for rate and acceleration go with the interval."""
    kalman = KalmanFilter(dim_x=3, dim_z=1)
    kalman.H = np.eye(1, 3)
    kalman.x = np.array([[angles[0]], [0.0], [0.0]])
    rates = [0.0]
    for k in range(1, len(angles)):
        dt = (times[k] - times[k - 1]) * 1e-9
        kalman.F = np.array([[1.0, dt, dt * dt / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
        kalman.K = np.array([[gain.angle], [gain.rate / dt], [gain.acceleration / dt**2]])
        kalman.predict_steadystate()
        kalman.update_steadystate(angles[k])
        rates.append(kalman.x[1, 0])
    return np.array(rates)


@pytest.mark.parametrize("times", [EVEN, UNEVEN])
@pytest.mark.parametrize("jerk_noise", [1.0, 1e3, 1.4e6])
def test_kalman_is_filterpys_filter_with_that_gain(times, jerk_noise):
    estimator, angles = make_estimator("kalman", 1, jerk_noise=jerk_noise), motion(times)
    expected = filterpys(estimator.gain, angles[:, 0], times)
    assert fed(estimator, angles, times)[:, 0] == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("period_ns", [250_000, 1_000_000, 4_000_000])
def test_kalman_is_filterpys_whole_filter_once_that_has_settled(period_ns):
    """Physical units, its own covariance and gain in every step, from the steady covariance on."""
    sampling, jerk_noise, dt = Sampling(period_ns, THESIS_SAMPLING.resolution), 1.4e6, period_ns * 1e-9
    kalman = KalmanFilter(dim_x=3, dim_z=1)
    kalman.F = np.array([[1.0, dt, dt * dt / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
    kalman.H, kalman.R = np.eye(1, 3), np.eye(1) * sampling.resolution**2 / 12
    kalman.Q = Q_continuous_white_noise(3, dt=dt, spectral_density=jerk_noise)
    for _ in range(400):
        kalman.predict()
        kalman.update(0.0)
    times = [k * period_ns for k in range(300)]
    angles = motion(times)
    kalman.x = np.array([[angles[0, 0]], [0.0], [0.0]])
    estimator = make_estimator("kalman", 1, sampling, jerk_noise=jerk_noise)
    estimates = fed(estimator, angles, times)[:, 0]
    for k in range(1, 300):
        kalman.predict()
        kalman.update(angles[k])
        assert estimates[k] == pytest.approx(kalman.x[1, 0], rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("index", [1e-9, 1e-3, 17.0, 1.7e4, 1e12, 1e25])
def test_the_steady_gain_is_the_riccati_equations(index):
    F, H = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]]), np.eye(1, 3)
    gain = np.array([steady_gain(index)]).T
    prior = Q_continuous_white_noise(3, dt=1.0, spectral_density=index)
    if index < 1e3:  # beyond, scipy's solver cannot tell the residual's noise from its own
        prior = linalg.solve_discrete_are(F.T, H.T, prior, np.eye(1))
        assert gain == pytest.approx(prior @ H.T / (prior[0, 0] + 1.0), rel=1e-6)
    assert np.max(np.abs(np.linalg.eigvals((np.eye(3) - gain @ H) @ F))) < 1.0


def test_a_finer_encoder_or_a_wilder_joint_is_believed_more():
    def gain(resolution, jerk_noise):
        return make_estimator("kalman", 1, Sampling(1_000_000, resolution), jerk_noise=jerk_noise).gain.angle

    assert gain(1e-5, 1e6) > gain(1e-4, 1e6) > gain(1e-4, 1e4)
    assert gain(1e-4, 1e6) == pytest.approx(gain(1e-5, 1e4), rel=1e-9)


@pytest.mark.parametrize("times", [EVEN, UNEVEN])
def test_kalman_follows_an_even_acceleration_without_an_error_at_any_intervals(times):
    seconds = np.array(times) * 1e-9
    estimates = fed(make_estimator("kalman", 1), (25.0 * seconds**2)[:, None], times)[:, 0]
    assert estimates[60:] == pytest.approx(50.0 * seconds[60:], rel=1e-9, abs=1e-9)
