"""The command line, called in this process: what it prints, what it refuses, how it exits."""

import json
import tomllib
from pathlib import Path

import pytest

from torquerig.cli import main
from torquerig.cli.app import COMMANDS


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    return tmp_path


def complaint(capsys, *arguments: str) -> tuple[int, str]:
    """The exit code and the one sentence on standard error."""
    code = main(arguments)
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1, printed.err
    assert printed.err.startswith("torquerig: ")
    return code, printed.err


def test_help_names_every_command_and_exit_code(capsys):
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    assert all(f"\n  {name} " in text for name in COMMANDS)
    assert all(f"\n    {code} " in text for code in (0, 1, 2, 3, 4, 130, 143))


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(capsys, command):
    assert main([command, "--help"]) == 0
    assert capsys.readouterr().out.startswith(f"Usage: torquerig {command}")


def test_run_prints_one_json_object_and_nothing_else(capsys, elsewhere):
    assert main(["run", "--json"]) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["law"] == "computed-torque"
    assert printed.out.count("\n") == 1
    assert printed.err == ""
    assert list(elsewhere.iterdir()) == []


def test_run_shows_the_thesis_row_and_says_where_the_picture_is(capsys, elsewhere):
    assert main(["run", "--law", "coupled-pd", "--motion", "2", "--plant", "identified"]) == 0
    text = capsys.readouterr().out
    assert "coupled-pd, motion 2, 250 Hz, plant identified" in text
    assert "1.7220" in text
    assert "Picture: torquerig-run.png" in text
    assert (elsewhere / "torquerig-run.png").read_bytes().startswith(b"\x89PNG")


def test_a_record_holds_the_picture_too(capsys, elsewhere):
    assert main(["run", "--record", "one"]) == 0
    assert {path.name for path in (elsewhere / "one").iterdir()} == {
        "run.json",
        "cycles.parquet",
        "truth.parquet",
        "bus.log",
        "run.png",
    }
    assert "Record:  one" in capsys.readouterr().out
    code, sentence = complaint(capsys, "run", "--record", "one")
    assert code == 2
    assert "one is not empty, and a record is never overwritten" in sentence


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (("run", "--law", "pid"), 2, "loop.law = 'pid' is not a law; there are augmented-pd, computed-torque"),
        (("run", "--motion", "3"), 2, "loop.motion = 3 cannot be: it must be one of 1, 2, "),
        (("run", "--motion", "1", "--trajectory", "a.csv"), 2, "give either --motion or --trajectory"),
        (("run", "--trajectory", "no.csv"), 2, "cannot read the trajectory no.csv: No such file"),
        (("run", "--plant", "fited"), 2, "simulator.plant = 'fited' is not a plant; did you mean fitted?"),
        (("run", "--rate", "0"), 2, "loop.rate_hz = 0.0 cannot be: it must be a number at least 1 and at most 4000"),
        (("run", "--rate", "2000"), 2, "would load bus.bitrate = 1000000 to 149 %"),
        (("run", "--repeat", "0"), 2, "loop.repeat = 0 cannot be: it must be a whole number at least 1"),
        (("run", "--motion", "x"), 2, "or the name of a trajectory file, which ends in .csv"),
        (("run", "--config", "no.toml"), 2, "cannot read the configuration no.toml"),
        (("run", "--bus", "lockstp:"), 2, "did you mean lockstep"),
        (("run", "--bus", "nonsense"), 2, "'nonsense' is no bus URL"),
        (("run", "--frob"), 2, "No such option"),
        (("frob",), 2, "No such command 'frob'"),
        (("sim", "--bus", "lockstep:"), 2, "no other process can join simulated time; take unix:FOLDER"),
        (("sim",), 2, "give either --bus URL or --slcan LINK"),
        (("nodes", "--bus", "unix:empty"), 3, "no node answers on unix:empty"),
        (("stop", "--bus", "unix:empty"), 3, "no answer from drives 1, 2 and 3"),
        (("reset", "--bus", "unix:empty"), 3, "no answer from drives 1, 2 and 3"),
        (("sdo", "read", "--bus", "unix:empty", "2", "1000"), 3, "no answer from drive 2"),
        (("sdo", "read", "--bus", "lockstep:", "1", "7777"), 2, "7777:0"),
        (("sdo", "read", "--bus", "lockstep:", "1", "xyz"), 2, "'xyz' is no object"),
        (("sdo", "read", "--bus", "lockstep:", "200", "1000"), 2, "200 is not in the range"),
        (("sdo", "write", "--bus", "lockstep:", "1", "6060", "1000"), 2, "1000 does not fit 6060:0"),
        (("sdo", "write", "--bus", "lockstep:", "1", "1018:1", "5"), 4, "read-only"),
    ],
)
def test_bad_input_gets_one_sentence_and_its_exit_code(capsys, arguments, code, sentence):
    got, told = complaint(capsys, *arguments)
    assert sentence in told
    assert got == code


