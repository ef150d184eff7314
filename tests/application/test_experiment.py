"""Whole experiments in lockstep: the real driver, the real loop, simulated drives, simulated time."""

import json
from collections import Counter
from pathlib import Path

import can
import numpy as np
import pyarrow.parquet as pq
import pytest

from torquerig import load_configuration, run_experiment
from torquerig.configuration import Configuration
from torquerig.control.errors import LimitExceeded
from torquerig.experiment import Nobody
from torquerig.stopping import Stopped

LAWS = ("decoupled-pd", "coupled-pd", "augmented-pd", "computed-torque")
SWITCH_ON_DISABLED = 0x40
PROTOTYPE_MM = {
    1: dict(zip(LAWS, (1.085, 1.718, 1.277, 0.846), strict=True)),
    2: dict(zip(LAWS, (1.594, 1.555, 0.909, 0.984), strict=True)),
}
"""Position RMSE of an independent prototype on the fitted plant [mm]: no wire, encoder x1, no lag."""


def configured(**options: object) -> Configuration:
    return load_configuration(options={key.replace("__", "."): value for key, value in options.items()})


@pytest.fixture(scope="module")
def default_record(tmp_path_factory) -> Path:
    place = tmp_path_factory.mktemp("records") / "default"
    run_experiment(configured(), record=place)
    return place


@pytest.mark.parametrize("motion", [1, 2])
@pytest.mark.parametrize("law", LAWS)
def test_each_law_errs_as_in_an_independent_prototype(law, motion):
    summary = run_experiment(configured(loop__law=law, loop__motion=motion)).summary
    assert summary.position_rmse_mm == pytest.approx(PROTOTYPE_MM[motion][law], rel=0.15)
    assert summary.true_position_rmse_mm == pytest.approx(summary.position_rmse_mm, rel=0.05)
    assert summary.overruns == 0


def test_the_model_based_laws_beat_the_two_that_know_no_model():
    for motion in (1, 2):
        errors = [
            run_experiment(configured(loop__law=law, loop__motion=motion)).summary.position_rmse_mm for law in LAWS
        ]
        assert sum(errors[:2]) > sum(errors[2:])


def test_friction_feedforward_can_be_switched_off():
    with_friction = run_experiment(configured()).summary
    without = run_experiment(configured(loop__friction_feedforward=False)).summary
    assert without.position_rmse_mm > 1.1 * with_friction.position_rmse_mm


