"""`torquerig calibrate`: what it shows, what it asks, what it leaves, and what an abort leaves untouched."""

import errno
import json
import os
import tomllib
from contextlib import contextmanager
from dataclasses import replace

import pytest

from torquerig.assembly import open_rig
from torquerig.calibrating.catalogue import PROCEDURES, offer
from torquerig.calibrating.conducting import conduct
from torquerig.calibrating.offer import Request
from torquerig.calibrating.task import Consent, Task
from torquerig.calibration.procedure import Plan, Unwatched
from torquerig.cli import main
from torquerig.configuration import load_configuration
from torquerig.control.errors import LimitExceeded
from torquerig.device_sim.drive.fault_injection import Injection
from torquerig.driver.errors import DriveFault
from torquerig.driver.wire.cia402 import DriveState
from torquerig.errors import ConfigurationError, RecordError


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    return tmp_path


class Interrupter:
    """A watcher that does something once a procedure is on its way."""

    def __init__(self, act) -> None:
        self.act = act
        self.calls = 0

    def advance(self, fraction: float, words: str) -> None:  # noqa: ARG002  (a watcher's)
        self.calls += bool(fraction)
        if self.calls == 60:
            self.act()


def prepared(seen: list, plan: Plan | None = None) -> Task:
    """The latency procedure over a rig that is still there when it ended."""

    @contextmanager
    def watched(configuration, tap):
        with open_rig(configuration, tap) as rig:
            seen.append(rig.simulation)
            yield rig

    made = replace(offer("latency"), open_rig=watched)
    task = Task.prepare("latency", made, load_configuration(), Request(None, {"torque": 0.01, "steps": 100}))
    return task if plan is None else replace(task, plan=plan)


def assert_without_torque(simulation) -> None:
    drives = simulation.devices.nodes.values()
    assert {drive.torque_demand for drive in drives} == {0.0}
    assert {drive.state for drive in drives} <= {DriveState.SWITCH_ON_DISABLED, DriveState.FAULT}


def nothing_opens(_configuration, _tap):
    pytest.fail("the bus was opened")


def test_a_calibration_that_cannot_be_read_ends_before_the_bus_is_opened(tmp_path):
    (tmp_path / "calibration.toml").write_text("[axes.1\n")
    task = prepared([])
    task = replace(task, offer=replace(task.offer, open_rig=nothing_opens))
    with pytest.raises(ConfigurationError, match="is not TOML"):
        conduct(task, tmp_path, Consent("me", "test"), Unwatched())
    assert not (tmp_path / "calibration-data").exists()


def test_a_folder_that_takes_no_calibration_ends_before_the_bus_is_opened(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda _path, _mode: False)
    task = prepared([])
    task = replace(task, offer=replace(task.offer, open_rig=nothing_opens))
    with pytest.raises(RecordError, match="there is no permission to write into"):
        conduct(task, tmp_path / "new", Consent("me", "test"), Unwatched())
    assert not list(tmp_path.iterdir())


def full(path, *_rest):
    raise OSError(errno.ENOSPC, "No space left on device", str(path))


def test_a_disk_that_gets_full_leaves_the_cycles_and_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr("torquerig.calibrating.notes.write_run", full)
    monkeypatch.setattr("torquerig.record.BusLog.write", lambda _log, path, *_rest: full(path))
    with pytest.raises(RecordError, match="No space left on device"):
        conduct(prepared([]), tmp_path, Consent("me", "test"), Unwatched())
    (record,) = (tmp_path / "calibration-data").iterdir()
    assert {each.name for each in record.iterdir()} == {"cycles.parquet", "steps.parquet", "truth.parquet"}
    assert not (tmp_path / "calibration.toml").exists()


def test_a_figure_that_cannot_be_written_is_one_sentence(tmp_path):
    task = prepared([])
    task = replace(task, offer=replace(task.offer, draw=lambda _result, _title, path: full(path)))
    with pytest.raises(RecordError, match=r"cannot write the figure .*: No space left on device"):
        conduct(task, tmp_path, Consent("me", "test"), Unwatched())


