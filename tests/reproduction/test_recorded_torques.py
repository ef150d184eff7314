"""The model is judged on the motion that was measured, with the torque that acted while the machine was there."""

from dataclasses import replace

import numpy as np
import pytest

from torquerig.building import controller
from torquerig.control.log import LoopLog
from torquerig.planning import plan_motion
from torquerig.reproduction.experiments import THESIS_LAWS, planned
from torquerig.reproduction.findings import _contrast
from torquerig.reproduction.torques import at_constant_velocity, true_torque
from torquerig.torque_parts import measured_components, motion_part, recorded_torque


def followed(late, *, error_at_constant, error_elsewhere):
    """The model, and logs of machines that follow `late` samples behind; the model misses shares of their torques."""
    rig = planned(["fitted"])[0].configuration.rig
    working = controller(rig)
    log = LoopLog.for_table(plan_motion(rig, working))
    log.rows = len(log.due_ns)
    log.position[:] = np.roll(log.desired_position, late, axis=0)
    model = working.model
    part = motion_part(log)
    share = np.where(at_constant_velocity(log), error_at_constant, error_elsewhere)[:, None]
    log.tau_actual[part] = measured_components(model, log).total / (1.0 - share)
    return model, {law: replace(log) for law in THESIS_LAWS}


@pytest.mark.parametrize("late", [0, 1, 3])
def test_a_machine_that_follows_late_is_no_error_of_the_model(late):
    model, logs = followed(late, error_at_constant=0.1, error_elsewhere=0.2)
    found = _contrast(model, 1, logs)
    assert found.number == pytest.approx(0.5)
    assert found.verdict == "not reproduced"


@pytest.mark.parametrize("late", [0, 1, 3])
def test_a_model_that_misses_more_at_constant_velocity_is_told_so(late):
    model, logs = followed(late, error_at_constant=0.3, error_elsewhere=0.1)
    assert _contrast(model, 1, logs).number == pytest.approx(3.0)


def test_position_and_torque_of_one_instant_stand_in_one_row():
    _, logs = followed(0, error_at_constant=0.0, error_elsewhere=0.0)
    log = logs["coupled-pd"]
    log.tau_actual[:, 0] = np.arange(log.rows)
    rows = np.flatnonzero(log.in_motion)
    assert recorded_torque(log)[:, 0].tolist() == [*rows, rows[-1] + 1]


def test_a_torque_in_truth_is_not_told_of_drives_of_another_make():
    configuration = planned(["fitted"])[0].configuration
    other = configuration.rig.axes.legs[1].model_copy(update={"profile": "cia402"})
    axes = configuration.rig.axes.model_copy(update={"leg2": other})
    changed = replace(configuration, rig=configuration.rig.model_copy(update={"axes": axes}))
    assert changed.rig.axes.legs[1].profile == "cia402"
    assert true_torque(changed, np.ones((1, 3))) is None


def test_a_torque_in_truth_is_by_the_gain_of_its_direction():
    configuration = planned(["fitted"])[0].configuration
    counted = np.array([[0.508, -0.48, 0.0]])
    assert true_torque(configuration, counted)[0] == pytest.approx(
        [0.508 * 20100 / 20670, -0.48 * 20100 / 19528, 0.0], rel=1e-9
    )
