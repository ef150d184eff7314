"""Dry friction at rest: the machine sticks if and only if some friction within its limits bears the load."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog, lsq_linear

from torquerig.device_sim.plant import Friction, PlanarManipulatorMachine, integrator, layout
from torquerig.mechanism import HOME, Manipulator

THESIS = Manipulator.thesis()
N = THESIS.gear_ratio
MS = 1_000_000
US = 1_000

positions = st.tuples(st.floats(0.08, 0.13), st.floats(0.04, 0.09))
directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
limits = st.tuples(*[st.floats(0.1, 3.0)] * 3)


def largest_load(position: tuple[float, float], tau_m: np.ndarray, breakaway: tuple[float, float, float]) -> float:
    """How many times tau_m friction can bear: a linear programme over that factor and the three frictions."""
    _, S = THESIS.jacobians(position)
    equal = np.column_stack([-N * S.T @ tau_m, S.T])
    bounds = [(0.0, None), *[(-limit, limit) for limit in breakaway]]
    solution = linprog([-1.0, 0.0, 0.0, 0.0], A_eq=equal, b_eq=[0.0, 0.0], bounds=bounds)
    return np.inf if solution.x is None else float(solution.x[0])


def machine_at(position: tuple[float, float], friction: Friction, lag: float = 0.0) -> PlanarManipulatorMachine:
    return PlanarManipulatorMachine(THESIS, friction, lag=lag, position=position)


def pull(machine: PlanarManipulatorMachine, tau_m: np.ndarray, at_ns: int = 0) -> None:
    for axis in range(3):
        machine.set_torque_demand(axis, float(tau_m[axis]), at_ns)


@given(positions, directions, limits, st.sampled_from([0.0, 1e-4]))
def test_machine_sticks_just_below_the_limit_and_moves_just_above(
    position: tuple[float, float], direction: tuple[float, float, float], limit: tuple[float, float, float], lag: float
) -> None:
    tau_m = np.array(direction)
    factor = largest_load(position, tau_m, limit)
    assume(1e-3 < factor < 1e3)
    below, above = (machine_at(position, Friction(limit, limit), lag) for _ in range(2))
    pull(below, (1.0 - 1e-6) * factor * tau_m)
    below.advance(10 * MS)
    assert below.at_rest
    assert below.position.tolist() == list(position)
    pull(above, (1.0 + 1e-4) * factor * tau_m)
    above.advance(10 * MS)
    assert not above.at_rest
    assert np.linalg.norm(above.velocity) > 0.0


def test_preload_alone_never_moves_the_machine_however_large() -> None:
    _, S = THESIS.jacobians(HOME)
    null = np.cross(S[:, 0], S[:, 1])
    machine = machine_at(HOME, Friction.uniform(1.0))
    pull(machine, 40.0 / N * null / np.abs(null).min())  # each joint alone is forty times beyond its own limit
    machine.advance(100 * MS)
    assert machine.at_rest


def test_machine_at_rest_does_not_drift_by_a_bit_in_ten_seconds() -> None:
    machine = machine_at(HOME, Friction.uniform(1.64), lag=1e-4)
    pull(machine, np.array([0.4, -0.3, -0.3]))
    machine.advance(30 * MS)
    pull(machine, np.array([0.03, 0.01, -0.02]), 30 * MS)
    machine.advance(500 * MS)
    assert machine.at_rest
    place, angles = machine.position.tolist(), [machine.motor_angle(axis, 500 * MS) for axis in range(3)]
    for at_ns in range(504 * MS, 10_500 * MS, 4 * MS):
        machine.set_torque_demand(at_ns % 3, 0.02 * (-1) ** (at_ns // (4 * MS)), at_ns)
        assert [machine.motor_angle(axis, at_ns) for axis in range(3)] == angles
        assert [machine.motor_velocity(axis, at_ns) for axis in range(3)] == [0.0, 0.0, 0.0]
    assert machine.position.tolist() == place


@given(positions, directions, limits, st.floats(1.01, 5.0))
def test_first_acceleration_is_the_convex_problems(
    position: tuple[float, float], direction: tuple[float, float, float], limit: tuple[float, float, float], over: float
) -> None:
    tau_m = np.array(direction)
    factor = largest_load(position, tau_m, limit)
    assume(1e-3 < factor < 1e3)
    machine = machine_at(position, Friction(limit, limit))
    pull(machine, over * factor * tau_m)
    machine.advance(1)
    Mt, _, _, S = THESIS.dynamics(position, (0.0, 0.0))
    root = np.linalg.cholesky(Mt)
    load = N * S.T @ (over * factor * tau_m)
    dual = lsq_linear(
        np.linalg.solve(root, S.T), np.linalg.solve(root, load), (-np.array(limit), np.array(limit)), method="bvls"
    )
    expected = np.linalg.solve(Mt, load - S.T @ dual.x)
    assert machine.velocity / 1e-9 == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())


def held_start() -> tuple[PlanarManipulatorMachine, int]:
    """A machine just pulled free, so that one joint still rests; and that joint."""
    tau_m = np.array([0.0, 1.0, -0.9])
    limit = (1.64, 1.64, 1.64)
    machine = machine_at(HOME, Friction(limit, limit))
    pull(machine, 1.3 * largest_load(HOME, tau_m, limit) * tau_m)
    machine.advance(1)
    return machine, machine.resting_joints.index(True)


def test_one_joint_may_rest_while_the_others_move() -> None:
    machine, held = held_start()
    assert sum(machine.resting_joints) == 1
    angle = machine.motor_angle(held, 1)
    others = [axis for axis in range(3) if axis != held]
    before = [machine.motor_angle(axis, 1) for axis in others]
    for at_ns in range(100 * US, 10 * MS, 100 * US):
        assert machine.motor_velocity(held, at_ns) == 0.0
        assert machine.motor_angle(held, at_ns) == angle
        assert THESIS.joint_rates(machine.position, machine.velocity)[held] == pytest.approx(0.0, abs=1e-13)
        assert N * THESIS.inverse_kinematics(machine.position).theta[held] == pytest.approx(angle, abs=1e-12)
    after = [machine.motor_angle(axis, 10 * MS) for axis in others]
    assert (np.abs(np.subtract(after, before)) > 0.005).all()


def test_held_joint_carries_what_the_others_leave_to_it() -> None:
    """The motion with one freedom, once more: a turn about the held elbow, its angle by Lagrange's equation."""
    machine, held = held_start()
    tau_m = [machine.motor_torque(axis, 1) for axis in range(3)]
    base = np.array(THESIS.bases[held])
    theta = THESIS.inverse_kinematics(HOME).theta[held]
    elbow = base + THESIS.link_length * np.array([np.cos(theta), np.sin(theta)])
    arm = np.array(HOME) - elbow
    angle, rate, step = np.arctan2(arm[1], arm[0]), 0.0, 1e-5
    signs = np.sign([machine.motor_velocity(axis, 1) for axis in range(3)])

    def acceleration(turned: float, turning: float) -> float:
        unit = np.array([np.cos(turned), np.sin(turned)])
        x, t = elbow + THESIS.link_length * unit, THESIS.link_length * np.array([-unit[1], unit[0]])
        v = turning * t
        Mt, Ct, Ft, S = THESIS.dynamics(x, v)
        centripetal = -THESIS.link_length * turning**2 * unit
        force = S.T @ (N * np.array(tau_m) - 1.64 * signs) - (Ct + Ft) @ v - Mt @ centripetal
        return float(t @ force / (t @ Mt @ t))

    for _ in range(1000):
        k1 = acceleration(angle, rate)
        k2 = acceleration(angle + 0.5 * step * rate, rate + 0.5 * step * k1)
        k3 = acceleration(angle + 0.5 * step * (rate + 0.5 * step * k1), rate + 0.5 * step * k2)
        k4 = acceleration(angle + step * (rate + 0.5 * step * k2), rate + step * k3)
        angle += step * (rate + step * (k1 + k2 + k3) / 6.0)
        rate += step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
    machine.advance(10 * MS)
    assert machine.resting_joints.index(True) == held
    expected = elbow + THESIS.link_length * np.array([np.cos(angle), np.sin(angle)])
    assert machine.position == pytest.approx(expected, abs=1e-10)


