"""Locked rotors: motors that cannot turn, and friction that keeps a part of their torque from the transducer."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.device_sim.plant.locked import LockedRotors, LockParameters
from torquerig.device_sim.plant.rotor import BareRotor, RotorParameters

MS = 1_000_000
FRICTION = 0.02


def bench(friction=FRICTION, lag=0.0, locked=(0,)):
    return LockedRotors(BareRotor(RotorParameters(1e-5), axes=3), locked, LockParameters(friction, lag))


def test_a_locked_rotor_does_not_turn_and_gives_its_torque():
    machine = bench()
    machine.set_torque_demand(0, 0.4, 0)
    assert machine.motor_torque(0, MS) == 0.4
    assert (machine.motor_angle(0, MS), machine.motor_velocity(0, MS)) == (0.0, 0.0)


def test_the_others_turn():
    machine = bench()
    machine.set_torque_demand(1, 0.1, 0)
    assert machine.motor_velocity(1, 10 * MS) > 1.0


def test_the_transducer_feels_the_torque_less_friction_on_the_way_up_and_more_on_the_way_down():
    machine = bench()
    felt = []
    for n, torque in enumerate((0.1, 0.2, 0.3, 0.2, 0.1)):
        machine.set_torque_demand(0, torque, n * MS)
        felt.append(machine.shaft_torque(n * MS))
    assert felt == pytest.approx([0.08, 0.18, 0.28, 0.22, 0.12])


def test_within_the_play_of_friction_the_transducer_feels_no_change():
    machine = bench()
    machine.set_torque_demand(0, 0.3, 0)
    top = machine.shaft_torque(0)
    machine.set_torque_demand(0, 0.3 - 1.9 * FRICTION, MS)
    assert machine.shaft_torque(MS) == top


def test_the_current_loop_lags():
    machine = bench(friction=0.0, lag=1e-3)
    machine.set_torque_demand(0, 1.0, 0)
    assert machine.shaft_torque(MS) == pytest.approx(1.0 - 2.718281828**-1)


def test_of_several_locked_shafts_the_transducer_feels_the_sum():
    machine = bench(friction=0.0, locked=(0, 2))
    machine.set_torque_demand(0, 0.1, 0)
    machine.set_torque_demand(2, 0.2, 0)
    assert machine.shaft_torque(0) == pytest.approx(0.3)


@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=20))
def test_the_shaft_never_differs_by_more_than_friction(torques):
    machine = bench()
    for n, torque in enumerate(torques):
        machine.set_torque_demand(0, torque, n * MS)
        assert abs(machine.shaft_torque(n * MS) - torque) <= FRICTION + 1e-15


def test_time_does_not_go_back():
    machine = bench()
    machine.shaft_torque(MS)
    with pytest.raises(ValueError, match="has passed"):
        machine.shaft_torque(MS - 1)


@pytest.mark.parametrize("values", [{"friction": -1.0}, {"lag": float("nan")}])
def test_impossible_locks_are_refused(values):
    with pytest.raises(ValueError, match="must be finite and not below 0"):
        LockParameters(**values)


def test_an_axis_that_is_not_there_cannot_be_locked():
    with pytest.raises(ValueError, match="axes 0 to 2"):
        bench(locked=(3,))
