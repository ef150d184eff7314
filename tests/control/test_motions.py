import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.control import Hold, SmoothMove, UnknownMotionError, thesis_motion
from torquerig.control.profile import TrapezoidalAcceleration

# the test motions: D [m], v [m/s], a [m/s²], tj [s], T [s], samples a stroke at 4 ms, norm of the way [mm]
SPEC = {1: (0.012096, 0.216, 7.2, 0.014, 0.100, 25, 17.106), 2: (0.0144, 0.3, 15.0, 0.012, 0.080, 20, 20.365)}
NUMBERS = pytest.mark.parametrize("number", SPEC)


PARTS = ("position", "velocity", "acceleration")


def course(motion, step=1e-4):
    """Times and the motion's position, velocity, acceleration along x at them."""
    times = np.arange(0, motion.duration + step / 2, step)
    references = [motion.at(t) for t in times]
    return times, *(np.array([getattr(r, name)[0] for r in references]) for name in PARTS)


@NUMBERS
def test_a_stroke_lasts_d_over_v_plus_v_over_a_plus_tj(number):
    distance, speed, acceleration, ramp, duration, samples, _ = SPEC[number]
    motion = thesis_motion(number)
    assert motion.stroke.duration == distance / speed + speed / acceleration + ramp
    assert motion.stroke.duration == pytest.approx(duration, rel=1e-14)
    assert motion.duration / 0.004 == pytest.approx(2 * samples)


@NUMBERS
def test_the_motion_reaches_its_greatest_speed_and_acceleration_and_no_more(number):
    _, speed, acceleration, *_ = SPEC[number]
    _, _, v, a = course(thesis_motion(number))
    assert np.max(v) == pytest.approx(speed, rel=1e-12)
    assert np.min(v) == pytest.approx(-speed, rel=1e-12)
    assert np.max(a) == pytest.approx(acceleration, rel=1e-12)
    assert np.min(a) == pytest.approx(-acceleration, rel=1e-12)


@NUMBERS
def test_the_motion_goes_from_home_along_1_1_and_comes_back(number):
    distance, *_, norm = SPEC[number]
    motion = thesis_motion(number)
    turn = motion.at(motion.duration / 2)
    assert turn.position == pytest.approx([0.092 + distance, 0.062 + distance], rel=1e-12)
    assert 1000 * math.dist(turn.position, (0.092, 0.062)) == pytest.approx(norm, abs=6e-4)
    for t in (0.0, motion.duration / 2, motion.duration, motion.duration + 1):
        assert motion.at(t).velocity == pytest.approx(np.zeros(2), abs=1e-12)
        assert motion.at(t).acceleration == pytest.approx(np.zeros(2), abs=1e-9)
    for t in (0.0, motion.duration, motion.duration + 1):
        assert motion.at(t).position == pytest.approx([0.092, 0.062], abs=1e-15)
    for t in np.linspace(0, motion.duration, 77):
        assert all(part[0] == part[1] for part in motion.at(t)[1:])


@NUMBERS
def test_velocity_and_acceleration_are_the_positions_derivatives(number):
    t, x, v, a = course(thesis_motion(number))
    between = slice(1, -1)
    assert np.gradient(x, t)[between] == pytest.approx(v[between], abs=1e-5)
    assert np.gradient(v, t)[between] == pytest.approx(a[between], abs=0.1)


@NUMBERS
def test_the_acceleration_is_a_trapezoid_with_ramps_of_tj(number):
    _, speed, acceleration, ramp, *_ = SPEC[number]
    stroke = thesis_motion(number).stroke
    rise = speed / acceleration
    for t, share in ((ramp / 2, 0.5), (ramp, 1.0), (rise, 1.0), (rise + ramp / 2, 0.5), (rise + ramp, 0.0)):
        assert stroke.at(t)[2] == pytest.approx(share * acceleration, abs=1e-9)
        assert stroke.at(stroke.duration - t)[2] == pytest.approx(-share * acceleration, abs=1e-9)
    _, _, _, a = course(thesis_motion(number), step=1e-5)
    assert np.max(np.abs(np.diff(a))) <= acceleration / ramp * 1e-5 * 1.001