def test_changed_gains_change_the_run(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text("[laws.computed-torque.motion1]\nkp = 1500.0\n", encoding="utf-8")
    softer = run_experiment(load_configuration(path)).summary
    assert softer.position_rmse_mm > 1.1 * PROTOTYPE_MM[1]["computed-torque"]


def test_the_command_leaves_after_the_thesis_running_time_at_250_hz():
    log = run_experiment(configured()).log
    np.testing.assert_allclose(log.command_ns, 3_180_000, atol=1)


def test_the_command_leaves_as_soon_as_computed_at_other_rates():
    log = run_experiment(configured(loop__rate_hz=500.0)).log
    assert log.command_ns.max() < 600_000


def test_only_the_motions_samples_are_counted():
    outcome = run_experiment(configured(loop__repeat=3))
    assert outcome.log.in_motion.sum() == 150
    assert outcome.summary.cycles == len(outcome.log.in_motion)


def test_the_summary_has_the_thesis_row_beside_it():
    summary = run_experiment(configured(loop__law="augmented-pd", loop__motion=2)).summary.as_json()
    assert set(summary) == {
        "law", "motion", "plant", "bus", "rate_hz", "cycles", "overruns", "position_rmse_mm", "velocity_rmse_m_s",
        "true_position_rmse_mm", "peak_torque_nm", "rms_torque_nm", "bus_load", "cycle_us", "thesis", "gains",
        "timing", "law_us", "thesis_ms", "departures",
    }  # fmt: skip
    assert set(summary["cycle_us"]) == {"p50", "p99", "max"}
    assert summary["thesis"] == {"position_rmse_mm": 0.7143, "velocity_rmse_m_s": 0.0606}
    assert (summary["law"], summary["motion"], summary["plant"], summary["bus"]) == (
        "augmented-pd",
        2,
        "fitted",
        "lockstep:",
    )
    json.dumps(summary, allow_nan=False)


def test_two_records_of_one_command_hold_the_same_frames(default_record, tmp_path):
    run_experiment(configured(), record=tmp_path / "again")
    assert (tmp_path / "again" / "bus.log").read_bytes() == (default_record / "bus.log").read_bytes()


def test_an_independent_reader_finds_sync_and_six_pdos_in_every_cycle(default_record):
    loop = pq.read_table(default_record / "cycles.parquet")
    cycles: list[Counter[int]] = []
    with can.LogReader(default_record / "bus.log") as reader:
        for message in reader:
            if message.arbitration_id == 0x080:
                cycles.append(Counter())
            elif cycles and message.arbitration_id in (0x181, 0x182, 0x183, 0x201, 0x202, 0x203):
                cycles[-1][message.arbitration_id] += 1
    complete = Counter({0x181: 1, 0x182: 1, 0x183: 1, 0x201: 1, 0x202: 1, 0x203: 1})
    longest = run = 0
    for cycle in cycles:
        run = run + 1 if cycle == complete else 0
        longest = max(longest, run)
    assert longest >= loop.num_rows - 1  # in the last one the drives are told to stop, too


def test_a_record_names_units_configuration_and_versions(default_record):
    run = json.loads((default_record / "run.json").read_text(encoding="utf-8"))
    assert run["ended"] == "done"
    assert run["configuration"]["plant"]["fitted"]["coulomb"] == [1.64, 1.64, 1.64]
    assert {"torquerig", "python", "numpy", "python-can"} <= set(run["versions"])
    assert run["summary"]["law"] == "computed-torque"
    for name in ("cycles.parquet", "truth.parquet"):
        table = pq.read_table(default_record / name)
        assert all(field.metadata[b"unit"] for field in table.schema)
        assert table.num_rows > 100


class StopAt(Nobody):
    """Raises in the middle of the loop, as a signal would."""

    def __init__(self, cycle: int, error: BaseException) -> None:
        self.cycle, self.error = cycle, error

    def cycles_done(self, done: int) -> None:
        if done >= self.cycle:
            raise self.error


@pytest.mark.parametrize("error", [Stopped(15), RuntimeError("a bug")])
def test_a_run_that_is_stopped_leaves_its_record_and_disabled_drives(tmp_path, error):
    with pytest.raises(type(error)):
        run_experiment(configured(), record=tmp_path / "stopped", watcher=StopAt(60, error))
    place = tmp_path / "stopped"
    assert json.loads((place / "run.json").read_text(encoding="utf-8"))["ended"] == str(error)
    assert pq.read_table(place / "cycles.parquet").num_rows == 60
    truth = pq.read_table(place / "truth.parquet")
    assert abs(truth["motor_torque_1"].to_numpy()[-1]) < 1e-6
    with can.LogReader(place / "bus.log") as reader:
        statuswords = {
            message.arbitration_id: int.from_bytes(message.data[:2], "little")
            for message in reader
            if message.arbitration_id in (0x181, 0x182, 0x183)
        }
    assert {word & 0x6F for word in statuswords.values()} == {SWITCH_ON_DISABLED}


def test_a_limit_stops_the_run_and_the_record_says_which(tmp_path):
    with pytest.raises(LimitExceeded, match="position error limit"):
        run_experiment(configured(limits__position_error=1e-4), record=tmp_path / "limit")
    run = json.loads((tmp_path / "limit" / "run.json").read_text(encoding="utf-8"))
    assert run["ended"].startswith("position error limit: end-effector at")


def test_a_motion_that_leaves_the_workspace_does_not_begin(tmp_path):
    configuration = configured(limits__workspace_x=[0.09, 0.1])
    with pytest.raises(LimitExceeded, match="workspace limit: x"):
        run_experiment(configuration, record=tmp_path / "far")
    assert (tmp_path / "far" / "bus.log").read_bytes() == b""
