"""What a person needs before any procedure: small moves and standing still, under low limits."""

import json

import pytest

from torquerig.cli import main


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
