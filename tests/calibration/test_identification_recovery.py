"""Identification on simulated machines whose truth is known: without a wire for the statistics."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from torquerig.calibration.excitations import FIT, VALIDATION
from torquerig.calibration.identification import LOPSIDED, UNKNOWNS, Recording, identify
from torquerig.control.estimators import make_estimator
from torquerig.control.laws import law_named
from torquerig.control.limits import Limits
from torquerig.control.log import LoopLog
from torquerig.control.loop import Controller, Pace, run_loop
from torquerig.control.reference import Piece, tabulate
from torquerig.device_sim.plant import Friction, PlanarManipulatorMachine
from torquerig.mechanism import HOME, Manipulator

THESIS = Manipulator.thesis()
TRUTH = np.array([0.0289, 0.8315, 0.0938, 1.64])
PERIOD_NS = 5_000_000
LAG = 1e-4
COUNTS = 8000 / math.tau
LIMITS = Limits(
    x=(0.05, 0.14),
    y=(0.03, 0.11),
    conditioning=0.05,
    singularity_distance=0.0,
    joint_speed=18.8,
    position_error=0.03,
    torque=0.98,
    torque_stop=5.0,
)


class Sample(NamedTuple):
    at_ns: int
    q: np.ndarray
    torque: np.ndarray
    complete: bool
    answered_ns: np.ndarray | None = None


class DirectJoints:
    """A machine with counting encoders and two torque slopes, its torques late by a fixed time; no wire."""

    def __init__(self, machine, delay_ns, lopsided):
        self.machine, self.delay_ns, self.lopsided, self.at_ns = machine, delay_ns, lopsided, 0
        self.offset = THESIS.inverse_kinematics(HOME).theta - np.floor(self.angles() * COUNTS) / COUNTS / 25.0
        self.pending = None

    def angles(self):
        return np.array([self.machine.motor_angle(axis, self.at_ns) for axis in range(3)])

    def now_ns(self):
        return self.at_ns

    def sample(self, due_ns):
        if self.pending is not None:
            at_ns, torques = self.pending
            for axis, torque in enumerate(torques):
                self.machine.set_torque_demand(axis, torque, at_ns)
        self.at_ns = max(self.at_ns, due_ns)
        q = np.floor(self.angles() * COUNTS) / COUNTS / 25.0 + self.offset
        return Sample(self.at_ns, q, np.zeros(3), True)

    def command(self, tau_m, due_ns):  # noqa: ARG002  (the protocol has it)
        counts = np.round(20100 * tau_m)
        self.pending = self.at_ns + self.delay_ns, (counts / 20100 / (1 - self.lopsided * np.sign(counts))).tolist()


def drive(motion, truth=TRUTH, lopsided=0.0, delay_ns=400_000):
    plant = replace(THESIS, actuator_inertia=truth[0], active_viscous=truth[1], passive_viscous=truth[2])
    machine = PlanarManipulatorMachine(plant, Friction.uniform(truth[3]), lag=LAG)
    law = law_named("computed-torque")(THESIS, 3000, 120, friction=True)
    controller = Controller(THESIS, make_estimator("backward-difference", axes=3), law, LIMITS)
    table = tabulate(THESIS, [Piece(motion, in_motion=True)], PERIOD_NS)
    log = LoopLog.for_table(table)
    joints = DirectJoints(machine, delay_ns, lopsided)
    run_loop(joints, controller, table, log, stopwatch_ns=lambda: 0, pace=Pace(0))
    delay = np.full(3, delay_ns * 1e-9 + LAG)
    return Recording(PERIOD_NS * 1e-9, log.q, log.tau, delay, np.ones(len(table), dtype=bool))


@pytest.fixture(scope="module")
def recordings():
    return drive(FIT, lopsided=-0.0284), drive(VALIDATION, lopsided=-0.0284)


def test_the_recommended_way_finds_all_four_within_a_percent_though_the_torque_scale_is_an_average(recordings):
    found = identify(THESIS, "recommended", *recordings)
    np.testing.assert_allclose([found.values[name] for name in UNKNOWNS], TRUTH, rtol=0.01)
    np.testing.assert_allclose([found.values[name] for name in LOPSIDED], -0.0284, atol=0.002)
    assert found.condition_number < 5
    assert found.validation.rmse < 0.005 * found.validation.torque


def test_the_thesis_way_is_far_off_and_foretells_another_motion_badly(recordings):
    found = identify(THESIS, "thesis", *recordings)
    assert found.values["I1"] > 1.3 * TRUTH[0]
    assert found.values["K1"] > 1.3 * TRUTH[1]
    assert found.validation.rmse > 0.2 * found.validation.torque


def test_the_smoothers_way_is_near(recordings):
    found = identify(THESIS, "smoothed", *recordings)
    np.testing.assert_allclose([found.values[name] for name in UNKNOWNS], TRUTH, rtol=0.05)


def test_a_sample_that_is_missing_spoils_only_the_windows_that_hold_it(recordings):
    fit, validation = recordings
    good = np.ones(len(fit.q), dtype=bool)
    good[[200, 420]] = False
    q, tau = fit.q.copy(), fit.tau_m.copy()
    q[[200, 420]] += 0.01
    tau[[200, 420]] = 0.0
    found = identify(THESIS, "recommended", replace(fit, q=q, tau_m=tau, good=good), validation)
    np.testing.assert_allclose([found.values[name] for name in UNKNOWNS], TRUTH, rtol=0.01)


def test_intervals_cover_the_truth_on_twenty_rigs():
    covered = []
    for seed in range(20):
        rng = np.random.default_rng(100 + seed)
        truth = TRUTH * rng.uniform(0.7, 1.3, 4)
        recording = drive(FIT, truth, rng.uniform(-0.03, 0.03), int(rng.uniform(2e5, 6e5)))
        found = identify(THESIS, "recommended", recording, recording)
        np.testing.assert_allclose([found.values[name] for name in UNKNOWNS], truth, rtol=0.01)
        covered += [low <= value <= high for value, (low, high) in zip(truth, found.intervals.values(), strict=False)]
    assert np.mean(covered) >= 0.9