def test_breakaway_above_coulomb_holds_more_than_it_brakes() -> None:
    friction = Friction.uniform(1.0, 1.5)
    tau_m = np.array([1.0, -0.4, -0.3])
    slides, breaks = (largest_load(HOME, tau_m, (limit,) * 3) for limit in (1.0, 1.5))
    machine = machine_at(HOME, friction)
    pull(machine, 0.999 * breaks * tau_m)
    machine.advance(20 * MS)
    assert machine.at_rest
    pull(machine, 1.001 * breaks * tau_m, 20 * MS)
    machine.advance(22 * MS)
    moving = np.linalg.norm(machine.velocity)
    assert moving > 0.0
    pull(machine, 1.2 * slides * tau_m, 22 * MS)
    machine.advance(60 * MS)
    assert np.linalg.norm(machine.velocity) > moving
    pull(machine, 0.0 * tau_m, 60 * MS)
    machine.advance(200 * MS)
    assert machine.at_rest
    pull(machine, 0.999 * slides * tau_m, 200 * MS)
    machine.advance(220 * MS)
    assert machine.at_rest


def test_stiction_without_coulomb_friction_only_holds() -> None:
    tau_m = np.array([1.0, -0.4, -0.3])
    breaks = largest_load(HOME, tau_m, (0.5, 0.5, 0.5))
    sticky, free = machine_at(HOME, Friction.uniform(0.0, 0.5)), machine_at(HOME, Friction.none())
    for machine in (sticky, free):
        pull(machine, 1.5 * breaks * tau_m)
        machine.advance(20 * MS)
    assert sticky.position == pytest.approx(free.position, abs=1e-12)
    held = machine_at(HOME, Friction.uniform(0.0, 0.5))
    pull(held, 0.99 * breaks * tau_m)
    held.advance(20 * MS)
    assert held.at_rest


