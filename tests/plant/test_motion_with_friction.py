"""Moving under dry friction: energy, an independent time-stepping scheme, and no dependence on who asks when."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from torquerig.device_sim.plant import Friction, PlanarManipulatorMachine
from torquerig.mechanism import HOME, Manipulator

THESIS = Manipulator.thesis()
N = THESIS.gear_ratio
MS = 1_000_000

frictions = st.builds(
    lambda coulomb, more: Friction(coulomb, tuple(c * m for c, m in zip(coulomb, more, strict=True))),
    st.tuples(*[st.sampled_from([0.0, 0.3, 1.0, 1.64, 3.0])] * 3),
    st.tuples(*[st.sampled_from([1.0, 1.0, 1.5])] * 3),
)
schedules = st.lists(
    st.tuples(st.integers(0, 2), st.floats(-0.5, 0.5), st.integers(20_000, 6 * MS)), min_size=1, max_size=15
)


def energy(machine: PlanarManipulatorMachine) -> float:
    return float(0.5 * machine.velocity @ THESIS.task_inertia(machine.position) @ machine.velocity)


@settings(max_examples=60)
@given(frictions, schedules)
def test_friction_never_creates_energy(friction: Friction, schedule: list[tuple[int, float, int]]) -> None:
    """Without lag the torques are constant between demands, so the motors' work is torque times angle, exactly."""
    machine = PlanarManipulatorMachine(THESIS, friction, lag=0.0)
    now, torques = 0, np.zeros(3)
    for axis, torque, duration_ns in schedule:
        machine.set_torque_demand(axis, torque, now)
        torques[axis] = torque
        for _ in range(4):
            before, angles = energy(machine), [machine.motor_angle(i, now) for i in range(3)]
            now += duration_ns // 4
            turned = [machine.motor_angle(i, now) for i in range(3)]
            assert energy(machine) - before <= np.dot(torques, np.subtract(turned, angles)) + 1e-12
    assert np.isfinite(machine.position).all()


@pytest.mark.parametrize("coulomb", [0.5, 1.64])
def test_energy_balance_closes_with_what_friction_takes(coulomb: float) -> None:
    machine = PlanarManipulatorMachine(THESIS, Friction.uniform(coulomb), lag=0.0)
    tau_m = np.array([0.3, -0.2, -0.25])
    for axis in range(3):
        machine.set_torque_demand(axis, float(tau_m[axis]), 0)
    taken, last = 0.0, 0.0
    start = np.array([machine.motor_angle(axis, 0) for axis in range(3)])
    for at_ns in range(20_000, 30 * MS + 1, 20_000):
        turned = np.array([machine.motor_angle(axis, at_ns) for axis in range(3)])
        velocity = machine.velocity
        rates = THESIS.joint_rates(machine.position, velocity)[:3]
        loss = float(velocity @ THESIS.task_viscous(machine.position) @ velocity + coulomb * np.abs(rates).sum())
        taken, last = taken + 0.5 * (last + loss) * 20e-6, loss
    assert energy(machine) > 1e-3
    assert energy(machine) + taken == pytest.approx(float(tau_m @ (turned - start)), rel=1e-6)


@settings(max_examples=25)
@given(frictions, schedules, st.lists(st.integers(1, 40 * MS), max_size=40))
def test_motion_does_not_depend_on_who_asks_when(
    friction: Friction, schedule: list[tuple[int, float, int]], asked: list[int]
) -> None:
    quiet, busy = (PlanarManipulatorMachine(THESIS, friction) for _ in range(2))
    now = 0
    for axis, torque, duration_ns in schedule:
        quiet.set_torque_demand(axis, torque, now)
        busy.set_torque_demand(axis, torque, now)
        for instant in sorted(t for t in asked if now < t < now + duration_ns):
            busy.motor_velocity(instant % 3, instant)
        now += duration_ns
    quiet.advance(now)
    busy.advance(now)
    assert busy.position == pytest.approx(quiet.position, abs=1e-10)
    assert busy.velocity == pytest.approx(quiet.velocity, abs=1e-7)
    assert busy.resting_joints == quiet.resting_joints


def stepped(coulomb: np.ndarray, torque_at: list[np.ndarray], step: float) -> tuple[np.ndarray, np.ndarray]:
    """Moreau's time stepping: implicit friction, its cone solved by projected Gauss-Seidel sweeps. First order."""
    x, v, f = np.array(HOME), np.zeros(2), np.zeros(3)
    for tau_m in torque_at:
        Mt, Ct, Ft, S = THESIS.dynamics(x, v)
        weight = np.linalg.inv(Mt)
        free = v + step * weight @ (N * S.T @ tau_m - (Ct + Ft) @ v)
        for _ in range(60):
            previous = f.copy()
            for i in range(3):
                rate = S[i] @ (free - step * weight @ S.T @ f)
                f[i] = np.clip(f[i] + rate / (step * S[i] @ weight @ S[i]), -coulomb[i], coulomb[i])
            if np.abs(f - previous).max() < 1e-10:
                break
        v = free - step * weight @ S.T @ f
        x = x + step * v
    return x, v


def test_motion_is_that_of_an_independent_time_stepping_scheme() -> None:
    coulomb = np.array([1.64, 1.2, 0.9])
    pieces = [np.array([0.25, -0.1, -0.2]), np.array([-0.25, 0.15, 0.1]), np.array([0.05, 0.12, -0.1]), np.zeros(3)]
    machine = PlanarManipulatorMachine(THESIS, Friction(tuple(coulomb), tuple(coulomb)), lag=0.0)
    step = 1e-5
    for number, tau_m in enumerate(pieces):
        for axis in range(3):
            machine.set_torque_demand(axis, float(tau_m[axis]), number * 8 * MS)
    found = []
    for count in (1, 2, 3, 4):
        torque_at = [tau_m for tau_m in pieces[:count] for _ in range(800)]
        x, v = stepped(coulomb, torque_at, step)
        found.append((x, v))
    again = PlanarManipulatorMachine(THESIS, Friction(tuple(coulomb), tuple(coulomb)), lag=0.0)
    for number, (tau_m, (x, v)) in enumerate(zip(pieces, found, strict=True)):
        for axis in range(3):
            again.set_torque_demand(axis, float(tau_m[axis]), number * 8 * MS)
        again.advance((number + 1) * 8 * MS)
        assert again.position == pytest.approx(x, abs=2e-6)
        assert again.velocity == pytest.approx(v, abs=1e-3)
