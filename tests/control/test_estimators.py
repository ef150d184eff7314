import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.control import BackwardDifference, MovingWindow, UnknownEstimatorError, make_estimator

PERIOD = 4_000_000
COUNT = 2 * math.pi / 200_000  # one encoder count at the joint [rad]


def fed(estimator, angles, times=None):
    """The estimate after each of the angles."""
    times = range(0, len(angles) * PERIOD, PERIOD) if times is None else times
    return np.array([estimator.update(q, at).copy() for q, at in zip(angles, times, strict=True)])


@given(rate=st.floats(-100, 100), length=st.integers(1, 12))
def test_a_ramp_gives_its_slope_from_the_second_sample_on(rate, length):
    ramp = 0.3 + rate * 0.004 * np.arange(30)[:, None] * np.ones(3)
    assert fed(MovingWindow(3, length), ramp)[1:] == pytest.approx(rate, rel=1e-9, abs=1e-9)


def test_the_first_estimate_is_rest():
    assert fed(BackwardDifference(3), [np.ones(3)]).tolist() == [[0.0, 0.0, 0.0]]


@pytest.mark.parametrize(("length", "delay"), [(1, 0.5), (2, 1.0), (9, 4.5)])
def test_an_accelerating_joint_is_seen_half_a_window_late(length, delay):
    acceleration, times = 50.0, 0.004 * np.arange(40)
    estimates = fed(MovingWindow(1, length), (acceleration * times**2 / 2)[:, None])[length:, 0]
    assert acceleration * times[length:] - estimates == pytest.approx(acceleration * delay * 0.004)
    assert MovingWindow(1, length).delay == delay


@pytest.mark.parametrize(("length", "gain"), [(1, math.sqrt(2)), (9, math.sqrt(2) / 9)])
def test_white_noise_on_the_angles_comes_out_with_the_gain_that_is_told(length, gain):
    noise = np.random.default_rng(7).normal(scale=1e-5, size=(20_000, 1))
    estimates = fed(MovingWindow(1, length), noise)[length:]
    assert MovingWindow(1, length).noise_gain == pytest.approx(gain)
    assert np.std(estimates) * 0.004 / 1e-5 == pytest.approx(gain, rel=0.03)


def test_a_quantised_ramp_errs_by_less_than_a_count_in_a_window():
    angles = np.floor(1.2345 * 0.004 * np.arange(500)[:, None] / COUNT) * COUNT
    for length in (1, 9):
        estimates = fed(MovingWindow(1, length), angles)[length:]
        assert np.max(np.abs(estimates - 1.2345)) < COUNT / (length * 0.004)


def test_the_window_of_nine_is_the_mean_of_nine_backward_differences():
    angles = np.random.default_rng(3).normal(size=(40, 3))
    differences = np.diff(angles, axis=0) / 0.004
    expected = [differences[k - 9 : k].mean(axis=0) for k in range(9, 40)]
    assert fed(MovingWindow(3), angles)[9:] == pytest.approx(np.array(expected))


def test_a_skipped_cycle_does_not_bend_the_estimate():
    times = np.array([0, 1, 2, 5, 6, 7]) * PERIOD
    ramp = (2.0 * times * 1e-9)[:, None]
    assert fed(MovingWindow(1, 3), ramp, times.tolist())[1:] == pytest.approx(2.0)


def test_after_a_reset_nothing_is_remembered():
    estimator = MovingWindow(3, 4)
    fed(estimator, np.random.default_rng(1).normal(size=(9, 3)))
    estimator.reset()
    assert fed(estimator, [np.full(3, 5.0)]).tolist() == [[0.0, 0.0, 0.0]]
    assert estimator.update(np.full(3, 5.004), PERIOD) == pytest.approx(1.0)


def test_an_update_allocates_no_new_estimate():
    estimator = BackwardDifference(3)
    assert estimator.update(np.zeros(3), 0) is estimator.update(np.ones(3), PERIOD)


def test_the_angles_are_copied_not_kept():
    estimator, angles = BackwardDifference(1), np.zeros(1)
    estimator.update(angles, 0)
    angles[:] = 0.004
    assert estimator.update(angles, PERIOD) == pytest.approx(1.0)


def test_two_samples_at_one_instant_are_a_mistake():
    estimator = BackwardDifference(3)
    estimator.update(np.zeros(3), 5)
    with pytest.raises(ValueError, match="5 ns is not later than the one before, at 5 ns"):
        estimator.update(np.zeros(3), 5)


@pytest.mark.parametrize(
    ("name", "kind"), [("backward-difference", BackwardDifference), ("moving-window", MovingWindow)]
)
def test_estimators_are_made_by_the_names_they_tell(name, kind):
    estimator = make_estimator(name, 3, 5)
    assert type(estimator) is kind
    assert estimator.name == name


def test_an_unknown_estimator_is_answered_with_the_known_ones():
    with pytest.raises(UnknownEstimatorError, match="'kalman': choose backward-difference or moving-window"):
        make_estimator("kalman", 3)
    with pytest.raises(ValueError, match="window of 0"):
        make_estimator("moving-window", 3, 0)
