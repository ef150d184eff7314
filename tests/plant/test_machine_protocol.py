"""What every machine promises to the drives: times that only move forward, checked arguments, a truth log."""

from collections.abc import Callable

import numpy as np
import pytest

from torquerig.device_sim.machine import Machine
from torquerig.device_sim.plant import (
    BareRotor,
    ElasticManipulatorMachine,
    Friction,
    PlanarManipulatorMachine,
    RotorParameters,
    TruthLog,
)
from torquerig.mechanism import HOME, Manipulator

THESIS = Manipulator.thesis()
MS = 1_000_000


def planar(start_ns: int) -> Machine:
    return PlanarManipulatorMachine(THESIS, Friction.none(), start_ns=start_ns)


def rotors(start_ns: int) -> Machine:
    return BareRotor(RotorParameters(1e-5), axes=3, start_ns=start_ns)


def elastic(start_ns: int) -> Machine:
    return ElasticManipulatorMachine(THESIS, Friction.none(), 1e-3, start_ns=start_ns)


both = pytest.mark.parametrize("make", [planar, elastic, rotors])


@both
def test_time_only_moves_forward(make: Callable[[int], Machine]) -> None:
    machine = make(0)
    machine.motor_angle(0, 2 * MS)
    machine.motor_angle(1, 2 * MS)
    with pytest.raises(ValueError, match="time 1999999 ns has passed: the machine stands at 2000000 ns"):
        machine.motor_torque(0, 2 * MS - 1)
    with pytest.raises(ValueError, match="has passed"):
        machine.set_torque_demand(0, 0.1, 0)


@both
def test_time_may_start_anywhere(make: Callable[[int], Machine]) -> None:
    early, late = make(0), make(10**18)
    for machine, start in ((early, 0), (late, 10**18)):
        machine.set_torque_demand(1, 0.2, start + MS)
    assert late.motor_angle(1, 10**18 + 9 * MS) == early.motor_angle(1, 9 * MS)


@both
def test_axes_and_torques_are_checked(make: Callable[[int], Machine]) -> None:
    machine = make(0)
    assert machine.axes == 3
    for axis in (-1, 3):
        with pytest.raises(ValueError, match=f"axis is {axis}"):
            machine.motor_velocity(axis, 0)
    for torque in (float("nan"), float("inf")):
        with pytest.raises(ValueError, match=f"torque of axis 1 is {torque}"):
            machine.set_torque_demand(1, torque, 0)


@both
def test_answers_at_one_instant_agree(make: Callable[[int], Machine]) -> None:
    machine = make(0)
    machine.set_torque_demand(0, 0.3, 0)
    first = machine.motor_angle(0, 5 * MS), machine.motor_velocity(0, 5 * MS), machine.motor_torque(0, 5 * MS)
    machine.set_torque_demand(0, -0.3, 5 * MS)
    again = machine.motor_angle(0, 5 * MS), machine.motor_velocity(0, 5 * MS), machine.motor_torque(0, 5 * MS)
    assert first == again


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"lag": -1e-4}, "lag is"),
        ({"lag": float("nan")}, "lag is nan"),
        ({"step_ns": 0}, "step_ns is 0"),
        ({"step_ns": 100_001}, "step_ns is 100001"),
    ],
)
def test_integration_settings_out_of_range_are_named(options: dict[str, float], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        PlanarManipulatorMachine(THESIS, Friction.none(), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("coulomb", "breakaway", "complaint"),
    [
        ((-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), "coulomb of joint 1"),
        ((0.0, float("nan"), 0.0), (0.0, 0.0, 0.0), "coulomb of joint 2"),
        ((0.0, 0.0, 1.0), (0.0, 0.0, 0.5), "breakaway of joint 3"),
        ((0.0, 0.0, 1.0), (0.0, 0.0, float("inf")), "breakaway of joint 3"),
    ],
)
def test_friction_out_of_range_is_named(
    coulomb: tuple[float, float, float], breakaway: tuple[float, float, float], complaint: str
) -> None:
    with pytest.raises(ValueError, match=complaint):
        Friction(coulomb, breakaway)


def test_uniform_friction_holds_no_more_than_it_brakes_unless_told() -> None:
    assert Friction.uniform(1.5) == Friction((1.5,) * 3, (1.5,) * 3)
    assert Friction.uniform(1.5, 2.0) == Friction((1.5,) * 3, (2.0,) * 3)
    assert Friction.none() == Friction.uniform(0.0)


def test_log_has_a_row_for_every_instant_asked_about() -> None:
    log = TruthLog(capacity=2)
    machine = PlanarManipulatorMachine(THESIS, Friction.none(), log=log)
    machine.set_torque_demand(0, 0.2, MS)
    for at_ns in (2 * MS, 2 * MS, 5 * MS, 7 * MS):
        machine.motor_angle(0, at_ns)
        machine.motor_angle(1, at_ns)
    rows = log.rows()
    assert rows.at_ns.tolist() == [0, MS, 2 * MS, 5 * MS, 7 * MS]
    assert rows.position[0].tolist() == list(HOME)
    assert rows.position[-1].tolist() == machine.position.tolist()
    assert rows.velocity[-1].tolist() == machine.velocity.tolist()
    assert rows.theta[-1, 2] * THESIS.gear_ratio == machine.motor_angle(2, 7 * MS)
    assert rows.motor_torque[-1].tolist() == [machine.motor_torque(axis, 7 * MS) for axis in range(3)]


def test_log_on_a_grid_has_the_grids_instants_only() -> None:
    log = TruthLog(grid_ns=MS)
    machine = PlanarManipulatorMachine(THESIS, Friction.none(), start_ns=300_000, log=log)
    machine.set_torque_demand(0, 0.2, 1_500_000)
    machine.motor_angle(0, 4_200_000)
    machine.motor_angle(0, 5_000_000)
    rows = log.rows()
    assert rows.at_ns.tolist() == [300_000, MS, 2 * MS, 3 * MS, 4 * MS, 5 * MS]
    assert rows.motor_torque[1].tolist() == [0.0, 0.0, 0.0]
    assert rows.motor_torque[2, 0] == pytest.approx(0.2 * -np.expm1(-5.0), rel=1e-12)


def test_logging_on_a_grid_hardly_changes_the_motion() -> None:
    plain = PlanarManipulatorMachine(THESIS, Friction.uniform(1.0))
    logged = PlanarManipulatorMachine(THESIS, Friction.uniform(1.0), log=TruthLog(grid_ns=333_333))
    for machine in (plain, logged):
        for axis, torque in enumerate((0.3, -0.2, -0.2)):
            machine.set_torque_demand(axis, torque, 0)
        machine.advance(20 * MS)
    assert logged.position == pytest.approx(plain.position, abs=1e-11)


def test_taken_rows_are_forgotten() -> None:
    log = TruthLog()
    machine = PlanarManipulatorMachine(THESIS, Friction.none(), log=log)
    machine.advance(MS)
    assert log.take().at_ns.tolist() == [0, MS]
    machine.advance(2 * MS)
    assert len(log) == 1
    assert log.take().at_ns.tolist() == [2 * MS]
    assert len(log.rows().at_ns) == 0


def test_a_log_grid_must_be_positive() -> None:
    with pytest.raises(ValueError, match="grid_ns is 0"):
        TruthLog(grid_ns=0)
