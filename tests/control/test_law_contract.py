"""What the loop asks of every law, run over all that the scan finds: also over one that has just been added."""

from dataclasses import FrozenInstanceError
from math import isfinite

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from torquerig.control import load_laws
from torquerig.mechanism import HOME

RATES = st.floats(-0.3, 0.3)
OFFSETS = st.floats(-0.005, 0.005)


@pytest.fixture(scope="module", params=load_laws().values(), ids=lambda law: law.name)
def law_class(request):
    return request.param


@pytest.fixture
def law(law_class, model):
    return law_class.for_motion(model, min(law_class.gains))


def test_gains_are_positive_and_finite(law_class):
    for kp, kv in law_class.gains.values():
        assert 0 < kp < float("inf")
        assert 0 <= kv < float("inf")


def test_what_is_published_belongs_to_a_motion_with_gains(law_class):
    assert law_class.published.keys() <= law_class.gains.keys()
    assert law_class.running_time_ns is None or law_class.running_time_ns > 0


def test_a_law_is_frozen(law):
    with pytest.raises(FrozenInstanceError):
        law.kp = 1.0


@pytest.mark.parametrize("friction", [False, True])
@settings(max_examples=30, deadline=None)
@given(dx=OFFSETS, dy=OFFSETS, vx=RATES, vy=RATES, ex=OFFSETS, ey=OFFSETS)
def test_torques_are_three_finite_numbers(law_class, model, situation, friction, dx, dy, vx, vy, ex, ey):
    from_here = situation(x=HOME[0] + dx, y=HOME[1] + dy, vx=vx, vy=vy, ex=ex, ey=ey)
    for motion in law_class.gains:
        torque = law_class.for_motion(model, motion, friction=friction, stiction=0.02).torque(*from_here)
        assert torque.shape == (3,)
        assert torque.dtype == np.float64
        assert all(map(isfinite, torque))


@pytest.mark.parametrize("friction", [False, True])
@settings(max_examples=30, deadline=None)
@given(dx=OFFSETS, dy=OFFSETS, vx=RATES, vy=RATES, ex=OFFSETS, ey=OFFSETS)
def test_the_loop_gets_the_torques_of_the_equation(law_class, model, situation, friction, dx, dy, vx, vy, ex, ey):
    from_here = situation(x=HOME[0] + dx, y=HOME[1] + dy, vx=vx, vy=vy, ex=ex, ey=ey)
    for motion in law_class.gains:
        law = law_class.for_motion(model, motion, friction=friction, stiction=0.02)
        assert law.in_loop()(*from_here) == pytest.approx(law.torque(*from_here), rel=1e-12, abs=1e-12)


def test_at_rest_on_the_reference_no_law_asks_for_torque(law, situation):
    on_it = situation(vx=0, vy=0, ex=0, ey=0, evx=0, evy=0, ax=0, ay=0)
    assert law.torque(*on_it) == pytest.approx(np.zeros(3), abs=1e-12)


def test_the_torque_pushes_towards_the_reference(law, model, situation):
    """The machine accelerates along the error, in x as in y: signs."""
    for ex, ey in ((0.001, 0.0), (0.0, 0.001), (-0.001, 0.0), (0.0, -0.001)):
        state, desired = situation(vx=0, vy=0, ex=ex, ey=ey, evx=0, evy=0, ax=0, ay=0)
        acceleration = model.forward_dynamics(state.position, state.velocity, law.torque(state, desired))
        assert acceleration @ (ex, ey) > 0


def test_torques_are_those_of_the_motor_not_of_the_joint(law, situation):
    """A millimetre off the reference asks for no more than twice what the motor has: units."""
    for ex, ey in ((0.001, 0.0), (0.0, 0.001)):
        torque = law.torque(*situation(vx=0, vy=0, ex=ex, ey=ey, evx=0, evy=0, ax=0, ay=0))
        assert np.max(np.abs(torque)) < 1.5


def test_a_law_remembers_nothing(law, situation):
    first, other = situation(), situation(vx=-0.1, ex=-0.003)
    torque = law.torque(*first).copy()
    law.torque(*other)
    assert np.array_equal(law.torque(*first), torque)


def test_a_law_leaves_its_arguments_as_they_were(law_class, model, situation):
    state, desired = situation()
    before = [part.copy() for part in (*state, *desired)]
    law_class.for_motion(model, min(law_class.gains), friction=True, stiction=0.02).torque(state, desired)
    assert all(np.array_equal(was, now) for was, now in zip(before, (*state, *desired), strict=True))
