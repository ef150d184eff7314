"""Varied rigs over the wire and through the estimators alone: what is named, recovered, and covered by intervals.

Latency, stiction, zeros and identify over the wire stand in the tests of these procedures; `long_run.py` has 20 rigs of
each over the wire, and docs/calibration.md quotes its table.
"""

import math

import numpy as np
import pytest
from varied_rigs import TRIALS

from torquerig.calibration.home import Around, HomeProcedure
from torquerig.calibration.latency_fit import fit_response, mean_of, median_interval
from torquerig.mechanism import HOME, Manipulator

MODEL = Manipulator.thesis()
FITS_IN_COUNTS = 201  # a step of 10 mN·m at 20100 counts per N·m


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_direction_names_what_is_wrong_on_varied_rigs(seed):
    (named,) = TRIALS["direction"](seed).run()
    assert named.value == 1.0, named.name


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_home_measures_the_residual_of_a_fixture_that_is_off(seed):
    trial = TRIALS["home"](seed)
    trial.options["reach"] = 1.0
    (found,) = trial.run()
    assert found.value == pytest.approx(found.truth, rel=0.1, abs=2.0)


def test_home_tells_the_closure_of_20_fixtures_that_are_off():
    procedure = HomeProcedure(MODEL, (HOME[0], HOME[1]), 4e-3, 0.2)
    told = MODEL.inverse_kinematics(HOME).theta
    for seed in range(20):
        stands = np.array(HOME) + np.random.default_rng(seed).uniform(-1.5e-3, 1.5e-3, 2)
        off = told - MODEL.inverse_kinematics(stands).theta
        corners = stands + 4e-3 * np.array([(0, 0), (1, 1), (1, -1), (-1, -1), (-1, 1), (0, 0)])
        q = np.array([MODEL.inverse_kinematics(place).theta + off for place in corners])
        wanted = 1e6 * max(np.abs(MODEL.closure_residuals(angles)).max() for angles in q)
        facts = procedure.evaluate(Around(q, was_homed=False)).facts
        assert facts["residual_um"] == pytest.approx(wanted)
        assert facts["residual_at_home_um"] == pytest.approx(0.0, abs=1e-6)


def test_latency_covers_40_step_responses_that_are_rounded_to_counts():
    covered, errors = [], []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        delay, lag = rng.uniform(1e-4, 4e-4), rng.uniform(6e-5, 2e-4)
        x = (rng.permutation(200) + rng.uniform(size=200)) / 200 * 1.2e-3
        y = np.where(x < delay, 0.0, -np.expm1(-(x - delay) / lag))
        found = fit_response(x, (np.floor(2 * FITS_IN_COUNTS * y + rng.uniform(size=200))) / (2 * FITS_IN_COUNTS))
        covered += [found.delay.low <= delay <= found.delay.high, found.lag.low <= lag <= found.lag.high]
        errors.append(found.delay.value - delay)
    assert 0.9 <= np.mean(covered) <= 1.0
    assert np.abs(errors).max() < 3e-6
    assert math.isclose(mean_of([found.delay]).high, found.delay.high)


def test_the_interval_of_a_median_covers_it_in_about_95_percent_whatever_the_law():
    covered = []
    for seed in range(300):
        times = 1e-4 + 1e-6 * np.random.default_rng(seed).exponential(size=40)
        found = median_interval(times)
        covered.append(found.low <= 1e-4 + 1e-6 * math.log(2) <= found.high)
    assert 0.93 <= np.mean(covered) <= 0.99
