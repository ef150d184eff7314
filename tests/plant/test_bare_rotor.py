"""Bare rotors: exact under Coulomb friction, exponential under viscous friction, at rest until torque breaks away."""

from typing import Any

import numpy as np
import pytest

from torquerig.device_sim.plant import BareRotor, RotorParameters

J = 1e-5
MS = 1_000_000


def rotor(**parameters: Any) -> BareRotor:
    return BareRotor(RotorParameters(J, **({"lag": 0.0} | parameters)))


def test_coulomb_deceleration_is_exact_to_the_standstill_and_beyond() -> None:
    machine = rotor(coulomb=0.01, breakaway=0.01)
    machine.set_torque_demand(0, 0.05, 0)
    assert machine.motor_velocity(0, 10 * MS) == pytest.approx(40.0, rel=1e-12)
    machine.set_torque_demand(0, 0.0, 10 * MS)
    for at_ms in (12, 20, 33, 49):
        coasting = (at_ms - 10) * 1e-3
        assert machine.motor_velocity(0, at_ms * MS) == pytest.approx(40.0 - 1000.0 * coasting, rel=1e-11)
        assert machine.motor_angle(0, at_ms * MS) == pytest.approx(
            0.2 + 40.0 * coasting - 500.0 * coasting**2, rel=1e-11
        )
    assert machine.motor_velocity(0, 50 * MS + 1) == 0.0
    rest = machine.motor_angle(0, 50 * MS + 1)
    assert rest == pytest.approx(1.0, rel=1e-11)
    assert machine.motor_angle(0, 5_000 * MS) == rest


def test_viscous_rotor_approaches_its_speed_exponentially() -> None:
    machine = rotor(viscous=1e-3)
    machine.set_torque_demand(0, 0.02, 0)
    for at_ms in (1, 5, 20):
        expected = 20.0 * -np.expm1(-at_ms * 1e-3 * 1e-3 / J)
        assert machine.motor_velocity(0, at_ms * MS) == pytest.approx(expected, rel=1e-9)


def test_current_lag_delays_the_rotor_by_its_time_constant() -> None:
    machine = rotor(lag=1e-4)
    machine.set_torque_demand(0, 0.01, 0)
    late = (5e-3 - 1e-4 * -np.expm1(-50.0)) * 1000.0
    assert machine.motor_velocity(0, 5 * MS) == pytest.approx(late, rel=1e-6)
    assert machine.motor_torque(0, 5 * MS) == pytest.approx(0.01 * -np.expm1(-50.0), rel=1e-12)


@pytest.mark.parametrize("lag", [0.0, 1e-4])
def test_rotor_rests_up_to_breakaway_and_turns_beyond_it(lag: float) -> None:
    machine = rotor(coulomb=0.01, breakaway=0.02, lag=lag)
    machine.set_torque_demand(0, 0.01999, 0)
    assert machine.motor_angle(0, 100 * MS) == 0.0
    machine.set_torque_demand(0, 0.02001, 100 * MS)
    turning = machine.motor_velocity(0, 110 * MS)
    assert turning > 0.0
    machine.set_torque_demand(0, 0.015, 110 * MS)  # below breakaway, above Coulomb: it goes on gathering speed
    assert machine.motor_velocity(0, 120 * MS) > turning


def test_rotor_reverses_through_zero() -> None:
    machine = rotor(coulomb=0.01, breakaway=0.01)
    machine.set_torque_demand(0, 0.05, 0)
    machine.set_torque_demand(0, -0.05, 10 * MS)
    stop = 10e-3 + 40.0 / 6000.0
    expected = -4000.0 * (30e-3 - stop)
    assert machine.motor_velocity(0, 30 * MS) == pytest.approx(expected, rel=1e-11)


def test_rotors_turn_independently() -> None:
    machine = BareRotor(RotorParameters(J, lag=0.0), axes=3)
    machine.set_torque_demand(1, 0.01, 0)
    assert [machine.motor_velocity(axis, 2 * MS) for axis in range(3)] == pytest.approx([0.0, 2.0, 0.0], rel=1e-12)
    assert machine.position.shape == machine.velocity.shape == (3,)


@pytest.mark.parametrize(
    ("parameters", "complaint"),
    [
        ({"inertia": 0.0}, "inertia is 0.0"),
        ({"inertia": J, "viscous": -1.0}, "viscous is -1.0"),
        ({"inertia": J, "coulomb": 0.2, "breakaway": 0.1}, "breakaway is 0.1"),
        ({"inertia": J, "lag": float("nan")}, "lag is nan"),
    ],
)
def test_rotor_parameters_out_of_range_are_named(parameters: dict[str, float], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        RotorParameters(**parameters)


def test_no_rotor_is_no_machine() -> None:
    with pytest.raises(ValueError, match="axes is 0"):
        BareRotor(RotorParameters(J), axes=0)
