"""The reference of a run: what is planned beforehand and what is planned in slices make one."""

import numpy as np
import pytest

from torquerig import building
from torquerig.configuration import load_configuration
from torquerig.control.errors import LimitExceeded
from torquerig.control.motions import OutAndBack
from torquerig.control.profile import TrapezoidalAcceleration
from torquerig.control.reference import Surroundings, experiment_table
from torquerig.planning import SLICE, join, plan_approach, plan_motion

FIELDS = ("position", "velocity", "acceleration", "q", "qd", "in_motion")


def planned(rig, stands_at):
    breaths: list[int] = []
    controller = building.controller(rig)
    motion = plan_motion(rig, controller)
    approach = plan_approach(rig, controller, stands_at, tuple(motion.position[0]), lambda: breaths.append(1))
    return join([*approach, motion]), len(breaths)


@pytest.mark.parametrize("stands_at", [(0.092, 0.062), (0.0925, 0.0615), (0.11, 0.08)])
def test_slices_make_the_same_reference_as_one_table(stands_at):
    rig = load_configuration(options={"loop.repeat": 2}).rig
    table, _ = planned(rig, stands_at)
    motion, around = rig.motion.motion1, rig.approach
    whole = experiment_table(
        building.controller(rig).model,
        OutAndBack(
            rig.model.home, TrapezoidalAcceleration(motion.stroke, motion.speed, motion.acceleration, motion.tj)
        ),
        stands_at=stands_at,
        repeats=2,
        period_ns=building.period_ns(rig),
        around=Surroundings(around.speed, around.acceleration, around.hold_before, around.hold_after),
    )
    for name in FIELDS:
        np.testing.assert_allclose(getattr(table, name), getattr(whole, name), rtol=0, atol=1e-9, err_msg=name)


def test_the_bus_is_served_after_every_slice():
    table, breaths = planned(load_configuration(options={"loop.rate_hz": 1000.0}).rig, (0.11, 0.08))
    assert breaths > (len(table) - table.in_motion.sum() - 201) // SLICE


def test_only_the_motions_samples_count():
    table, _ = planned(load_configuration().rig, (0.1, 0.07))
    assert table.in_motion.sum() == 50


def test_an_approach_from_outside_the_workspace_is_refused():
    rig = load_configuration().rig
    with pytest.raises(LimitExceeded, match="workspace limit: x"):
        plan_approach(rig, building.controller(rig), (0.135, 0.062), rig.model.home, breathe=lambda: None)
