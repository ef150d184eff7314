"""What a file may change in a reproduction, and what stays the thesis'."""

import pytest

from torquerig.building import controller, gains
from torquerig.planning import plan_motion
from torquerig.reproduction.experiments import PlantRuns, Run, planned
from torquerig.reproduction.report import render
from torquerig.reproduction.settings import departures
from torquerig.reproduction.tables import as_json, report_on

FILE = """
[approach]
hold_before = 0.0
hold_after = 0.0
[motion.1]
speed = 0.2
[laws.coupled-pd.motion1]
kp = 1.0
[loop]
rate_hz = 500.0
gains = 2
group_rpdo = true
estimator = "kalman"
[model]
passive_viscous = 0.0938
active_viscous = 0.9
"""


@pytest.fixture
def mine(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(FILE)
    return path


def test_motions_gains_and_holds_are_the_thesis_whatever_a_file_says(mine):
    for ours, shipped in zip(planned(["fitted"], mine), planned(["fitted"]), strict=True):
        rig, default = ours.configuration.rig, shipped.configuration.rig
        assert rig.motion == default.motion
        assert (rig.approach.hold_before, rig.approach.hold_after) == (0.1, 0.1)
        assert gains(rig) == gains(default)


def test_the_rows_beside_the_motion_are_there_whatever_a_file_says(mine):
    rig = planned(["fitted"], mine)[0].configuration.rig
    table = plan_motion(rig, controller(rig))
    assert not table.in_motion[[0, -1, -2]].any()


def test_what_differs_from_the_shipped_settings_is_listed(mine):
    changed, put_aside = departures(mine)
    assert {each.key: (each.value, each.default) for each in changed} == {
        "loop.estimator": ("kalman", "backward-difference"),
        "model.active_viscous": (0.9, 0.8315),
    }
    assert {each.key for each in put_aside} == {
        "approach.hold_before", "approach.hold_after", "motion.1.speed", "laws.coupled-pd.motion1.kp",
        "loop.rate_hz", "loop.gains", "loop.group_rpdo",
    }  # fmt: skip


def test_drives_tell_their_torque_in_every_cycle_whatever_a_file_says(mine):
    assert not any(each.configuration.rig.loop.group_rpdo for each in planned(["fitted"], mine))


def test_without_a_file_nothing_differs():
    assert departures(None) == ((), ())


def test_json_and_report_say_what_differs_and_what_is_put_aside(mine):
    departed = departures(mine)
    told = as_json((), departed)
    assert {each["key"] for each in told["changed_settings"]} == {"loop.estimator", "model.active_viscous"}
    assert "motion.1.speed" in {each["key"] for each in told["settings_put_aside"]}
    stopped = tuple(Run(experiment, None, "position error limit") for experiment in planned(["fitted"], mine))
    page = render(report_on([PlantRuns("fitted", stopped)]), departed, [])
    assert "<code>model.active_viscous = 0.9</code> (shipped: 0.8315)" in page
    assert "<code>motion.1.speed = 0.2</code>" in page
    assert "no typical factor, 0 of 16 numbers are there" in page
