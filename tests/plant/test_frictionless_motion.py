"""Without dry friction: the plant against an independent integrator of the equation of motion."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from torquerig.device_sim.plant import Friction, PlanarManipulatorMachine
from torquerig.mechanism import HOME, Manipulator

THESIS = Manipulator.thesis()
N = THESIS.gear_ratio
MS = 1_000_000

schedules = st.lists(
    st.tuples(st.integers(0, 2), st.floats(-0.25, 0.25), st.integers(50_000, 4 * MS)), min_size=1, max_size=8
)


def reference(lag: float, schedule: list[tuple[int, float, int]]) -> np.ndarray:
    """Position, velocity, motor torques after the schedule, by an adaptive integrator of order 8."""
    state, demand = np.array([*HOME, 0.0, 0.0, 0.0, 0.0, 0.0]), np.zeros(3)

    def rates(_: float, s: np.ndarray) -> np.ndarray:
        torque_rate = (demand - s[4:]) / lag if lag > 0.0 else np.zeros(3)
        return np.concatenate([s[2:4], THESIS.forward_dynamics(s[:2], s[2:4], s[4:]), torque_rate])

    for axis, torque, duration_ns in schedule:
        demand[axis] = torque
        if lag == 0.0:
            state[4 + axis] = torque
        path = solve_ivp(
            rates, (0.0, duration_ns * 1e-9), state, method="DOP853", rtol=1e-11, atol=1e-13, max_step=5e-4
        )
        state = path.y[:, -1]
    return state


def played(machine: PlanarManipulatorMachine, schedule: list[tuple[int, float, int]]) -> np.ndarray:
    """The same of the machine."""
    now = machine.now_ns
    for axis, torque, duration_ns in schedule:
        machine.set_torque_demand(axis, torque, now)
        now += duration_ns
    torques = [machine.motor_torque(axis, now) for axis in range(3)]
    return np.array([*machine.position, *machine.velocity, *torques])


@settings(max_examples=15)
@given(schedules, st.sampled_from([0.0, 2e-5, 1e-4, 1e-3]))
def test_motion_is_the_equation_of_motions(schedule: list[tuple[int, float, int]], lag: float) -> None:
    machine = PlanarManipulatorMachine(THESIS, Friction.none(), lag=lag)
    found = played(machine, schedule)
    assert machine.stops == 0
    expected = reference(lag, schedule)
    assert found[:2] == pytest.approx(expected[:2], abs=1e-10)
    assert found[2:4] == pytest.approx(expected[2:4], abs=2e-8)
    assert found[4:] == pytest.approx(expected[4:], abs=1e-9)


@settings(max_examples=15)
@given(schedules, st.lists(st.integers(1, 60 * MS), max_size=40))
def test_motion_does_not_depend_on_who_asks_when(schedule: list[tuple[int, float, int]], asked: list[int]) -> None:
    quiet = PlanarManipulatorMachine(THESIS, Friction.none())
    busy = PlanarManipulatorMachine(THESIS, Friction.none())
    expected = played(quiet, schedule)
    now = 0
    for axis, torque, duration_ns in schedule:
        busy.set_torque_demand(axis, torque, now)
        for instant in sorted(t for t in asked if now < t < now + duration_ns):
            busy.motor_angle(instant % 3, instant)
        now += duration_ns
    busy.advance(now)
    assert busy.position == pytest.approx(expected[:2], abs=1e-11)
    assert busy.velocity == pytest.approx(expected[2:4], abs=1e-8)


def test_error_falls_at_least_with_the_fourth_power_of_the_step() -> None:
    velocities = []
    for step_ns in (100_000, 50_000, 25_000):
        machine = PlanarManipulatorMachine(THESIS, Friction.none(), lag=0.0, step_ns=step_ns)
        velocities.append(played(machine, [(0, 0.5, 0), (1, -0.5, 0), (2, 0.2, 20 * MS)])[2:4])
    coarse, fine = np.abs(np.diff(velocities, axis=0)).max(axis=1)
    assert coarse < 1e-11
    assert coarse / fine > 12.0


@pytest.mark.parametrize("lag", [1e-5, 1e-4, 2e-3])
def test_torque_follows_demand_with_an_exact_first_order_lag(lag: float) -> None:
    machine = PlanarManipulatorMachine(THESIS, Friction.none(), lag=lag)
    machine.set_torque_demand(1, 0.5, 0)
    for at_ns in (1, 777, 10_000, 100_000, 123_456, 1_000_000, 5_000_000):
        expected = 0.5 * -np.expm1(-at_ns * 1e-9 / lag)
        assert machine.motor_torque(1, at_ns) == pytest.approx(expected, rel=1e-12)
    assert machine.motor_torque(0, 5_000_000) == 0.0


def test_torque_is_demand_at_once_without_lag() -> None:
    machine = PlanarManipulatorMachine(THESIS, Friction.none(), lag=0.0)
    machine.set_torque_demand(2, -0.25, 1000)
    assert machine.motor_torque(2, 1000) == -0.25


def test_motors_are_geared_joints() -> None:
    machine = PlanarManipulatorMachine(THESIS, Friction.none())
    assert machine.motor_angle(1, 0) == pytest.approx(N * THESIS.inverse_kinematics(HOME).theta[1], rel=1e-15)
    machine.set_torque_demand(0, 0.3, 0)
    machine.advance(20 * MS)
    theta = THESIS.inverse_kinematics(machine.position).theta
    rates = THESIS.joint_rates(machine.position, machine.velocity)
    for axis in range(3):
        assert machine.motor_angle(axis, 20 * MS) == pytest.approx(N * theta[axis], rel=1e-14)
        assert machine.motor_velocity(axis, 20 * MS) == pytest.approx(N * rates[axis], rel=1e-12)


def test_energy_is_conserved_without_any_friction() -> None:
    smooth = replace(THESIS, active_viscous=0.0, passive_viscous=0.0)
    machine = PlanarManipulatorMachine(smooth, Friction.none(), lag=0.0)
    start = [machine.motor_angle(axis, 0) for axis in range(3)]
    torques = (0.3, -0.2, 0.1)
    for axis, torque in enumerate(torques):
        machine.set_torque_demand(axis, torque, 0)
    for at_ns in range(4 * MS, 40 * MS, 4 * MS):
        turned = [machine.motor_angle(axis, at_ns) - start[axis] for axis in range(3)]
        energy = 0.5 * machine.velocity @ smooth.task_inertia(machine.position) @ machine.velocity
        assert energy == pytest.approx(np.dot(torques, turned), rel=1e-8)
    assert machine.stops == 0


def test_machine_without_torque_stays_where_it_stands() -> None:
    machine = PlanarManipulatorMachine(THESIS, Friction.none())
    machine.advance(2_000 * MS)
    assert machine.position.tolist() == list(HOME)
    assert machine.velocity.tolist() == [0.0, 0.0]
