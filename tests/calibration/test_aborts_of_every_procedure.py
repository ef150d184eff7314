"""Whatever procedure a person or a drive ends in its middle: no torque, and the old calibration untouched."""

import json
import signal
from contextlib import contextmanager
from dataclasses import replace
from functools import cache

import pytest

from torquerig.calibrating.catalogue import PROCEDURES, offer
from torquerig.calibrating.conducting import conduct
from torquerig.calibrating.offer import Request
from torquerig.calibrating.task import Consent, Task
from torquerig.cli import main
from torquerig.configuration import load_configuration
from torquerig.device_sim.drive.fault_injection import Injection
from torquerig.driver.errors import DriveFault
from torquerig.driver.wire.cia402 import DriveState
from torquerig.provenance import drives_told

OLD = "[axes.1]\nsign = 1\n"
QUICK = {"zeros": {"seconds": 6.0}, "identify": {"periods": 1}}
CYCLE = 25
TORQUE_CYCLES = 3  # with torque, before it is aborted


class Abort:
    """A watcher that acts at the first cycle from a given one on in which the motors have had torque for a while."""

    def __init__(self, rigs, cycle, act):
        self.rigs, self.cycle, self.act = rigs, cycle, act
        self.cycles = self.turned = 0
        self.acted = False

    def advance(self, fraction, words):  # noqa: ARG002  (a watcher's)
        if not fraction or self.acted:
            return
        self.cycles += 1
        self.turned += any(drive.torque_demand for drive in drives_of(self.rigs[0]))
        if self.cycles >= self.cycle and self.turned >= TORQUE_CYCLES:
            self.acted = True
            self.act(self.rigs[0])


def drives_of(rig):
    return [rig.simulation.devices.nodes[node_id] for node_id in (1, 2, 3)]


@cache
def prepared(name):
    made = offer(name)
    options = {each.name.replace("-", "_"): each.default for each in made.options} | QUICK.get(name, {})
    return Task.prepare(name, made, load_configuration(), Request(None, options))


@contextmanager
def watched(task):
    """The task over a rig that is still there when it has ended."""
    rigs = []

    @contextmanager
    def open_rig(configuration, tap):
        with task.offer.open_rig(configuration, tap) as rig:
            rigs.append(rig)
            yield rig

    yield replace(task, offer=replace(task.offer, open_rig=open_rig)), rigs


def assert_without_torque(rig):
    assert [drive.torque_demand for drive in drives_of(rig)] == [0.0, 0.0, 0.0]
    assert {drive.state for drive in drives_of(rig)} <= {DriveState.SWITCH_ON_DISABLED, DriveState.FAULT}


def assert_untouched(place, how_it_ended):
    assert (place / "calibration.toml").read_bytes() == OLD.encode()
    assert [each.name for each in place.glob("calibration.toml*")] == ["calibration.toml"]
    (record,) = (place / "calibration-data").iterdir()
    facts = json.loads((record / "run.json").read_text())
    assert how_it_ended in facts["ended"]
    assert drives_told(facts).are_simulated
    assert (record / "cycles.parquet").exists()
    assert (record / "bus.log").exists()


def interrupt(_rig):
    raise KeyboardInterrupt


def overcurrent(rig):
    drive = rig.simulation.devices.nodes[2]
    rig.bus._wire.intervene(2, lambda at_ns: drive.inject(Injection.OVERCURRENT, at_ns))


@pytest.mark.parametrize("name", PROCEDURES)
def test_ctrl_c_leaves_no_torque_and_the_old_calibration(tmp_path, name):
    (tmp_path / "calibration.toml").write_text(OLD)
    with watched(prepared(name)) as (task, rigs):
        abort = Abort(rigs, CYCLE, interrupt)
        with pytest.raises(KeyboardInterrupt):
            conduct(task, tmp_path, Consent("me", "test"), abort)
    assert abort.acted
    assert_without_torque(rigs[0])
    assert_untouched(tmp_path, "KeyboardInterrupt")


@pytest.mark.parametrize("name", PROCEDURES)
def test_a_drives_fault_leaves_no_torque_and_the_old_calibration(tmp_path, name):
    (tmp_path / "calibration.toml").write_text(OLD)
    with watched(prepared(name)) as (task, rigs):
        abort = Abort(rigs, CYCLE, overcurrent)
        with pytest.raises(DriveFault, match=r"drive 2 is in fault: continuous overcurrent .*\(0x2310\)"):
            conduct(task, tmp_path, Consent("me", "test"), abort)
    assert_without_torque(rigs[0])
    assert_untouched(tmp_path, "drive 2 is in fault")


@pytest.mark.parametrize(
    ("act", "code", "words"),
    [
        (lambda _: signal.raise_signal(signal.SIGINT), 130, "torquerig: stopped by SIGINT\n"),
        (lambda _: signal.raise_signal(signal.SIGTERM), 143, "torquerig: stopped by SIGTERM\n"),
        (overcurrent, 4, "torquerig: drive 2 is in fault: continuous overcurrent at the output (0x2310)"),
    ],
)
def test_the_command_ends_with_one_sentence_and_its_code(tmp_path, monkeypatch, capsys, act, code, words):
    (tmp_path / "calibration.toml").write_text(OLD)
    with watched(prepared("home")) as (task, rigs):
        abort = Abort(rigs, CYCLE, act)
        monkeypatch.setattr("torquerig.cli.calibrate.offer", lambda _name: task.offer)
        monkeypatch.setattr(
            "torquerig.cli.procedure_bar.ProcedureBar.advance", lambda _bar, *told: abort.advance(*told)
        )
        assert main(["calibrate", "home", "--json", "--out", str(tmp_path)]) == code
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith(words)
    assert printed.err.count("\n") == 1
    assert_without_torque(rigs[0])
    assert_untouched(tmp_path, words.removeprefix("torquerig: ").strip())