@NUMBERS
def test_without_a_ramp_it_is_a_plain_trapezoid_of_velocity(number):
    distance, speed, acceleration, ramp, duration, *_ = SPEC[number]
    motion = thesis_motion(number, ramp=0.0)
    assert motion.stroke.duration == pytest.approx(duration - ramp)
    assert {round(motion.at(t).acceleration[0], 9) for t in np.linspace(0.0001, motion.duration - 0.0001, 500)} == {
        acceleration,
        0.0,
        -acceleration,
    }
    assert motion.at(motion.duration / 2).position[0] == pytest.approx(0.092 + distance)
    assert np.max(course(motion)[2]) == pytest.approx(speed)


@given(speed=st.floats(0.01, 2), rise=st.floats(0.001, 0.5), share=st.floats(0, 1), cruise=st.floats(0, 1))
def test_every_stroke_ends_at_its_distance_at_rest(speed, rise, share, cruise):
    ramp = rise * share
    stroke = TrapezoidalAcceleration(
        speed * (cruise + rise + ramp) * (1 + 1e-12), speed, speed / rise, ramp * (1 - 1e-12)
    )
    s, v, a = stroke.at(np.nextafter(stroke.duration, 0))
    assert s == pytest.approx(stroke.distance, rel=1e-9)
    assert v == pytest.approx(0.0, abs=1e-9 * speed + stroke.acceleration * 1e-12)
    assert abs(a) <= stroke.acceleration * (1 + 1e-9)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((0.012, 0.2, 7.0, 0.03), "longer than v/a"),
        ((0.009, 0.216, 7.2, 0.014), "longer than D/v - v/a"),
        ((0.0, 0.2, 7.0, 0.0), "must be positive"),
        ((0.012, 0.2, 7.0, -0.001), "the ramp not negative"),
    ],
)
def test_a_stroke_that_cannot_be_is_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        TrapezoidalAcceleration(*arguments)


def test_an_unknown_motion_is_answered_with_the_known_ones():
    with pytest.raises(UnknownMotionError, match="unknown motion 3: choose 1 or 2"):
        thesis_motion(3)


@pytest.mark.parametrize(("speed", "acceleration"), [(0.05, 100.0), (10.0, 0.5)])
def test_a_smooth_move_touches_one_of_its_bounds(speed, acceleration):
    move = SmoothMove.within((0.08, 0.05), (0.11, 0.09), speed=speed, acceleration=acceleration)
    times = np.linspace(0, move.duration, 4001)
    fastest = max(np.linalg.norm(move.at(t).velocity) for t in times) / speed
    hardest = max(np.linalg.norm(move.at(t).acceleration) for t in times) / acceleration
    assert max(fastest, hardest) == pytest.approx(1.0, rel=1e-6)


def test_a_smooth_move_goes_from_rest_to_rest_on_a_straight_line():
    move = SmoothMove.within((0.08, 0.05), (0.11, 0.09), speed=0.1, acceleration=1.0)
    for t, place in ((0.0, (0.08, 0.05)), (move.duration, (0.11, 0.09)), (-1.0, (0.08, 0.05)), (99.0, (0.11, 0.09))):
        assert move.at(t).position == pytest.approx(place, abs=1e-15)
        assert move.at(t).velocity.tolist() == move.at(t).acceleration.tolist() == [0.0, 0.0]
    t, x, v, a = course(move)
    assert np.gradient(x, t)[1:-1] == pytest.approx(v[1:-1], abs=1e-6)
    assert np.gradient(v, t)[1:-1] == pytest.approx(a[1:-1], abs=1e-4)
    middle = move.at(0.3 * move.duration).position - (0.08, 0.05)
    assert middle[1] / middle[0] == pytest.approx(4 / 3)


def test_a_move_to_where_it_stands_takes_no_time():
    move = SmoothMove.within((0.09, 0.06), (0.09, 0.06), speed=0.1, acceleration=1.0)
    assert move.duration == 0.0
    assert move.at(0.0).position.tolist() == [0.09, 0.06]


def test_a_move_needs_positive_bounds():
    with pytest.raises(ValueError, match="must be positive"):
        SmoothMove.within((0.09, 0.06), (0.1, 0.06), speed=0.0, acceleration=1.0)


def test_a_hold_stands():
    assert [part.tolist() for part in Hold((0.09, 0.06), 1.0).at(0.5)] == [[0.09, 0.06], [0.0, 0.0], [0.0, 0.0]]
