"""What every estimator keeps, whoever wrote it: these tests run over all that the scan finds."""

import math

import numpy as np
import pytest

from torquerig.control.estimators import THESIS_SAMPLING, load_estimators, make_estimator

PERIOD = 4_000_000
EVEN = list(range(0, 400 * PERIOD, PERIOD))
SKIPPED = [k * PERIOD for k in range(400) if k % 7 != 3 and k not in {20, 21, 22, 23, 24}]
JITTERED = (np.arange(400) * PERIOD + np.random.default_rng(5).integers(-200_000, 200_000, 400)).tolist()
EVERY_OTHER = EVEN[:40] + EVEN[40::2]

every = pytest.mark.parametrize("name", load_estimators())
at_all_intervals = pytest.mark.parametrize("times", [EVEN, SKIPPED, JITTERED, EVERY_OTHER])


def fed(estimator, angles, times=EVEN):
    """The estimate after each of the angles."""
    return np.array([estimator.update(q, at).copy() for q, at in zip(angles, times, strict=False)])


def answer_to_an_impulse(name, count=20_000):
    """Rate times period for an angle that is 1 in one sample, long after the first and long before the last."""
    estimator = make_estimator(name, 1)
    angles = np.zeros((count, 1))
    angles[200] = 1.0
    return fed(estimator, angles, range(0, count * PERIOD, PERIOD))[200:, 0] * 0.004


@every
def test_it_tells_the_name_it_is_found_by(name):
    assert make_estimator(name, 3).name == name


@every
def test_the_first_estimate_is_rest(name):
    estimator = make_estimator(name, 3)
    assert estimator.update(np.array([1.0, -2.0, 0.5]), 7).tolist() == [0.0, 0.0, 0.0]


@every
def test_a_joint_that_rests_has_no_rate(name):
    assert not fed(make_estimator(name, 3), np.full((50, 3), 2.345)).any()


@every
@at_all_intervals
def test_a_joint_that_turns_evenly_gives_its_rate_whatever_the_intervals_are(name, times):
    angles = 0.3 + 5.0 * np.array(times)[:, None] * 1e-9
    assert fed(make_estimator(name, 1), angles, times)[60:] == pytest.approx(5.0, rel=1e-9)


@every
def test_a_skipped_cycle_does_not_throw_the_estimate_of_a_joint_that_turns_evenly(name):
    times = [at for k, at in enumerate(EVEN[:100]) if k != 80]
    estimates = fed(make_estimator(name, 1), 5.0 * np.array(times)[:, None] * 1e-9, times)
    assert estimates[80] == pytest.approx(5.0, rel=1e-9)


@every
def test_a_long_gap_is_survived(name):
    times = EVEN[:100] + [at + 1_000_000_000 for at in EVEN[100:]]
    angles = np.sin(20.0 * np.array(times) * 1e-9)[:, None]
    estimates = fed(make_estimator(name, 1), angles, times)
    late = np.array(times[200:]) * 1e-9
    assert np.max(np.abs(estimates[200:, 0] - 20.0 * np.cos(20.0 * late))) < 20.0 * 20.0 * 0.004 * 5


@every
def test_its_delay_is_the_one_it_tells(name):
    """The first moment of the impulse's answer r: of q = t²/2, whose rate is 0 now, r makes sum r_j j²/2 = -delay."""
    r = answer_to_an_impulse(name)
    ages = np.arange(len(r))
    assert np.sum(r) == pytest.approx(0.0, abs=1e-9)
    assert -np.sum(r * ages) == pytest.approx(1.0, rel=1e-9)
    assert -np.sum(r * ages**2) / 2 == pytest.approx(make_estimator(name, 1).delay, abs=1e-8)


@every
def test_an_accelerating_joint_is_seen_as_late_as_it_tells(name):
    acceleration, times = 50.0, 0.004 * np.arange(400)
    estimates = fed(make_estimator(name, 1), (acceleration * times**2 / 2)[:, None])[:, 0]
    lag = (acceleration * times - estimates)[300:] / (acceleration * 0.004)
    assert lag == pytest.approx(make_estimator(name, 1).delay, abs=1e-6)


@every
def test_white_noise_comes_out_with_the_gain_that_it_tells(name):
    estimator = make_estimator(name, 1)
    assert np.linalg.norm(answer_to_an_impulse(name)) == pytest.approx(estimator.noise_gain, rel=1e-9)
    noise = np.random.default_rng(7).normal(scale=1e-5, size=(20_000, 1))
    estimates = fed(estimator, noise, range(0, 20_000 * PERIOD, PERIOD))[100:]
    assert np.std(estimates) * 0.004 / 1e-5 == pytest.approx(estimator.noise_gain, rel=0.05)


@every
def test_a_quantised_ramp_errs_by_little(name):
    count = THESIS_SAMPLING.resolution
    angles = np.floor(1.2345 * 0.004 * np.arange(500)[:, None] / count) * count
    estimator = make_estimator(name, 1)
    errors = fed(estimator, angles, range(0, 500 * PERIOD, PERIOD))[100:] - 1.2345
    assert np.std(errors) < 2 * estimator.noise_gain * THESIS_SAMPLING.quantisation / 0.004


@every
def test_it_is_linear_and_joint_by_joint(name):
    one, two = np.random.default_rng(1).normal(size=(2, 60, 1))
    both = np.column_stack([one, two, one - 2 * two])
    estimates = fed(make_estimator(name, 3), both, JITTERED)
    assert estimates[:, 2] == pytest.approx(estimates[:, 0] - 2 * estimates[:, 1], abs=1e-7)
    assert estimates[:, [0]] == pytest.approx(fed(make_estimator(name, 1), one, JITTERED))


@every
def test_after_a_reset_nothing_is_remembered(name):
    used, fresh = make_estimator(name, 3), make_estimator(name, 3)
    angles = np.random.default_rng(1).normal(size=(2, 30, 3))
    fed(used, angles[0])
    used.reset()
    assert fed(used, angles[1]).tolist() == fed(fresh, angles[1]).tolist()


@every
def test_an_update_makes_no_new_estimate(name):
    estimator = make_estimator(name, 3)
    assert estimator.update(np.zeros(3), 0) is estimator.update(np.ones(3), PERIOD)


@every
def test_the_angles_are_copied_not_kept_nor_changed(name):
    estimator, twin = make_estimator(name, 1), make_estimator(name, 1)
    for k in range(20):
        angles = np.array([math.sin(k)])
        mine = estimator.update(angles, k * PERIOD).copy()
        assert angles.tolist() == [math.sin(k)]
        angles[:] = 99.0
        assert mine == twin.update(np.array([math.sin(k)]), k * PERIOD)


@every
@pytest.mark.parametrize("at", [5, 4, -(10**18)])
def test_two_samples_at_one_instant_or_backwards_are_a_mistake(name, at):
    estimator = make_estimator(name, 3)
    estimator.update(np.zeros(3), 5)
    with pytest.raises(ValueError, match=f"{at} ns is not later than the one before, at 5 ns"):
        estimator.update(np.zeros(3), at)


@every
def test_angles_may_come_in_any_array(name):
    rows = np.random.default_rng(2).normal(size=(6, 3))
    sealed = rows.copy()
    sealed.setflags(write=False)
    expected = fed(make_estimator(name, 3), rows)
    assert fed(make_estimator(name, 3), np.asfortranarray(sealed)).tolist() == expected.tolist()
    assert fed(make_estimator(name, 3), rows.tolist()).tolist() == expected.tolist()
