"""What a person needs before any procedure: small moves and standing still, under low limits."""

import json
from contextlib import contextmanager
from dataclasses import replace

import pytest

from torquerig.assembly import open_rig
from torquerig.calibrating.conducting import perform
from torquerig.calibrating.moving import JOG
from torquerig.calibrating.offer import Request
from torquerig.calibrating.task import Task
from torquerig.calibration.errors import WrongWay
from torquerig.calibration.guard import Room
from torquerig.calibration.procedure import Unwatched
from torquerig.cli import main
from torquerig.configuration import load_configuration
from torquerig.control.errors import LimitExceeded


def told(capsys, *arguments: str) -> dict:
    assert main(arguments) == 0
    return json.loads(capsys.readouterr().out)


def test_jog_moves_the_end_effector_by_what_was_asked(capsys):
    went = told(capsys, "jog", "--x", "4", "--y", "-2", "--plant", "ideal", "--hold", "0.5", "--json")
    assert went["moved_mm"] == pytest.approx([4.0, -2.0], abs=0.1)


def test_jog_turns_one_joint_and_lets_the_others_follow(capsys):
    went = told(capsys, "jog", "--axis", "2", "--by", "-3", "--plant", "ideal", "--hold", "0.5", "--json")
    assert went["turned_deg"][1] == pytest.approx(-3.0, abs=0.05)
    assert went["peak_torque_nm"] <= 0.2


def test_hold_stays_under_its_torque(capsys):
    stayed = told(capsys, "hold", "--seconds", "0.2", "--torque", "0.1", "--json")
    assert stayed["away_deg"] < 0.1
    assert stayed["peak_torque_nm"] <= 0.1


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["jog"], "jog either a joint"),
        (["jog", "--axis", "1"], "jog either a joint"),
        (["jog", "--axis", "1", "--by", "2", "--x", "1"], "jog either a joint"),
        (["jog", "--axis", "1", "--by", "90"], "at most 10°"),
        (["jog", "--x", "50"], "at most 20 mm"),
        (["jog", "--x", "5", "--torque", "3"], "--torque 3 N·m cannot be"),
        (["hold"], "say how long with --seconds"),
        (["hold", "--seconds", "-1"], "--seconds -1 cannot be"),
    ],
)
def test_a_bad_request_is_one_sentence(capsys, arguments, sentence):
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert sentence in printed.err
    assert printed.err.count("\n") == 1


@pytest.mark.parametrize("fault", [("torque_sign",), ("encoder_sign",), ("torque_sign", "encoder_sign")])
@pytest.mark.parametrize("axis", range(3))
def test_a_reversed_axis_ends_a_jog_at_zero_torque_and_sends_to_direction(capsys, tmp_path, axis, fault):
    signs = [-1 if each == axis else 1 for each in range(3)]
    config = tmp_path / "fault.toml"
    config.write_text("[simulator.installation]\n" + "".join(f"{name} = {signs}\n" for name in fault))
    arguments = ["jog", "--x", "4", "--y", "-2", "--config", str(config), "--json"]
    code = main(arguments)
    printed = capsys.readouterr()
    # against the others' torque a motor that pushes the wrong way keeps the machine from getting there
    assert code == 4 or "torquerig calibrate direction" in json.loads(printed.out)["notes"][-1]
    if code:
        assert "run torquerig calibrate direction" in printed.err
        assert printed.err.count("\n") == 1
        assert printed.out == ""


def test_the_reversed_axis_is_named_and_its_drive_has_no_torque():
    signs = {"simulator.installation.encoder_sign": [1, -1, 1]}
    request = Request(None, {"by": None, "x": 4.0, "y": -2.0, "hold": 0.2, "torque": 0.2})
    task = Task.prepare("jog", JOG, load_configuration(options=signs), request)
    rigs = []

    @contextmanager
    def watched(configuration, tap=None):
        with open_rig(configuration, tap) as rig:
            rigs.append(rig)
            yield rig

    watched_task = replace(task, offer=replace(task.offer, open_rig=watched))
    with pytest.raises(WrongWay, match="axis 2 moves against the order: an axis is reversed"):
        perform(watched_task, Unwatched())
    drives = rigs[0].simulation.devices.nodes
    assert [drives[number].torque_demand for number in (1, 2, 3)] == [0.0] * 3


@pytest.mark.parametrize(("way", "words"), [(("19", "0"), "x"), (("0", "-19"), "y")])
def test_a_jog_keeps_to_the_workspace(capsys, tmp_path, way, words):
    config = tmp_path / "tight.toml"
    config.write_text("[limits]\nworkspace_x = [0.085, 0.105]\nworkspace_y = [0.050, 0.072]\n")
    assert main(["jog", "--x", way[0], "--y", way[1], "--config", str(config)]) == 4
    assert f"workspace limit: {words} at " in capsys.readouterr().err


def test_a_machine_that_stands_outside_may_be_jogged_back():
    room = Room((0.085, 0.105), (0.050, 0.072))
    outside = room.outside((0.110, 0.060))
    assert outside == pytest.approx(0.005)
    room.require((0.108, 0.060), outside)
    with pytest.raises(LimitExceeded, match=r"workspace limit: x at 0\.112 m"):
        room.require((0.112, 0.060), outside)
