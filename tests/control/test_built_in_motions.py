"""Circles, paths with corners, splines through points: exact, at rest at both ends, inside their bounds."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.control.circle import Circle
from torquerig.control.polyline import Polyline
from torquerig.control.profile import TrapezoidalAcceleration
from torquerig.control.trajectory import Trajectory

SQUARE = ((0.092, 0.062), (0.108, 0.062), (0.108, 0.078), (0.092, 0.078), (0.092, 0.062))


def circle(**other) -> Circle:
    given = {"speed": 0.15, "acceleration": 4.0, "ramp": 0.02, "turn": 1} | other
    return Circle.laps((0.1, 0.07), 0.01, 2, **given)


def square() -> Polyline:
    return Polyline.through(SQUARE, speed=0.2, acceleration=6.0, ramp=0.015)


def eight() -> Trajectory:
    u = np.linspace(0, 1, 41)
    angle = 2 * np.pi * (10 * u**3 - 15 * u**4 + 6 * u**5)
    return Trajectory(0.8 * u, np.column_stack((0.1 + 0.012 * np.sin(angle), 0.07 + 0.008 * np.sin(2 * angle))))


MOTIONS = pytest.mark.parametrize(
    "motion", [circle(), circle(turn=-1), square(), eight()], ids=["circle", "clockwise", "square", "spline"]
)


def course(motion, step=1e-4):
    times = np.arange(0, motion.duration + step / 2, step)
    return times, *(np.array(part) for part in zip(*map(motion.at, times), strict=True))


@MOTIONS
def test_velocity_and_acceleration_are_derivatives_and_continuous(motion):
    t, x, v, a = course(motion)
    inside = slice(1, -1)
    np.testing.assert_allclose(np.gradient(x, t, axis=0)[inside], v[inside], atol=2e-5)
    np.testing.assert_allclose(np.gradient(v, t, axis=0)[inside], a[inside], atol=0.1)
    jerk = np.abs(np.diff(a, axis=0)) / np.diff(t)[:, None]
    assert jerk.max() < 1000


@MOTIONS
def test_it_starts_and_ends_at_rest_at_one_point_and_stays_there(motion):
    for t in (-1.0, 0.0, motion.duration, motion.duration + 1):
        reference = motion.at(t)
        assert reference.position == pytest.approx(motion.at(0.0).position, abs=1e-12)
        assert reference.velocity == pytest.approx(np.zeros(2), abs=1e-12)
        assert reference.acceleration == pytest.approx(np.zeros(2), abs=1e-9)


@pytest.mark.parametrize("turn", [1, -1])
def test_a_circle_keeps_its_radius_speed_and_sense(turn):
    motion = circle(turn=turn)
    _, x, v, a = course(motion)
    np.testing.assert_allclose(np.linalg.norm(x - (0.1, 0.07), axis=1), 0.01, rtol=1e-12)
    assert np.linalg.norm(v, axis=1).max() == pytest.approx(0.15)
    assert motion.at(0.0).position == pytest.approx((0.11, 0.07))
    middle = len(x) // 2
    assert np.linalg.norm(a[middle]) == pytest.approx(0.15**2 / 0.01)
    angle = np.unwrap(np.arctan2(x[:, 1] - 0.07, x[:, 0] - 0.1))
    assert angle[-1] - angle[0] == pytest.approx(turn * 4 * math.pi, abs=1e-6)


def test_a_path_passes_each_corner_at_rest_and_leaves_no_side():
    motion = square()
    lasting = motion.duration / 4
    for number, corner in enumerate(SQUARE):
        assert motion.at(number * lasting).position == pytest.approx(corner, abs=1e-9)
        assert motion.at(number * lasting).velocity == pytest.approx(np.zeros(2), abs=1e-6)
    _, x, v, a = course(motion)
    off = np.abs(x[:, :, None] - np.array([[0.092, 0.108], [0.062, 0.078]]))
    assert off.min(axis=(1, 2)).max() < 1e-12
    assert np.linalg.norm(v, axis=1).max() == pytest.approx(0.2, rel=1e-6)
    assert np.linalg.norm(a, axis=1).max() <= 6.0 * (1 + 1e-9)


def test_a_short_side_is_made_slower():
    slow = Polyline.through(((0.1, 0.07), (0.101, 0.07)), speed=0.2, acceleration=6.0, ramp=0.015)
    _, _, v, a = course(slow)
    assert 0.02 < v.max() < 0.1
    assert a.max() <= 6.0


def test_a_spline_passes_every_point_at_its_time():
    motion = eight()
    for t, point in zip(motion.times, motion.points, strict=True):
        assert motion.at(t).position == pytest.approx(point, abs=1e-12)


def test_a_spline_through_two_points_is_the_quintic_of_least_degree():
    motion = Trajectory(np.array([0.0, 0.4]), np.array([[0.1, 0.07], [0.11, 0.07]]))
    for u in (0.1, 0.5, 0.8):
        assert motion.at(0.4 * u).position[0] == pytest.approx(0.1 + 0.01 * (10 * u**3 - 15 * u**4 + 6 * u**5))


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Trajectory(np.array([0.0]), np.zeros((1, 2))), "two at least"),
        (lambda: Trajectory(np.array([0.0, 0.0]), np.zeros((2, 2))), "increasing from 0"),
        (lambda: Trajectory(np.array([1.0, 2.0]), np.zeros((2, 2))), "increasing from 0"),
        (lambda: Polyline.through(SQUARE[:1], speed=1, acceleration=1, ramp=0), "two at least"),
        (lambda: Polyline.through(SQUARE[:1] * 2, speed=1, acceleration=1, ramp=0), "corners 1 and 2 are the same"),
        (lambda: circle(speed=0.0), "must be positive"),
        (lambda: circle(ramp=-0.1), "the ramp not negative"),
    ],
)
def test_what_cannot_be_a_motion_is_refused(build, words):
    with pytest.raises(ValueError, match=words):
        build()


SIZES = st.floats(1e-4, 10)


@given(distance=SIZES, speed=SIZES, acceleration=SIZES, ramp=st.floats(0, 1))
def test_the_quickest_stroke_within_bounds_reaches_one_of_them_or_has_no_time_to(distance, speed, acceleration, ramp):
    stroke = TrapezoidalAcceleration.within(distance, speed, acceleration, ramp)
    assert stroke.speed <= speed
    assert stroke.acceleration <= acceleration
    cruise = distance / stroke.speed - stroke.speed / stroke.acceleration - ramp
    assert stroke.speed == speed or cruise == pytest.approx(0, abs=1e-6 * stroke.duration)
    assert stroke.acceleration == acceleration or stroke.speed / stroke.acceleration == pytest.approx(ramp, rel=1e-6)
