"""The manipulator behind gears that give: as the rigid one in the limit, with wind-up that encoders do not see."""

from dataclasses import replace

import numpy as np
import pytest

from torquerig.device_sim.plant import ElasticManipulatorMachine, Friction, PlanarManipulatorMachine, TruthLog
from torquerig.device_sim.plant.elastic import STIFFEST
from torquerig.mechanism import HOME, Manipulator

THESIS = Manipulator.thesis()
SMOOTH = replace(THESIS, active_viscous=0.0, passive_viscous=0.0)
MS = 1_000_000
GEAR = 25.0
PUSH = np.array([0.05, -0.2, 0.25])


def soft(friction=None, compliance=1e-3, model=THESIS, **options) -> ElasticManipulatorMachine:
    return ElasticManipulatorMachine(model, friction or Friction.none(), compliance, **options)


def pushed(machine, cycles=25):
    """Positions of the end-effector while the motors swing it, every 4 ms, shape (cycles, 2)."""
    places = []
    for k in range(cycles):
        for axis, most in enumerate(PUSH):
            machine.set_torque_demand(axis, most * np.sin(k / 5), 4 * MS * k)
        places.append(machine.position)
    return np.array(places)


def angles(machine, at_ns):
    return np.array([machine.motor_angle(axis, at_ns) for axis in range(3)]) / GEAR


@pytest.mark.parametrize("coulomb", [0.0, 1.0])
def test_the_stiffer_the_gears_the_nearer_it_is_to_the_rigid_machine(coulomb):
    friction = Friction.uniform(coulomb)
    rigid = pushed(PlanarManipulatorMachine(THESIS, friction))
    off = [np.abs(pushed(soft(friction, compliance)) - rigid).max() for compliance in (1e-3, 1e-4, 1e-5)]
    assert off[0] > 4 * off[1] > 8 * off[2]
    assert off[2] < 3e-5


def test_halving_the_step_quarters_the_error():
    exact, fine, coarse = (pushed(soft(model=SMOOTH, step_ns=step)) for step in (3_125, 25_000, 50_000))
    assert 3.0 < np.abs(coarse - exact).max() / np.abs(fine - exact).max() < 5.5


def test_without_friction_and_damping_energy_is_kept():
    machine = soft(model=SMOOTH, relaxation=0.0, lag=0.0)
    links = replace(SMOOTH, actuator_inertia=0.0)

    def energy():
        rates = np.array([machine.motor_velocity(axis, machine.now_ns) for axis in range(3)]) / GEAR
        moving = machine.velocity @ links.task_inertia(machine.position) @ machine.velocity
        return 0.5 * (moving + SMOOTH.actuator_inertia * rates @ rates + machine.wind_up @ machine.wind_up / 1e-3)

    for axis, torque in enumerate(PUSH):
        machine.set_torque_demand(axis, torque, 0)
    machine.advance(5 * MS)
    for axis in range(3):
        machine.set_torque_demand(axis, 0.0, 5 * MS)
    before = energy()
    swinging = []
    for k in range(6, 40):
        machine.advance(k * MS)
        swinging.append(energy())
    assert before > 1e-3
    assert swinging == pytest.approx([before] * len(swinging), rel=2e-4)


def test_preload_winds_the_gears_up_and_moves_nothing_that_encoders_could_tell_from_it():
    """A torque in the null space of S' turns the motors by its share of the compliance; the end-effector stays."""
    machine = soft(compliance=1e-3)
    S = THESIS.jacobians(HOME)[1]
    preload = np.linalg.svd(S.T)[2][-1] * 0.04
    for axis, torque in enumerate(preload):
        machine.set_torque_demand(axis, torque, 0)
    machine.advance(500 * MS)
    assert machine.wind_up == pytest.approx(GEAR * preload * 1e-3, rel=1e-3)
    assert machine.position == pytest.approx(HOME, abs=2e-5)
    turned = angles(machine, 500 * MS) - THESIS.inverse_kinematics(HOME).theta
    assert turned == pytest.approx(machine.wind_up, abs=1e-4)


def test_a_motor_that_friction_holds_does_not_turn_by_a_bit_until_it_breaks_away():
    machine = soft(Friction.uniform(1.0, 1.5))
    home = angles(machine, 0)
    for axis in range(3):
        machine.set_torque_demand(axis, 1.49 / GEAR, 0)
    assert (angles(machine, 50 * MS) == home).all()
    assert [machine.motor_velocity(axis, 50 * MS) for axis in range(3)] == [0.0] * 3
    for axis in range(3):
        machine.set_torque_demand(axis, 1.51 / GEAR, 50 * MS)
    assert (angles(machine, 60 * MS) != home).all()


def test_motors_come_to_rest_for_good_and_the_links_swing_out_behind_them():
    machine = soft(Friction.uniform(1.0))
    pushed(machine, 8)
    for axis in range(3):
        machine.set_torque_demand(axis, 0.0, 32 * MS)
    machine.advance(600 * MS)
    assert all(machine.motor_velocity(axis, 600 * MS) == 0.0 for axis in range(3))
    assert (angles(machine, 700 * MS) == angles(machine, 700 * MS)).all()
    assert np.abs(machine.velocity).max() < 1e-6
    assert 0.0 < np.abs(machine.wind_up).max() <= 1.0 * 1e-3
    assert THESIS.forward_kinematics(angles(machine, 700 * MS)) != pytest.approx(machine.position, abs=1e-7)


def test_at_the_edge_of_the_workspace_the_links_stop_and_the_motors_do_not_run_away():
    machine = soft(Friction.uniform(0.5), lag=0.0)
    for axis, torque in enumerate((0.3, -0.3, 0.3)):
        machine.set_torque_demand(axis, torque, 0)
    machine.advance(2_000 * MS)
    there, wound = machine.position, machine.wind_up
    machine.advance(2_100 * MS)
    assert machine.stops >= 1
    assert machine.position == pytest.approx(there, abs=1e-4)
    assert machine.wind_up == pytest.approx(wound, abs=1e-3)
    assert np.abs(wound).max() < 0.1


def test_the_truth_is_the_links():
    log = TruthLog(grid_ns=MS)
    machine = soft(log=log)
    for axis, torque in enumerate(PUSH):
        machine.set_torque_demand(axis, torque, 0)
    machine.advance(20 * MS)
    rows = log.rows()
    assert len(rows.at_ns) == 21
    assert (rows.position[-1] == machine.position).all()
    assert rows.theta[-1] == pytest.approx(THESIS.inverse_kinematics(machine.position).theta)
    assert angles(machine, 20 * MS) - rows.theta[-1] == pytest.approx(machine.wind_up)
    assert rows.motor_torque[-1] == pytest.approx(PUSH)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"compliance": STIFFEST / 2}, "compliance is 5e-07"),
        ({"compliance": float("nan")}, "compliance is nan"),
        ({"relaxation": -1.0}, "relaxation is -1"),
        ({"lag": float("inf")}, "lag is inf"),
        ({"step_ns": 0}, "step_ns is 0"),
        ({"model": replace(THESIS, actuator_inertia=0.0)}, "actuator_inertia is 0"),
        ({"position": (0.13999, 0.062)}, "too near a singular pose"),
    ],
)
def test_what_cannot_be_is_named(options, complaint):
    with pytest.raises(ValueError, match=complaint):
        soft(**options)
