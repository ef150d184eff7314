"""The edge of the workspace: a rigid inelastic stop before any singularity; never nan, never an exception."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from torquerig.device_sim.plant import Friction, PlanarManipulatorMachine
from torquerig.mechanism import HOME, Manipulator, ReachError

THESIS = Manipulator.thesis()
MS = 1_000_000

frictions = st.sampled_from([Friction.none(), Friction.uniform(0.5), Friction((2.0, 0.0, 0.0), (2.0, 0.0, 0.0))])


@settings(max_examples=40)
@given(frictions, st.tuples(*[st.floats(-1.6, 1.6)] * 3), st.sampled_from([0.0, 1e-4]))
def test_any_torque_for_a_second_leaves_a_valid_pose(
    friction: Friction, tau_m: tuple[float, float, float], lag: float
) -> None:
    machine = PlanarManipulatorMachine(THESIS, friction, lag=lag)
    for axis, torque in enumerate(tau_m):
        machine.set_torque_demand(axis, torque, 0)
    for at_ns in range(0, 1000 * MS, 50 * MS):
        machine.advance(at_ns)
        assert np.isfinite([*machine.position, *machine.velocity, machine.motor_angle(0, at_ns)]).all()
        assert THESIS.conditioning(machine.position) >= 0.01


def leaning_machine(friction: Friction) -> PlanarManipulatorMachine:
    """A machine that has been pushed against the edge for a second."""
    machine = PlanarManipulatorMachine(THESIS, friction)
    for axis, torque in enumerate((0.9, -0.9, 0.9)):
        machine.set_torque_demand(axis, torque, 0)
    machine.advance(1_000 * MS)
    return machine


def test_leaning_against_the_edge_is_one_stop() -> None:
    machine = leaning_machine(Friction.none())
    assert machine.stops == 1
    machine.advance(2_000 * MS)
    assert machine.stops == 1
    assert np.abs(machine.velocity).max() < 0.05


def test_machine_leaves_the_edge_when_pulled_back() -> None:
    machine = leaning_machine(Friction.uniform(0.5))
    place = machine.position
    pull = THESIS.inverse_dynamics(place, (0.0, 0.0), 5.0 * (HOME - place) / np.linalg.norm(HOME - place))
    for axis in range(3):
        machine.set_torque_demand(axis, pull[axis], 1_000 * MS)
    machine.advance(1_050 * MS)
    assert np.linalg.norm(machine.position - HOME) < np.linalg.norm(place - HOME) - 1e-3


def test_absurd_torque_neither_raises_nor_gives_nan() -> None:
    machine = PlanarManipulatorMachine(THESIS, Friction.uniform(1.0), lag=0.0)
    machine.set_torque_demand(0, 1e9, 0)
    machine.advance(10 * MS)
    machine.set_torque_demand(0, -1e300, 10 * MS)
    machine.advance(20 * MS)
    assert np.isfinite([*machine.position, *machine.velocity]).all()
    assert machine.stops > 0


def test_a_start_out_of_reach_or_at_the_edge_is_refused() -> None:
    with pytest.raises(ReachError, match="leg 1"):
        PlanarManipulatorMachine(THESIS, Friction.none(), position=(0.5, 0.062))
    with pytest.raises(ValueError, match="too near a singular pose"):
        PlanarManipulatorMachine(THESIS, Friction.none(), position=(0.13999, 0.062))