def test_run_without_drives_says_who_is_silent_and_for_how_long(capsys):
    code, sentence = complaint(capsys, "run", "--bus", "unix:empty")
    assert code == 3
    assert "no answer from drives 1, 2 and 3 within" in sentence


def test_a_pose_out_of_reach_names_leg_and_distance(capsys, elsewhere):
    (elsewhere / "my.toml").write_text("[motion.2]\nstroke = 0.06\n\n[limits]\nworkspace_x = [0.07, 0.2]\n")
    code, sentence = complaint(capsys, "run", "--motion", "2", "--config", "my.toml")
    assert code == 4
    assert "leg" in sentence
    assert "m" in sentence


def test_nodes_lists_the_drives(capsys):
    assert main(["nodes", "--bus", "lockstep:"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in lines[1:]] == [[str(node), "pre-operational"] for node in (1, 2, 3)]
    assert "torquerig simulated torque drive" in lines[1]


def test_sdo_reads_numbers_and_texts_and_writes_what_it_reads_back(capsys):
    assert main(["sdo", "read", "--bus", "lockstep:", "1", "6076"]) == 0
    assert main(["sdo", "read", "--bus", "lockstep:", "3", "1008:0"]) == 0
    assert main(["sdo", "write", "--bus", "lockstep:", "2", "6071", "-5"]) == 0
    assert main(["sdo", "write", "--bus", "lockstep:", "2", "6087", "0x3E8"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(" = ")[2] for line in lines] == [
        "319 (0x13F)",
        "torquerig simulated torque drive",
        "-5",
        "1000 (0x3E8)",
    ]


def test_stop_and_reset_say_where_each_drive_stands(capsys):
    assert main(["stop", "--bus", "lockstep:"]) == 0
    assert capsys.readouterr().out.count("switch on disabled") == 3
    assert main(["reset", "--bus", "lockstep:"]) == 0
    assert capsys.readouterr().out.count("no fault") == 3


def test_the_configuration_printed_is_a_configuration_and_names_its_sources(capsys, elsewhere):
    (elsewhere / "my.toml").write_text(
        '[loop]\nrepeat = 2\n\n[laws.coupled-pd.motion1]\nkp = 1.0\n\n[plant."of mine"]\n'
        + "\n".join(f"{key} = 0.1" for key in ("actuator_inertia", "active_viscous", "passive_viscous"))
        + "\ntorque_limit = 0.5\ncurrent_lag = 0.0\ncoulomb = [0.0, 0.0, 0.0]\nbreakaway = [0.0, 0.0, 0.0]\n"
        + "\n".join(f"{link}_{key} = [0.1, 0.1, 0.1]" for link in ("proximal", "distal") for key in KEYS_OF_A_LINK)
        + "\n"
    )
    assert main(["config", "--config", "my.toml", "--rate", "500"]) == 0
    text = capsys.readouterr().out
    assert "# my.toml:2 (default 1): how often the motion is run" in text
    assert "# command line (default 250.0): [Hz]" in text
    tables = tomllib.loads(text)
    assert tables["loop"]["repeat"] == 2
    assert tables["laws"]["coupled-pd"]["motion1"] == {"kp": 1.0}
    assert "of mine" in tables["plant"]
    (elsewhere / "printed.toml").write_text(text, encoding="utf-8")
    assert main(["config", "--config", "printed.toml"]) == 0
    assert tomllib.loads(capsys.readouterr().out) == tables


KEYS_OF_A_LINK = ("mass", "centre", "inertia")
