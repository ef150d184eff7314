"""The friction of three joints from pushes on pairs of them."""

from itertools import product

import numpy as np
import pytest

from torquerig.calibration.stiction_fit import Push, along, fit_stiction, onset
from torquerig.mechanism import HOME, Manipulator

S = Manipulator.thesis().jacobians(HOME)[1]
NULL = np.linalg.svd(S.T)[2][-1]


def pushes(friction, noise, repeats, rng):
    """What pushes measure of friction, shape (3, 2), positive and negative sense."""
    made = []
    for held, sense, _ in product(range(3), (1, -1), range(repeats)):
        rates = along(S, held)
        each = np.where(sense * rates > 0, friction[:, 0], friction[:, 1])
        torque = float(np.abs(rates) @ each / np.abs(rates).sum()) + rng.normal(0.0, noise)
        made.append(Push(held, sense, rates, torque))
    return made


def test_unlike_joints_are_told_apart():
    friction = np.array([[0.06, 0.06], [0.05, 0.05], [0.07, 0.07]])
    fit = fit_stiction(pushes(friction, 1e-9, 2, np.random.default_rng(1)))
    np.testing.assert_allclose(fit.friction, friction, atol=1e-7)


def test_unlike_senses_are_seen_but_for_their_part_in_the_null_space():
    friction = np.array([[0.066, 0.06], [0.05, 0.055], [0.07, 0.068]])
    fit = fit_stiction(pushes(friction, 1e-9, 2, np.random.default_rng(1)))
    half = (friction[:, 0] - friction[:, 1]) / 2
    seen = half - NULL * (NULL @ half)
    np.testing.assert_allclose((fit.friction[:, 0] - fit.friction[:, 1]) / 2, seen, atol=1e-6)
    np.testing.assert_allclose(fit.friction.mean(axis=1), friction.mean(axis=1), atol=1e-7)
    assert abs(abs(fit.unseen @ NULL) - 1.0) < 1e-9


def test_intervals_cover_the_truth_in_about_95_percent_of_200_rigs():
    rng = np.random.default_rng(5)
    covered = []
    for _ in range(200):
        friction = np.tile(rng.uniform(0.04, 0.08, (3, 1)), 2)
        fit = fit_stiction(pushes(friction, 1e-3, 4, rng))
        covered.append(np.abs(fit.friction - friction) <= fit.half_width)
    assert 0.92 < np.mean(covered) < 0.98


@pytest.mark.parametrize("p", [2.0, 3.0])
def test_the_onset_is_found_below_the_encoders_resolution(p):
    errors = []
    for begin in np.linspace(0.2, 0.204, 9):
        t = np.arange(0.0, 0.29, 0.004)
        moved = np.floor(30.0 * (np.maximum(t - begin, 0.0) / 0.06) ** p)
        errors.append(onset(t, moved) - begin)
    assert np.abs(errors).max() < 0.008


def test_a_kind_of_push_that_is_missing_is_refused():
    some = [push for push in pushes(np.full((3, 2), 0.06), 1e-4, 2, np.random.default_rng(1)) if push.held != 1]
    with pytest.raises(ValueError, match="all three pairs in both senses"):
        fit_stiction(some)


def test_no_motion_has_no_onset():
    with pytest.raises(ValueError, match="nothing moved"):
        onset(np.arange(5.0), np.zeros(5))
