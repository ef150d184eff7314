"""The laws against the thesis' equations typed here, with numpy.linalg.pinv and the textbook's matrices."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from torquerig.control import UnknownMotionError, law_named, load_laws
from torquerig.mechanism import HOME

GEAR = 25.0
RATES = st.floats(-0.3, 0.3)
OFFSETS = st.floats(-0.005, 0.005)


def printed(name, textbook, kp, kv, state, desired, friction):
    """The law as the thesis prints it (6.3), misprints put right."""
    M, C, F, S = textbook.dynamics(state.position, state.velocity)
    e, edot = desired.position - state.position, desired.velocity - state.velocity
    share = np.linalg.pinv(S.T) / GEAR
    force = F @ desired.velocity if friction else np.zeros(2)
    match name:
        case "decoupled-pd":
            return kp * (desired.q - state.q) + kv * (desired.qd - state.qd) + share @ force
        case "coupled-pd":
            return share @ (kp * e + kv * edot + force)
        case "augmented-pd":
            return share @ (M @ desired.acceleration + C @ desired.velocity + kp * e + kv * edot + force)
        case _:
            return share @ (M @ (desired.acceleration + kv * edot + kp * e) + force)


@pytest.mark.parametrize("friction", [False, True])
@pytest.mark.parametrize("name", ["decoupled-pd", "coupled-pd", "augmented-pd", "computed-torque"])
@settings(max_examples=30, deadline=None)
@given(dx=OFFSETS, dy=OFFSETS, vx=RATES, vy=RATES, ex=OFFSETS, ey=OFFSETS)
def test_a_law_equals_its_printed_equation(model, textbook, situation, name, friction, dx, dy, vx, vy, ex, ey):
    from_here = situation(x=HOME[0] + dx, y=HOME[1] + dy, vx=vx, vy=vy, ex=ex, ey=ey)
    law = law_named(name).for_motion(model, 2, friction=friction)
    expected = printed(name, textbook, law.kp, law.kv, *from_here, friction)
    assert law.torque(*from_here) == pytest.approx(expected, rel=1e-9, abs=1e-12)


# the table of experiments.md: gains 1, gains 2, results 1, results 2, running time in ms, friction fed forward
TABLE = {
    "decoupled-pd": ((18, 0.16), (32, 0.22), (1.2285, 0.0753), (1.9785, 0.1323), 2.71, False),
    "coupled-pd": ((28000, 700), (38000, 1200), (1.5021, 0.0565), (1.7220, 0.1024), 2.81, False),
    "augmented-pd": ((8500, 400), (14000, 700), (1.0447, 0.0471), (0.7143, 0.0606), 2.81, True),
    "computed-torque": ((3000, 120), (6000, 300), (0.9592, 0.0436), (0.9778, 0.0547), 3.18, True),
}


def test_the_laws_carry_the_thesis_tables(model):
    laws = load_laws()
    assert laws.keys() >= TABLE.keys()  # others may have been added
    for name, (gains1, gains2, result1, result2, milliseconds, friction) in TABLE.items():
        law = laws[name]
        assert law.name == name
        assert law.gains == {1: gains1, 2: gains2}
        assert {motion: row[:2] for motion, row in law.published.items()} == {1: result1, 2: result2}
        assert [row.source for row in law.published.values()] == ["thesis, Table 6.1", "thesis, Table 6.2"]
        assert law.running_time_ns == round(milliseconds * 1e6)
        made = law.for_motion(model, 2)
        assert (made.kp, made.kv, made.friction, made.stiction) == (*gains2, friction, 0.0)


def test_computed_torque_gives_the_acceleration_it_aims_at(model, situation):
    """On the model itself: with friction fed forward along the motion only Coriolis forces are missing."""
    state, desired = situation(vx=0.2, vy=0.1, evx=0.0, evy=0.0, ex=1e-4, ey=-1e-4)
    law = law_named("computed-torque").for_motion(model, 1)
    reached = model.forward_dynamics(state.position, state.velocity, law.torque(state, desired))
    M, C, _, _ = model.dynamics(state.position, state.velocity)
    aimed = desired.acceleration + law.kp * (desired.position - state.position)
    assert reached == pytest.approx(aimed - np.linalg.solve(M, C @ state.velocity))


@pytest.mark.parametrize("name", TABLE)
def test_stiction_is_fed_forward_on_joint_1_along_its_desired_rate(model, situation, name):
    law = law_named(name)
    for sign in (-1, 1):
        state, desired = situation(vx=0.3 * sign, vy=-0.1 * sign)
        extra = law.for_motion(model, 1, stiction=0.02).torque(state, desired)
        extra = extra - law.for_motion(model, 1).torque(state, desired)
        assert extra == pytest.approx([0.02 * np.sign(desired.qd[0]), 0, 0], abs=1e-12)
        assert np.sign(desired.qd[0]) != 0


def test_a_motion_without_gains_is_refused(model):
    with pytest.raises(UnknownMotionError, match="coupled-pd has no gains for motion 3, only for 1, 2"):
        law_named("coupled-pd").for_motion(model, 3)
