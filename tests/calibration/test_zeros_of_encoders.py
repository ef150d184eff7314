"""Encoder zeros from the closure of the redundant mechanism: pure, on sampled and rounded motions."""

import math
from dataclasses import replace

import numpy as np
import pytest

from torquerig.calibrating.catalogue import offer
from torquerig.calibrating.offer import Request
from torquerig.calibrating.zeros import figure
from torquerig.calibration.closure import Geometry, close
from torquerig.calibration.encoder_zeros import Recorded
from torquerig.calibration.procedure import Grade
from torquerig.calibration.zeros import MotionTooSmall, find_zeros
from torquerig.calibration.zeros_scale import wrong_scales
from torquerig.configuration import load_configuration
from torquerig.mechanism import HOME, Manipulator, SingularPoseError

THESIS = Manipulator.thesis()
COUNT = math.tau / 200_000
PERIOD = 0.004


def path(extent, seed=0, seconds=20.0, period=PERIOD):
    """A hand's motion within so much of home [m]."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / period)) * period
    waves = np.sin(math.tau * rng.uniform(0.3, 0.8, 2) * t[:, None] + rng.uniform(0, math.tau, 2))
    return np.array(HOME) + extent * waves


def angles(positions):
    return np.array([THESIS.inverse_kinematics(x).theta for x in positions])


def rounded(theta, seed=0):
    """As encoders whose edges stand anywhere tell angles: in the mean half a count too low."""
    edges = np.random.default_rng(seed).uniform(size=3)
    return (np.floor(theta / COUNT + edges) - edges) * COUNT


def test_the_true_geometry_closes_at_true_angles():
    positions = path(0.01, seconds=1.0)
    closed = close(Geometry.of(THESIS), angles(positions), np.array(HOME))
    np.testing.assert_allclose(closed.residuals, 0.0, atol=1e-13)
    np.testing.assert_allclose(closed.position, positions, atol=1e-14)


def test_the_residuals_derivatives_are_right_for_zeros_bases_and_lengths():
    geometry = Geometry.of(THESIS)
    theta = angles(path(0.01, seconds=1.0)[::10]) + 0.002
    closed, h = close(geometry, theta, np.array(HOME)), 1e-7
    for leg in range(3):
        bumps = {"bases": np.zeros((3, 2)), "proximal": np.zeros(3), "distal": np.zeros(3)}
        bumps["bases"][leg, 1] = bumps["proximal"][leg] = bumps["distal"][leg] = h
        for column, (name, bump) in zip((1, 2, 3), bumps.items(), strict=True):
            moved = replace(geometry, **{name: getattr(geometry, name) + bump})
            slope = (close(moved, theta, np.array(HOME)).residuals - closed.residuals) / h
            np.testing.assert_allclose(slope, -closed.normals[:, leg] * closed.slopes[:, leg, column], atol=1e-3)


def test_twenty_motions_of_10_mm_give_zeros_to_2_millidegrees_from_1_degree_off_and_intervals_cover():
    covered, worst = [], 0.0
    for seed in range(20):
        off = np.radians(np.random.default_rng(seed).uniform(-1, 1, 3))
        found = find_zeros(THESIS, rounded(angles(path(0.01, seed)), seed) - off, PERIOD, start=HOME)
        truth = off + COUNT / 2
        worst = max(worst, float(np.max(np.abs(found.values - truth))))
        covered += ((found.low <= truth) & (truth <= found.high)).tolist()
        assert found.observability.condition_number < 40
    assert math.degrees(worst) < 0.002
    assert np.mean(covered) >= 0.88


def test_the_driven_figure_comes_nowhere_twice_so_that_intervals_cover():
    covered = []
    for seed in range(16):
        rng = np.random.default_rng(seed)
        driven = figure((0.092 + rng.uniform(-1.5e-3, 1.5e-3), 0.062), 0.0095, 20.0)
        positions = np.array([driven.at(k * 0.01).position for k in range(2000)])
        found = find_zeros(THESIS, rounded(angles(positions), seed), 0.01, start=HOME)
        covered += ((found.low <= COUNT / 2) & (found.high >= COUNT / 2)).tolist()
    assert np.mean(covered) >= 0.9


def test_a_motion_that_is_too_small_is_refused_with_how_large_it_must_be():
    with pytest.raises(MotionTooSmall, match=r"60 is the most: make it .* times as large, \+-6\.\d mm and \+-6\.\d mm"):
        find_zeros(THESIS, rounded(angles(path(0.003))), PERIOD, start=HOME)


@pytest.mark.parametrize("q", [np.empty((0, 3)), np.full((50, 3), np.nan), np.tile(angles([HOME]), (500, 1))])
def test_a_motion_that_is_none_is_refused(q):
    with pytest.raises(MotionTooSmall, match="200 are needed"):
        find_zeros(THESIS, q, PERIOD, start=HOME)


def test_angles_that_no_mechanism_has_are_said_to_be_far_off():
    with pytest.raises(SingularPoseError, match="cannot close"):
        find_zeros(THESIS, rounded(angles(path(0.01))) + np.array([2.5, -1.0, 0.0]), PERIOD, start=HOME)


@pytest.mark.parametrize("scale", [0.5, 0.99, 1.06, 1.25])
@pytest.mark.parametrize("axis", range(3))
def test_one_axis_scale_is_told_from_zeros_that_are_off_as_well(axis, scale):
    true, off = angles(path(0.01, 1, seconds=10.0)), np.radians([0.3, -0.5, 0.2])
    homed = THESIS.inverse_kinematics(HOME).theta
    shown = true.copy()
    shown[:, axis] = homed[axis] + scale * (true[:, axis] - homed[axis])
    best, *others = wrong_scales(THESIS, rounded(shown) - off, start=HOME, homed=homed - off)
    assert best.axis == axis + 1
    assert best.scale == pytest.approx(scale, rel=2e-3)
    assert best.rms < COUNT
    assert all(other.rms > 2 * COUNT for other in others)


@pytest.mark.parametrize(
    ("scales", "words", "advice"),
    [
        ((1.0, 1.06, 1.0), "axis 2: wrong gear or encoder counts, it shows 1.06 times", "axes.2.gear = 26.5 would"),
        ((1.0, 1.0, 0.5), "axis 3: wrong gear or encoder counts, it shows 0.5 times", "axes.3.encoder_counts = 4000"),
        (
            (1.1, 1.05, 1.0),
            "1 is the most that rounding explains, and no one axis' scale",
            "direction first",
        ),
    ],
)
def test_a_wrong_gear_fails_and_says_what_to_do(scales, words, advice):
    made = offer("zeros")
    request = Request(None, {each.name.replace("-", "_"): each.default for each in made.options} | {"by_hand": True})
    procedure = made.make(load_configuration(), request)
    homed = THESIS.inverse_kinematics(HOME).theta
    shown = homed + np.array(scales) * (angles(path(0.01, 1, seconds=10.0)) - homed)
    result = procedure.evaluate(Recorded(PERIOD, rounded(shown)))
    assert result.verdict.grade is Grade.FAILED
    assert words in result.verdict.reasons[0]
    assert advice in result.verdict.advice[0]


def test_geometry_is_sought_near_the_drawing_and_its_freedoms_stay_as_uncertain_as_the_drawing():
    geometry = Geometry.of(THESIS)
    truth = np.array([30e-6, -20e-6, 40e-6])
    longer = replace(geometry, proximal=geometry.proximal + truth)
    # where the longer links' angles put the end-effector: the shorter ones' closure tells how much they miss
    exact = _inverse(longer, path(0.012))
    with_drawing = find_zeros(THESIS, rounded(exact), PERIOD, start=HOME)
    sought = find_zeros(THESIS, rounded(exact), PERIOD, start=HOME, tolerance=5e-5)
    assert sought.rms < 0.8 * with_drawing.rms
    assert sought.rms < COUNT
    assert len(sought.lengths) == 12
    assert all(low < value < high for value, low, high in sought.lengths.values())
    found = [sought.lengths[f"proximal {leg}"] for leg in (1, 2, 3)]
    assert all(low <= value <= high for value, (_, low, high) in zip(truth, found, strict=True))


def _inverse(geometry, positions):
    d = positions[:, None, :] - geometry.bases
    r = np.hypot(d[..., 0], d[..., 1])
    bend = np.arccos((geometry.proximal**2 + r**2 - geometry.distal**2) / (2 * geometry.proximal * r))
    return np.arctan2(d[..., 1], d[..., 0]) + geometry.branches * bend
