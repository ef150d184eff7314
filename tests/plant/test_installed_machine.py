"""A machine behind an installation with mistakes: what drives turn, and what their encoders show."""

import pytest

from torquerig.device_sim.plant.installation import Installation, InstalledMachine
from torquerig.device_sim.plant.rotor import BareRotor, RotorParameters

MS = 1_000_000


def rotors() -> BareRotor:
    """Three free rotors of 1e-3 kg·m² each, without lag."""
    return BareRotor(RotorParameters(inertia=1e-3, viscous=0.0, coulomb=0.0, breakaway=0.0, lag=0.0), axes=3)


def turned(installation: Installation, axis: int = 0, torque: float = 0.1) -> list[float]:
    """What each axis' encoder shows 10 ms after one axis was given a torque."""
    machine = InstalledMachine(rotors(), installation)
    machine.set_torque_demand(axis, torque, 0)
    return [machine.motor_angle(each, 10 * MS) for each in range(3)]


WAY = 0.1 / 1e-3 * 0.01**2 / 2


def test_a_right_installation_shows_the_machine_itself():
    assert turned(Installation()) == pytest.approx([WAY, 0.0, 0.0])


def test_exchanged_leads_turn_the_motor_the_other_way():
    assert turned(Installation(torque_sign=(-1.0, 1.0, 1.0))) == pytest.approx([-WAY, 0.0, 0.0])


def test_an_exchanged_encoder_shows_the_other_way():
    assert turned(Installation(encoder_sign=(-1.0, 1.0, 1.0))) == pytest.approx([-WAY, 0.0, 0.0])


def test_swapped_motors_turn_another_leg():
    assert turned(Installation(motors=(1, 0, 2))) == pytest.approx([0.0, WAY, 0.0])


def test_swapped_encoders_show_another_leg():
    assert turned(Installation(encoders=(2, 1, 0))) == pytest.approx([0.0, 0.0, WAY])


def test_a_larger_gear_gives_more_torque_and_shows_more_turns():
    assert turned(Installation(gear_factor=(2.0, 1.0, 1.0))) == pytest.approx([4 * WAY, 0.0, 0.0])


def test_a_coupling_passes_on_no_more_than_it_holds_and_the_rotor_spins():
    installation = Installation(coupling=(0.05, 9.0, 9.0))
    machine = InstalledMachine(rotors(), installation)
    machine.set_torque_demand(0, 0.1, 0)
    joint = 0.05 / 1e-3 * 0.01**2 / 2
    slip = 0.05 / 0.098e-4 * 0.01**2 / 2
    assert machine.motor_angle(0, 10 * MS) == pytest.approx(joint + slip)
    assert machine.motor_torque(0, 10 * MS) == pytest.approx(0.1)


def test_a_slipping_rotor_comes_to_rest_when_its_torque_ends():
    machine = InstalledMachine(rotors(), Installation(coupling=(0.05, 9.0, 9.0)))
    machine.set_torque_demand(0, 0.1, 0)
    machine.set_torque_demand(0, 0.0, 10 * MS)
    # braked by the coupling's 0.05 N·m as it was driven: at rest after 10 ms more, and the joint was dragged on
    fast = machine.motor_velocity(0, 10 * MS)
    assert machine.motor_velocity(0, 30 * MS) < 0.1 * fast
    assert machine.motor_torque(0, 30 * MS) == 0.0


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        ({"motors": (0, 0, 2)}, "each of 0, 1 and 2"),
        ({"torque_sign": (0.0, 1.0, 1.0)}, "must be -1 or 1"),
        ({"gear_factor": (0.0, 1.0, 1.0)}, "gear_factor"),
        ({"coupling": (-1.0, 1.0, 1.0)}, "coupling"),
    ],
)
def test_an_impossible_installation_is_refused(mistake, words):
    with pytest.raises(ValueError, match=words):
        Installation(**mistake)


def test_an_installation_knows_whether_it_shows():
    assert not Installation(coupling=(1.0, 1.0, 1.0)).shows(0.5)
    assert Installation(coupling=(0.1, 1.0, 1.0)).shows(0.5)
    assert Installation(encoder_sign=(1.0, -1.0, 1.0)).shows(0.5)
