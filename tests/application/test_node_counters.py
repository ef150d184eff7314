"""`torquerig nodes --counters`: what came over the bus and was not taken, node by node; and a run's own counters."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import can
import pytest

from torquerig.cli import main
from torquerig.cli.nodes import _printable
from torquerig.configuration import load_configuration
from torquerig.device_sim.canopen.refusals import REFUSALS
from torquerig.driver.wire.dictionary import DRIVE_EDS, load_dictionary
from torquerig.experiment import run_experiment

PATIENCE_S = 60.0


def counters_of(output: str) -> dict[str, list[str]]:
    """The counters' lines by their names."""
    lines = output.split("\n\n")[1].splitlines()
    assert lines[0].split("  ", 1)[0] == "not taken from the bus"
    return {line.split("  ")[0]: line.split("  ", 1)[1].split() for line in lines[1:-1]}


def test_counters_of_quiet_drives_are_zero(capsys):
    assert main(["nodes", "--bus", "lockstep:", "--counters"]) == 0
    output = capsys.readouterr().out
    names = [variable.name for variable in load_dictionary(DRIVE_EDS, 1)[REFUSALS].subindices.values()][1:]
    assert counters_of(output) == {name: ["0", "0", "0"] for name in names}
    assert output.splitlines()[-1].startswith("this scan: ")


def test_without_the_option_there_are_no_counters(capsys):
    assert main(["nodes", "--bus", "lockstep:"]) == 0
    assert "not taken" not in capsys.readouterr().out


def test_nodes_that_do_not_count_are_named(capsys, tmp_path: Path):
    text = DRIVE_EDS.read_text("ascii").replace("ProductNumber=0x00000001", "ProductNumber=0x00000077")
    (tmp_path / "other.eds").write_text(text, "ascii")
    (tmp_path / "my.toml").write_text(
        f'[axes.2]\neds = "{tmp_path}/other.eds"\n[axes.3]\nprofile = "nanotec"\n', "ascii"
    )
    assert main(["nodes", "--bus", "lockstep:", "--counters", "--config", str(tmp_path / "my.toml")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "do not count, or not as their profile says: 2, 3" in lines
    assert next(line for line in lines if line.startswith("RPDOs too short")).split()[-3:] == ["0", "-", "-"]


@pytest.mark.parametrize(
    ("frame", "name"),
    [
        (can.Message(arbitration_id=0x000, data=b"\x55\x01", is_extended_id=False), "NMT commands malformed"),
        (can.Message(arbitration_id=0x602, data=b"\x40", is_extended_id=False), "SDO requests malformed"),
        (can.Message(arbitration_id=0x080, data=b"\x01", is_extended_id=False), "SYNCs of wrong length"),
        (can.Message(arbitration_id=0x12345678, is_extended_id=True), "Remote or extended frames ignored"),
    ],
)
def test_what_a_stranger_says_is_seen_from_another_process(drives_at, frame, name, capsys):
    with can.Bus(interface="unix", channel=str(drives_at)) as bus:
        bus.send(frame)
        give_up = time.monotonic() + PATIENCE_S
        counted = "0"
        while counted == "0" and time.monotonic() < give_up:
            assert main(["nodes", "--bus", f"unix:{drives_at}", "--counters"]) == 0
            counted = counters_of(capsys.readouterr().out)[name][1]
    assert counted == "1"


@pytest.fixture
def drives_at(tmp_path: Path):
    """A simulator in a process of its own."""
    folder = tmp_path / "bus"
    command = [sys.executable, "-m", "torquerig", "sim", "--bus", f"unix:{folder}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline()
        yield folder
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE_S)


def test_a_run_reports_what_its_driver_counted(tmp_path: Path):
    run_experiment(load_configuration(), record=tmp_path / "record")
    counters = json.loads((tmp_path / "record" / "run.json").read_text(encoding="utf-8"))["counters"]
    assert counters["frames"]["malformed"] == 0
    assert counters["cycles"]["syncs"] > 100
    assert counters["cycles"]["missed"] == [0, 0, 0]


def test_a_name_from_the_bus_does_nothing_to_a_terminal():
    assert _printable("a drive\x1b[2J\nof mine · ä") == "a drive?[2J?of mine · ä"