def test_a_full_disk_does_not_hide_the_drives_fault(tmp_path, monkeypatch):
    monkeypatch.setattr("torquerig.calibrating.notes.write_run", full)
    seen: list = []

    def fault() -> None:
        seen[0].devices.nodes[2].inject(Injection.OVERCURRENT, seen[0].machine.now_ns)

    with pytest.raises(DriveFault, match="drive 2") as caught:
        conduct(prepared(seen), tmp_path, Consent("me", "test"), Interrupter(fault))
    assert "No space left on device" in caught.value.__notes__[-1]
    (record,) = (tmp_path / "calibration-data").iterdir()
    assert (record / "cycles.parquet").exists()


@pytest.mark.parametrize(
    ("bound", "words"),
    [
        ({"torque": 0.005}, "agreed torque limit: axis 1"),
        ({"duration": 0.05}, "agreed duration limit"),
    ],
)
def test_nothing_goes_beyond_what_was_agreed(tmp_path, bound, words):
    seen: list = []
    plan = prepared([]).plan
    task = prepared(seen, replace(plan, bounds=replace(plan.bounds, **bound)))
    with pytest.raises(LimitExceeded, match=words):
        conduct(task, tmp_path, Consent("me", "test"), Interrupter(lambda: None))
    assert_without_torque(seen[0])
    assert not (tmp_path / "calibration.toml").exists()


@pytest.mark.parametrize(("bound", "words"), [({"travel": 1e-4}, "agreed travel"), ({"speed": 1e-3}, "agreed speed")])
def test_motion_beyond_what_was_agreed_stops_the_machine(tmp_path, bound, words):
    made = offer("home")
    request = Request(None, {each.name: each.default for each in made.options})
    task = Task.prepare("home", made, load_configuration(), request)
    task = replace(task, plan=replace(task.plan, bounds=replace(task.plan.bounds, **bound)))
    with pytest.raises(LimitExceeded, match=words):
        conduct(task, tmp_path, Consent("me", "test"), Interrupter(lambda: None))


def test_a_dry_run_opens_no_bus_and_writes_nothing(tmp_path, capsys):
    assert main(["calibrate", "stiction", "--dry-run", "--bus", "unix:/nowhere"]) == 0
    printed = capsys.readouterr().out
    assert "Limits" in printed
    assert "0.15 N·m at the motor" in printed
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["direction", "home", "latency", "stiction"])
def test_every_dry_run_tells_its_limits_as_json(capsys, name):
    assert main(["calibrate", name, "--dry-run", "--json"]) == 0
    plan = json.loads(capsys.readouterr().out)
    assert set(plan["limits"]) == {"torque_nm", "speed_rad_s", "travel_rad", "duration_s"}
    assert plan["steps"]


def test_on_a_real_bus_somebody_has_to_agree(tmp_path, capsys):
    assert main(["calibrate", "latency", "--bus", f"unix:{tmp_path}"]) == 2
    assert "nobody is there to agree to the plan" in capsys.readouterr().err


