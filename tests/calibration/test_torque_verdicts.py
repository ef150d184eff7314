"""What speaks against a torque calibration is found, and named."""

import numpy as np
import pytest

from torquerig.calibration.torque_fit import LevelReading
from torquerig.calibration.torque_scale import Cause, analyse

NOMINAL = 20100.0
GAINS = {1: 20670.0, -1: 19528.0}  # thesis, Figure 5.5
SPREAD = 5e-4
SAMPLES = 50


def readings(change=lambda torque, _level: torque, *, levels=10, friction=0.02, seed=1):
    rng = np.random.default_rng(seed)
    found = []
    for way in (1, -1):
        ladder = way * np.linspace(3500, 8000, levels).round().astype(int)
        for rising in (True, False):
            for level in (ladder if rising else ladder[::-1]).tolist():
                torque = level / GAINS[way] + way * (-friction if rising else friction)
                torque = change(torque, level) + SPREAD / SAMPLES**0.5 * rng.standard_normal()
                found.append(LevelReading(level, rising, float(torque), SPREAD, SAMPLES, float(level)))
    return found


def judge(given):
    return analyse(1, given, nominal=NOMINAL)


def words(doubts):
    return " | ".join(doubt.reason for doubt in doubts)


def test_sound_readings_raise_no_doubt():
    scale = judge(readings())
    assert (scale.suspicions, scale.failures, scale.notes, scale.saturated) == ((), (), (), ())
    assert scale.average.value == pytest.approx(20099, abs=20)


def test_a_frozen_transducer_is_dead():
    scale = judge([each._replace(torque=0.123, spread=0.0) for each in readings()])
    assert words(scale.failures) == (
        "axis 1: the transducer is dead: it shows 0.123 N·m at every level, without any noise"
    )
    assert (scale.positive, scale.negative, scale.average) == (None, None, None)


def test_a_transducer_on_another_shaft_does_not_feel_the_levels():
    scale = judge(readings(lambda _torque, _level: 0.01))
    assert "does not feel the levels" in words(scale.failures)
    assert "shaft of axis 1" in scale.failures[0].advice


def test_a_reversed_transducer_has_the_wrong_sign():
    scale = judge(readings(lambda torque, _level: -torque))
    assert words(scale.failures).startswith("axis 1: wrong sign")
    assert "bench.sign = -1" in scale.failures[0].advice


def test_one_direction_reversed_is_no_motor():
    scale = judge(readings(lambda torque, _level: abs(torque)))
    assert "they cannot be this motor's torque" in words(scale.failures)


def test_levels_that_the_transducer_calls_overloaded_are_named_and_left_out():
    given = [each._replace(overloaded=abs(each.level) > 7600) for each in readings()]
    scale = judge(given)
    assert {(each.reading.level, each.cause) for each in scale.saturated} == {
        (8000, Cause.OVERLOADED),
        (-8000, Cause.OVERLOADED),
    }
    assert "saturated at levels -8000, 8000: the transducer says that it is overloaded" in words(scale.suspicions)
    assert scale.positive.counts_per_nm.value == pytest.approx(20670, rel=2e-3)


def test_levels_that_a_silent_amplifier_clips_are_named_and_left_out():
    scale = judge(readings(lambda torque, _level: max(-0.31, min(0.31, torque))))
    assert {each.cause for each in scale.saturated} == {Cause.CLIPPED}
    assert all(abs(each.reading.torque) > 0.309 for each in scale.saturated)
    assert scale.positive.counts_per_nm.value == pytest.approx(20670, rel=5e-3)


def test_levels_at_the_drives_limit_are_named():
    given = [each._replace(actual=min(each.actual, 7200.0)) for each in readings()]
    scale = judge(given)
    assert sorted({each.reading.level for each in scale.saturated}) == [7500, 8000]
    assert "the drive says that it gives less" in words(scale.suspicions)


def test_two_levels_a_direction_are_too_few():
    scale = judge(readings(levels=2))
    assert "axis 1, positive: too few levels: 2 usable ones, and 3 are needed" in words(scale.failures)
    assert "axis 1, negative: too few levels" in words(scale.failures)


def test_no_reading_at_all_is_too_few():
    assert "too few levels: 0 usable ones" in words(judge([]).failures)


def test_a_bent_characteristic_is_not_linear():
    scale = judge(readings(lambda torque, _level: torque - 0.6 * torque * abs(torque)))
    assert "not linear: a parabola deviates from the line by" in words(scale.suspicions)


def test_an_outlier_is_a_note_with_its_level_and_speaks_against_nothing():
    given = readings()
    given[4] = given[4]._replace(torque=given[4].torque + 0.01)
    scale = judge(given)
    (note,) = scale.notes
    assert note.startswith(f"axis 1: level 5500 (up) is an outlier: {given[4].torque:.4f} N·m, +0.01")
    assert note.endswith(" N·m off the line; it was left out")
    assert scale.suspicions == ()


def test_a_wrong_scale_is_far_from_the_configured_one():
    scale = judge(readings(lambda torque, _level: 2.0 * torque))
    assert "counts/(N·m) is far from the configured 20100" in words(scale.suspicions)


def test_much_friction_is_much_play():
    assert "% of full scale above the way up" in words(judge(readings(friction=0.08)).suspicions)


def test_much_noise_leaves_the_slope_open():
    rng = np.random.default_rng(2)
    scale = judge([each._replace(torque=each.torque + 0.004 * rng.standard_normal()) for each in readings()])
    assert "the slope is known to" in words(scale.suspicions)
