"""The lines of the torque calibration, on readings whose truth is known."""

import numpy as np
import pytest

from torquerig.calibration.torque_fit import Interval, LevelReading, average, fit_direction

K = 20670.0  # thesis, Figure 5.5: positive direction
FRICTION = 0.02  # [N·m] thesis, 6.2
SPREAD = 5e-4  # [N·m] of a single reading
SAMPLES = 50
SETS = 200


def readings(seed=0, *, k=K, friction=FRICTION, offset=0.004, way=1, levels=10, spread=SPREAD):
    """Levels up and down as the bench would hold them, with white noise."""
    rng = np.random.default_rng(seed)
    ladder = way * np.linspace(3500, 8000, levels).round().astype(int)
    found = []
    for rising in (True, False):
        held = -friction if rising else friction
        for level in ladder if rising else ladder[::-1]:
            torque = level / k + way * held + offset + spread / SAMPLES**0.5 * rng.standard_normal()
            found.append(LevelReading(int(level), rising, float(torque), spread, SAMPLES))
    return found


def covers(interval, truth):
    return interval.low <= truth <= interval.high


@pytest.fixture(scope="module")
def fits():
    return [fit_direction(readings(seed)) for seed in range(SETS)]


# 95 % of 200 are 190, give or take 3.1; 181 to 199 are three standard deviations
def test_the_intervals_of_the_slope_cover_the_truth_in_95_percent_of_200_sets(fits):
    assert 181 <= sum(covers(fit.counts_per_nm, K) for fit in fits) <= 199


def test_the_intervals_of_friction_cover_the_truth_in_95_percent_of_200_sets(fits):
    assert 181 <= sum(covers(fit.friction, FRICTION) for fit in fits) <= 199


def test_the_intervals_of_the_intercept_cover_the_truth_in_95_percent_of_200_sets(fits):
    truth = K * (FRICTION - 0.004)
    assert 181 <= sum(covers(fit.intercept, truth) for fit in fits) <= 199


def test_sound_sets_lose_no_level_and_are_not_called_bent(fits):
    assert sum(bool(fit.outliers) for fit in fits) == 0
    assert sum(fit.bend_is_real for fit in fits) <= 2


def test_without_noise_the_line_is_the_truth():
    fit = fit_direction(readings(spread=0.0, offset=0.0))
    assert fit.counts_per_nm.value == pytest.approx(K)
    assert fit.intercept.value == pytest.approx(K * FRICTION)  # digital = K tau + c on the way up
    assert fit.friction.value == pytest.approx(FRICTION)
    assert fit.linearity < 1e-9
    assert fit.hysteresis == pytest.approx(2 * FRICTION / (8000 / K + FRICTION))


def test_in_the_negative_direction_friction_is_positive_too_and_the_intercept_is_not():
    fit = fit_direction(readings(way=-1, k=19528.0, spread=0.0, offset=0.0))
    assert fit.counts_per_nm.value == pytest.approx(19528.0)
    assert fit.friction.value == pytest.approx(FRICTION)
    assert fit.intercept.value == pytest.approx(-19528.0 * FRICTION)


def test_the_transducers_zero_moves_the_intercept_and_neither_slope_nor_friction():
    one, other = (fit_direction(readings(spread=0.0, offset=offset)) for offset in (0.0, 0.05))
    assert other.counts_per_nm.value == pytest.approx(one.counts_per_nm.value)
    assert other.friction.value == pytest.approx(one.friction.value)
    assert other.intercept.value == pytest.approx(one.intercept.value - 0.05 * K)


def test_the_line_gives_the_torques_of_both_branches():
    given = readings(spread=0.0)
    fit = fit_direction(given)
    for reading in given:
        assert fit.torque(reading.level, rising=reading.rising) == pytest.approx(reading.torque)


@pytest.mark.parametrize("place", [0, 7, 19])
def test_an_outlier_is_found_and_left_out(place):
    given = readings(3)
    given[place] = given[place]._replace(torque=given[place].torque + 0.005)
    fit = fit_direction(given)
    assert fit.outliers == (given[place],)
    assert covers(fit.counts_per_nm, K)


def test_three_outliers_of_twenty_do_not_hide_each_other():
    given = readings(4)
    for place in (2, 9, 15):
        given[place] = given[place]._replace(torque=given[place].torque - 0.02)
    fit = fit_direction(given)
    assert {id(each) for each in fit.outliers} == {id(given[place]) for place in (2, 9, 15)}
    assert covers(fit.counts_per_nm, K)


def test_a_bent_characteristic_is_told_from_noise():
    bent = [each._replace(torque=each.torque - 0.3 * each.torque**2) for each in readings(5)]
    fit = fit_direction(bent)
    assert fit.bend_is_real
    assert fit.bend > 0.005


def test_one_branch_alone_gives_a_slope_and_no_friction():
    fit = fit_direction([each for each in readings(6) if each.rising])
    assert covers(fit.counts_per_nm, K)
    assert np.isnan(fit.friction.value)
    assert np.isnan(fit.hysteresis)


def test_rounded_readings_that_lie_on_a_line_still_leave_the_slope_open_by_their_rounding():
    rounding = 1e-3 / 12**0.5
    given = [LevelReading(level, True, round(level / 20000, 3), rounding, 1) for level in (4000, 5000, 6000, 7000)]
    fit = fit_direction(given)
    assert fit.noise == pytest.approx(0.0, abs=1e-12)
    assert fit.counts_per_nm.high - fit.counts_per_nm.low > 100.0


def test_a_reversed_transducer_gives_a_negative_slope():
    fit = fit_direction([each._replace(torque=-each.torque) for each in readings(7)])
    assert fit.counts_per_nm.high < 0.0
    assert fit.friction.value == pytest.approx(FRICTION, rel=0.02)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_two_levels_are_too_few(count):
    assert fit_direction(readings(levels=10)[:count]) is None


def test_noise_alone_gives_an_interval_without_bounds():
    rng = np.random.default_rng(0)
    given = [each._replace(torque=1e-3 * rng.standard_normal()) for each in readings()]
    fit = fit_direction(given)
    assert (fit.counts_per_nm.low, fit.counts_per_nm.high) == (float("-inf"), float("inf"))


def test_the_thesis_regression_is_biased_where_ours_is_not():
    """Digital on torque, as Figure 5.5 is labelled, attenuates by var(noise) / var(torque); much noise shows it."""
    spread = 0.2
    ours, thesis = [], []
    for seed in range(100):
        given = [each for each in readings(seed, spread=spread, friction=0.0) if each.rising]
        ours.append(1.0 / fit_direction(given).counts_per_nm.value)
        thesis.append(np.polyfit([each.torque for each in given], [each.level for each in given], 1)[0])
    assert np.mean(ours) == pytest.approx(1.0 / K, rel=0.03)
    assert np.mean(thesis) < 0.9 * K


def test_the_average_is_the_mean_and_its_interval_takes_both_as_independent():
    mean = average(Interval(20670.0, 20667.0, 20673.0), Interval(19528.0, 19524.0, 19532.0))
    assert mean == Interval(20099.0, 20096.5, 20101.5)
