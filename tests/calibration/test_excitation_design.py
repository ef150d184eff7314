"""Excitations: rest to rest, inside their limits, reproducible."""

from dataclasses import replace

import numpy as np
import pytest

from torquerig.calibration.design import Search, search
from torquerig.calibration.differentiation import WINDOW
from torquerig.calibration.excitation import Envelope, worth
from torquerig.calibration.excitations import FIT, VALIDATION
from torquerig.mechanism import HOME, Manipulator

THESIS = Manipulator.thesis()
ENVELOPE = Envelope(x=(0.073, 0.127), y=(0.043, 0.097), joint_speed=15.0, torque=0.35, conditioning=0.2)


@pytest.mark.parametrize("motion", [FIT, VALIDATION])
def test_a_shipped_excitation_keeps_to_the_rigs_limits_and_tells_the_unknowns_apart(motion):
    figures = worth(THESIS, motion, window=WINDOW)
    assert figures.objections(ENVELOPE) == []
    assert figures.condition_number < 4.5
    assert figures.kept > 0.2
    assert round(motion.duration / 0.005) == 700


@pytest.mark.parametrize("motion", [FIT, VALIDATION])
def test_every_period_begins_and_ends_at_rest_without_acceleration(motion):
    ends = motion.sampled(motion.period * np.arange(motion.periods + 1))
    np.testing.assert_allclose(ends.position, np.tile(HOME, (motion.periods + 1, 1)), atol=1e-12)
    np.testing.assert_allclose(ends.velocity, 0.0, atol=1e-6)
    np.testing.assert_allclose(ends.acceleration, 0.0, atol=1e-5)


def test_velocity_and_acceleration_are_the_positions_derivatives():
    t, h = np.linspace(0.1, 3.4, 200), 1e-6
    before, now, after = (FIT.sampled(t + by) for by in (-h, 0.0, h))
    np.testing.assert_allclose((after.position - before.position) / (2 * h), now.velocity, atol=1e-7)
    np.testing.assert_allclose((after.velocity - before.velocity) / (2 * h), now.acceleration, atol=1e-5)


def test_before_and_after_it_stands_at_its_start():
    for t in (-1.0, 0.0, FIT.duration, 10.0):
        np.testing.assert_array_equal(FIT.at(t).position, HOME)
        np.testing.assert_array_equal(FIT.at(t).velocity, 0.0)


def test_the_same_seed_finds_the_same_motion_within_its_envelope():
    wanted = Search(THESIS, ENVELOPE)
    first, second = (search(wanted, seed=1, starts=2, steps=12) for _ in range(2))
    assert first.motion == second.motion
    assert worth(THESIS, first.motion, window=WINDOW).objections(ENVELOPE) == []


def test_limits_that_nothing_keeps_to_are_said_so():
    tight = replace_bound(ENVELOPE, conditioning=0.99)
    with pytest.raises(ValueError, match="no excitation within"):
        search(Search(THESIS, tight), seed=1, starts=1, steps=2)


def test_objections_name_what_is_exceeded_with_its_number():
    figures = replace(worth(THESIS, FIT, window=WINDOW), torque=0.5, x=(0.05, 0.1))
    assert figures.objections(ENVELOPE) == [
        "x from 50.0 to 100.0 mm leaves 73.0 to 127.0 mm",
        "a motor torque of 0.500 N·m is above 0.350",
    ]


def replace_bound(envelope, **changes):
    return envelope._replace(**changes)
