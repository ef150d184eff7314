"""What is put around a law: asked for a later instant, and with Coulomb friction; and what each does to tracking."""

import numpy as np
import pytest

from torquerig.configuration import load_configuration
from torquerig.control.compensation import NOTHING, Compensation
from torquerig.control.law import Desired, State
from torquerig.control.motions import Hold, SmoothMove
from torquerig.control.reference import Piece, tabulate
from torquerig.delays import compensation, lead
from torquerig.experiment import run_experiment
from torquerig.mechanism import HOME, Manipulator

MODEL = Manipulator.thesis()
PERIOD_NS = 4_000_000
START, END = (float(HOME[0]), float(HOME[1])), (float(HOME[0]) + 0.01, float(HOME[1]) + 0.005)
MOVE = SmoothMove.within(START, END, speed=0.1, acceleration=2.0)
TABLE = tabulate(MODEL, [Piece(Hold(START, 0.02)), Piece(MOVE, in_motion=True), Piece(Hold(END, 0.02))], PERIOD_NS)


def test_without_a_lead_nothing_is_worked_out_and_the_law_is_the_law_itself():
    def law(_state: State, _desired: Desired) -> np.ndarray:
        return np.zeros(3)

    assert NOTHING.ahead(MODEL, TABLE) is None
    assert NOTHING.around(law) is law


@pytest.mark.parametrize("lead_s", [0.0013, 0.004, 0.0061])
def test_the_rows_ahead_are_those_of_the_motion_so_much_later(lead_s):
    breaths = []
    asked = Compensation(lead=lead_s).ahead(MODEL, TABLE, lambda: breaths.append(None))
    assert len(asked) == len(TABLE)
    assert breaths
    inside = np.flatnonzero(TABLE.in_motion)
    for row in inside[2:-3]:
        wanted = MOVE.at((row - inside[0]) * PERIOD_NS * 1e-9 + lead_s)
        np.testing.assert_allclose(asked.position[row], wanted.position, atol=2e-8)
        np.testing.assert_allclose(asked.velocity[row], wanted.velocity, atol=3e-5)
        np.testing.assert_allclose(asked.acceleration[row], wanted.acceleration, atol=0.05)
    np.testing.assert_allclose(asked.position[-1], END, atol=1e-12)


def test_errors_stay_what_they_are_when_the_law_is_asked_for_a_later_instant():
    now, later = TABLE.row(8), TABLE.row(9)
    state = State(now.q + 0.01, now.qd - 0.2, now.position + 1e-3, now.velocity + 0.05)
    expected, asked = Compensation.later(state, now, later)
    assert asked is later
    for name in ("q", "qd", "position", "velocity"):
        error = getattr(state, name) - getattr(now, name)
        np.testing.assert_allclose(getattr(expected, name) - getattr(later, name), error, atol=1e-12)


def test_coulomb_friction_is_fed_forward_in_the_direction_of_each_desired_rate():
    torque = Compensation(coulomb=0.06).around(lambda _state, _desired: np.array([0.1, 0.2, 0.3]))
    nothing, rates = np.zeros(2), np.array([-0.4, 0.0, 2.0])
    desired = Desired(nothing, nothing, nothing, np.zeros(3), rates)
    np.testing.assert_allclose(torque(State(rates, rates, nothing, nothing), desired), [0.04, 0.2, 0.36])


def test_the_lead_is_what_latency_found_and_when_commands_leave():
    rig = load_configuration(options={"loop.command_after": 1.0}).rig
    wire = 1e-6 * (2 * 95 - 55)  # commands of 95 bits, the second in the mean; latched at the end of a SYNC of 55
    assert lead(rig) == pytest.approx(1e-3 + wire + 50e-6 + 100e-6)
    slow = load_configuration(options={"loop.command_after": 1.0, "latency.reaction": 1.05e-3}).rig
    assert lead(slow) - lead(rig) == pytest.approx(1e-3)
    at_sync = load_configuration(options={"loop.rpdo_type": 1}).rig
    assert lead(at_sync) == pytest.approx(4e-3 + 50e-6 + 100e-6)


@pytest.mark.parametrize(("law", "coulomb"), [("computed-torque", 0.08), ("coupled-pd", 0.0)])
def test_coulomb_friction_goes_with_viscous_friction(law, coulomb):
    options = {"loop.law": law, "model.active_coulomb": 2.0, "loop.coulomb_feedforward": True}
    assert compensation(load_configuration(options=options).rig) == Compensation(coulomb=coulomb)
    del options["loop.coulomb_feedforward"]
    assert compensation(load_configuration(options=options).rig) == NOTHING


def error_mm(**options) -> float:
    """RMSE of a run whose drives take 1.2 ms to react, which the controller may know."""
    slow = {"drive.reaction": 1.2e-3, "loop.command_after": 1.5}
    return run_experiment(load_configuration(options=slow | options)).summary.position_rmse_mm


def test_known_delays_and_known_friction_each_track_better():
    plain = error_mm()
    friction = {"model.active_coulomb": 1.64, "loop.coulomb_feedforward": True}
    with_friction = error_mm(**friction)
    unknown = error_mm(**friction, **{"loop.delay_compensation": True})
    known = error_mm(**friction, **{"loop.delay_compensation": True, "latency.reaction": 1.2e-3})
    assert with_friction < 0.6 * plain
    assert unknown < with_friction
    assert known < 0.95 * unknown
