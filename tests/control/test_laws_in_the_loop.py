"""The forms in which laws and kinematics run in the loop, beside the equations that they are of."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from torquerig.control import Controller, law_named, make_estimator
from torquerig.control.observer import Observer
from torquerig.control.terms import Terms
from torquerig.mechanism import HOME, ReachError, SingularPoseError

PERIOD_NS = 4_000_000
EACH = {name: 1.0 + place for place, name in enumerate(Terms.__dataclass_fields__)}


@pytest.fixture
def observer(model):
    return Observer(model, make_estimator("backward-difference", axes=3))


def sample_at(model, x, y, at_ns):
    return SimpleNamespace(q=model.inverse_kinematics((x, y)).theta, at_ns=at_ns)


@pytest.mark.parametrize("name", EACH)
def test_each_coefficient_stands_for_its_term(name, model, situation):
    state, desired = situation()
    M, C, F, _ = model.dynamics(state.position, state.velocity)
    e, edot = desired.position - state.position, desired.velocity - state.velocity
    forces = {
        "inertia": M @ desired.acceleration,
        "inertia_kp": M @ e,
        "inertia_kv": M @ edot,
        "coriolis": C @ desired.velocity,
        "friction": F @ desired.velocity,
        "kp": e,
        "kv": edot,
    }
    torques = {
        "joint_kp": desired.q - state.q,
        "joint_kv": desired.qd - state.qd,
        "stiction": np.array((np.sign(desired.qd[0]), 0.0, 0.0)),
    }
    torque = torques[name] if name in torques else model.distribute(state.position, forces[name])
    assert np.any(torque)
    compiled = Terms(**{name: EACH[name]}).torque(model)
    assert compiled(state, desired) == pytest.approx(EACH[name] * torque, rel=1e-12, abs=1e-12)


def test_all_terms_together_are_their_sum(model, situation):
    alone = [Terms(**{name: size}).torque(model)(*situation()).copy() for name, size in EACH.items()]
    assert Terms(**EACH).torque(model)(*situation()) == pytest.approx(sum(alone), rel=1e-12, abs=1e-12)


def test_a_joint_that_is_to_stand_gets_no_stiction(model, situation):
    state, desired = situation(vx=0.0, vy=0.0, evx=0.0, evy=0.0)
    assert not Terms(stiction=0.02).torque(model)(state, desired).any()


@pytest.mark.parametrize("name", ["inertia", "kp"])
def test_a_position_out_of_reach_is_refused_as_by_the_equation(name, model, situation):
    state, desired = situation()
    with pytest.raises(ReachError, match="leg 2"):
        Terms(**{name: 1.0}).torque(model)(state._replace(position=np.array((0.0, 0.2))), desired)


def test_a_law_that_changes_its_parents_equation_runs_by_its_own(model, situation):
    parent = law_named("computed-torque")

    @dataclass(frozen=True, slots=True)
    class Half(parent):
        def torque(self, state, desired):
            return 0.5 * parent.torque(self, state, desired)

    whole, half = (law.for_motion(model, 1).in_loop()(*situation()) for law in (parent, Half))
    assert half == pytest.approx(0.5 * whole, rel=1e-12)


def test_a_controller_runs_the_form_for_the_loop(model, situation):
    law = law_named("augmented-pd").for_motion(model, 1)
    controller = Controller(model, make_estimator("backward-difference", axes=3), law, limits=None)
    first = controller.torque(*situation())
    assert first == pytest.approx(law.torque(*situation()), rel=1e-12)
    assert controller.torque(*situation(vx=0.0)) is first


def test_what_is_observed_are_the_models_kinematics(model, observer):
    observer.observe(sample_at(model, *HOME, 0))
    state = observer.observe(sample_at(model, HOME[0] + 0.001, HOME[1] - 0.002, PERIOD_NS))
    assert np.array_equal(state.position, model.forward_kinematics(state.q))
    assert np.array_equal(state.velocity, model.task_velocity(state.position, state.qd))
    assert state.velocity == pytest.approx((0.25, -0.5), rel=0.02)


def test_a_state_is_the_same_arrays_every_time(model, observer):
    first = observer.observe(sample_at(model, *HOME, 0))
    second = observer.observe(sample_at(model, 0.095, 0.065, PERIOD_NS))
    assert all(one is other for one, other in zip(first, second, strict=True))


def test_a_sample_is_left_as_it_was(model, observer):
    sample = sample_at(model, *HOME, 0)
    before = sample.q.copy()
    observer.observe(sample)
    observer.observe(sample_at(model, 0.095, 0.065, PERIOD_NS))
    assert np.array_equal(sample.q, before)


def test_elbows_in_a_line_are_refused(observer):
    with pytest.raises(SingularPoseError, match="elbows"):
        observer.observe(SimpleNamespace(q=np.array((0.0, 0.0, np.nan)), at_ns=0))
