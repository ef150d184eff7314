"""A law that strains the machine along the null space of S'.

S'tau = 0 holds where the direction was computed; a held torque is felt a little once the machine has moved on.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from torquerig.control import LoopLog, Surroundings, experiment_table, law_named, run_loop, thesis_motion
from torquerig.mechanism import HOME
from torquerig.mechanism.distribution import preload_direction

PRELOAD = 0.15
AugmentedPD = law_named("augmented-pd")


@dataclass(frozen=True, slots=True)
class Preloaded(AugmentedPD):
    """Its preload's direction is that of the place where the machine will be `lead` seconds later."""

    lead: float = 0.0

    def torque(self, state, desired):
        ahead = state.position + self.lead * state.velocity
        return AugmentedPD.torque(self, state, desired) + PRELOAD * preload_direction(self.model, ahead)


@pytest.fixture
def run(model, machine, controller, stopwatch):
    """Runs the fast motion on a frictionless machine with exact encoders, and gives the log."""

    def drive(law, period_ns):
        around = Surroundings(speed=0.05, acceleration=0.5, before=0.02, after=0.02)
        table = experiment_table(model, thesis_motion(2), stands_at=HOME, repeats=1, period_ns=period_ns, around=around)
        fresh = type(machine)(model, answer_ns=200_000)
        log = LoopLog.for_table(table)
        return run_loop(fresh, controller(law), table, log, stopwatch_ns=stopwatch)

    return drive


@pytest.fixture
def moved(run, model):
    """How far preload moves the machine at most, and what the plain law errs at most [m]."""

    def compare(period_ns, lead=0.0):
        plain = run(AugmentedPD.for_motion(model, 2), period_ns)
        strained = run(Preloaded(model, *AugmentedPD.gains[2], friction=True, lead=lead), period_ns)
        assert np.linalg.norm(strained.tau - plain.tau, axis=1).max() > 0.9 * PRELOAD
        errors = np.abs(plain.position - plain.desired_position).max()
        return np.abs(strained.position - plain.position).max(), errors

    return compare


def test_what_preload_moves_vanishes_with_the_period(moved):
    slow, error = moved(4_000_000)
    fast, _ = moved(500_000)
    assert slow < 0.1 * error
    assert fast < slow / 4  # the hold is 4 ms and 0.5 ms long, after 0.2 ms in both


def test_a_direction_taken_at_the_middle_of_the_hold_moves_the_machine_less(moved):
    plain, _ = moved(4_000_000)
    led, _ = moved(4_000_000, lead=0.2e-3 + 2e-3)
    assert led < plain / 3