def test_json_is_one_object_with_the_truth_and_the_files(tmp_path, capsys):
    assert main(["calibrate", "latency", "--steps", "60", "--json", "--out", str(tmp_path / "here")]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["verdict"] == "ok"
    assert printed["truth"].items() >= {"sample_us": 20.0, "reaction_us": 50.0}.items()
    assert printed["calibration"] == str(tmp_path / "here" / "calibration.toml")
    tables = tomllib.loads((tmp_path / "here" / "calibration.toml").read_text())
    assert tables["latency"]["reaction"] == pytest.approx(50e-6, abs=5e-6)
    provenance = tables["provenance"]["latency"]
    assert provenance["agreed"] == "nobody: nothing real moves"
    assert provenance["simulated"] is True
    assert provenance["drives"][0] == {"node": 1, "vendor": 0, "product": 1, "revision": 65536, "serial": 1}
    record = tmp_path / "here" / provenance["record"]
    assert {"run.json", "cycles.parquet", "steps.parquet", "truth.parquet", "bus.log", "latency.png"} <= {
        each.name for each in record.iterdir()
    }


def test_the_same_seed_gives_the_same_result(capsys):
    printed = []
    for _ in range(2):
        assert main(["calibrate", "latency", "--steps", "40", "--json", "--seed", "7"]) == 0
        printed.append(json.loads(capsys.readouterr().out)["axes"])
    assert printed[0] == printed[1]


def test_a_calibration_that_a_result_is_added_to_is_in_force_and_told(tmp_path, capsys):
    out = tmp_path / "out"
    out.mkdir()
    there = out / "calibration.toml"
    there.write_text("[axes.1]\ncounts_per_nm_positive = 10000.0\ncounts_per_nm_negative = 10000.0\n")
    asked = ["calibrate", "latency", "--steps", "40", "--axis", "1", "--torque", "0.01", "--json", "--out", str(out)]
    assert main(asked) == 0
    printed = json.loads(capsys.readouterr().out)
    assert f"In force: the calibration {there}." in printed["notes"]
    (record,) = (out / "calibration-data").iterdir()
    used = json.loads((record / "run.json").read_text())["configuration"]["axes"]["1"]
    assert used["counts_per_nm_positive"] == 10000.0
    assert tomllib.loads(there.read_text())["axes"]["1"]["counts_per_nm_positive"] == 10000.0


def test_a_new_calibration_is_begun_without_the_old_one_in_force(tmp_path, capsys):
    old = "[axes.1]\nsign = 1\n"
    (tmp_path / "calibration.toml").write_text(old)
    assert main(["calibrate", "latency", "--steps", "40", "--json", "--replace"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["kept"] == "calibration.toml.1"
    assert (tmp_path / "calibration.toml.1").read_text() == old
    assert "axes" not in tomllib.loads((tmp_path / "calibration.toml").read_text())
    assert not any("In force" in note for note in printed["notes"])


def test_two_calibrations_at_once_are_one_sentence(tmp_path, capsys):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "calibration.toml").write_text("[axes.1]\nsign = 1\n")
    asked = ["calibrate", "latency", "--dry-run", "--calibration", "a/calibration.toml"]
    assert main([*asked, "--out", "b"]) == 2
    assert "a result cannot be added to b/calibration.toml" in capsys.readouterr().err
    assert main([*asked, "--out", "a"]) == 0


def test_a_file_of_readings_is_evaluated_without_a_bus_and_without_consent(tmp_path, capsys):
    levels = tmp_path / "levels.csv"
    levels.write_text(
        "\n".join(f"{way * level},{way * level / 20100:.6f}" for way in (1, -1) for level in range(3500, 8001, 500))
    )
    options = ["--axis", "1", "--sensor", "csv", "--readings", str(levels), "--bus", "unix:/nowhere/at/all", "--json"]
    assert main(["calibrate", "torque", *options]) == 0
    assert json.loads(capsys.readouterr().out)["axes"][0]["average"] == pytest.approx(20100, abs=2)
    facts = tomllib.loads((tmp_path / "calibration.toml").read_text())["provenance"]["torque"]
    assert "drives" not in facts


def test_a_failed_verdict_exits_with_4_and_writes_no_calibration(tmp_path, capsys):
    config = tmp_path / "my.toml"
    config.write_text("[simulator.installation]\nencoder_sign = [1, -1, 1]\n")
    assert main(["calibrate", "direction", "--config", str(config), "--json"]) == 4
    printed = capsys.readouterr()
    assert json.loads(printed.out)["faults"] == ["axis 2: wrong encoder sign"]
    assert "direction: failed: axis 2: wrong encoder sign; calibration.toml is as it was" in printed.err
    assert not (tmp_path / "calibration.toml").exists()


def test_what_is_suspicious_is_written_only_when_it_is_accepted(tmp_path, capsys):
    config = tmp_path / "my.toml"
    config.write_text("[axes.2]\nencoder_zero = 1e-3\n")
    asked = ["calibrate", "home", "--reach", "1", "--config", str(config), "--json"]
    assert main(asked) == 4
    assert not (tmp_path / "calibration.toml").exists()
    assert main([*asked, "--accept"]) == 0
    assert (tmp_path / "calibration.toml").exists()
    capsys.readouterr()


def test_the_help_names_every_procedure(capsys):
    assert main(["calibrate", "--help"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in PROCEDURES)


def test_cables_that_end_nowhere_are_one_sentence(tmp_path, capsys):
    config = tmp_path / "my.toml"
    config.write_text("[simulator.installation]\nmotors = [1, 1, 3]\n")
    assert main(["calibrate", "direction", "--config", str(config)]) == 2
    assert "simulator.installation.motors = [1, 1, 3] cannot be" in capsys.readouterr().err