@settings(max_examples=30)
@given(directions, st.floats(2.0, 8.0), limits)
def test_coasting_machine_comes_to_rest_joint_by_joint_and_stays(
    direction: tuple[float, float, float], over: float, limit: tuple[float, float, float]
) -> None:
    tau_m = np.array(direction)
    factor = largest_load(HOME, tau_m, limit)
    assume(1e-3 < factor < 1e3)
    machine = machine_at(HOME, Friction(limit, limit))
    pull(machine, over * factor * tau_m)
    machine.advance(5 * MS)
    pull(machine, 0.0 * tau_m, 5 * MS)
    resting = []
    for at_ns in range(5 * MS, 205 * MS, 500 * US):
        machine.advance(at_ns)
        resting.append(sum(machine.resting_joints))
    assert resting[-1] == 3
    changes = [count for count, before in zip(resting[1:], resting, strict=False) if count != before]
    assert len(changes) <= 4
    assert machine.velocity.tolist() == [0.0, 0.0]


def test_a_machine_with_one_rough_joint_holds_that_joint_only() -> None:
    machine = machine_at(HOME, Friction((2.0, 0.0, 0.0), (2.0, 0.0, 0.0)))
    pull(machine, np.array([0.02, 0.01, -0.01]))
    angle = machine.motor_angle(0, 0)
    machine.advance(10 * MS)
    assert machine.resting_joints == (True, False, False)
    assert machine.motor_angle(0, 10 * MS) == angle
    assert abs(machine.motor_velocity(1, 10 * MS)) > 0.01


def test_crowding_events_let_joints_come_to_rest_but_not_give_way() -> None:
    machine = machine_at(HOME, Friction.uniform(1.0))
    constants, parameters, state = machine._constants, machine._parameters, machine._state
    state[layout.TORQUE : layout.TORQUE + 3] = state[layout.DEMAND : layout.DEMAND + 3] = (0.5, 0.0, 0.0)
    state[layout.EVENTS] = layout.CROWD
    assert integrator.wait_for_load(constants, parameters, state, 1e-3) == parameters[layout.STEP]
    assert machine.at_rest
    state[layout.EVENTS] = layout.CROWD - 1.0
    assert integrator.wait_for_load(constants, parameters, state, 1e-3) == 0.0
    assert not machine.at_rest
    state[layout.EVENTS] = layout.CROWD
    integrator.hold_or_slide(constants, parameters, state, 1)
    assert machine.resting_joints[1]
