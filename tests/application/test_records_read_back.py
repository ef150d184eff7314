"""A record read back is what the run left in memory; whatever is wrong with one is told in a sentence."""

import json
import shutil
from dataclasses import fields
from pathlib import Path

import can
import numpy as np
import pyarrow.parquet as pq
import pytest

from torquerig import load_configuration, run_experiment
from torquerig.control.log import column_units
from torquerig.errors import RecordError
from torquerig.experiment import Nobody, Outcome
from torquerig.record import SIM
from torquerig.records import open_record
from torquerig.simulator import begin_record


@pytest.fixture(scope="module")
def outcome(tmp_path_factory) -> Outcome:
    return run_experiment(load_configuration(), record=tmp_path_factory.mktemp("read") / "run")


@pytest.fixture
def copy(outcome: Outcome, tmp_path: Path) -> Path:
    return shutil.copytree(outcome.record, tmp_path / "copy")


def edit(place: Path, **changed: object) -> None:
    """Change facts of run.json; None takes one out."""
    path = place / "run.json"
    facts = json.loads(path.read_text(encoding="utf-8")) | changed
    path.write_text(json.dumps({key: value for key, value in facts.items() if value is not None}), encoding="utf-8")


def test_everything_of_a_run_comes_back(outcome):
    read = open_record(outcome.record)
    kept = [each.name for each in fields(outcome.log) if each.name != "cells"]  # where the loop writes: no column
    for name in kept:
        np.testing.assert_array_equal(getattr(read.log, name), getattr(outcome.log, name))
    assert read.summary.as_json() == outcome.summary.as_json()
    assert read.notes == outcome.notes
    assert read.is_done
    assert read.rig() == load_configuration().rig
    assert read.planned_cycles == len(outcome.log.due_ns) == len(read.cycles(whole=True).due_ns)
    assert read.counters["cycles"]["late"] == 0
    assert read.started.tzinfo is not None
    np.testing.assert_array_equal(read.true_positions(), outcome.truth)


def test_cycles_line_up_with_the_frames_of_the_bus_log(outcome):
    read = open_record(outcome.record)
    with can.LogReader(read.bus_log) as reader:
        syncs = np.array([message.timestamp for message in reader if message.arbitration_id == 0x080])
    stamps = read.stamps_ns() / 1e9
    nearest = syncs[np.searchsorted(syncs, stamps)]
    assert np.all(nearest - stamps < 100e-6)
    assert np.all(nearest >= stamps)


def test_a_run_that_was_stopped_comes_back_but_not_as_a_whole_one(tmp_path):
    class StopAt60(Nobody):
        def cycles_done(self, done: int) -> None:
            if done >= 60:
                raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        run_experiment(load_configuration(), record=tmp_path / "stopped", watcher=StopAt60())
    read = open_record(tmp_path / "stopped")
    assert (read.ended, read.is_done, read.cycles().rows, read.planned_cycles) == ("enough", False, 60, 102)
    with pytest.raises(RecordError, match=r"stopped after 60 of 102 cycles \(enough\): a whole one is needed"):
        read.cycles(whole=True)


def test_a_run_that_ended_before_its_loop_has_no_cycles(tmp_path):
    configuration = load_configuration(options={"limits.workspace_x": [0.09, 0.1]})
    with pytest.raises(Exception, match="workspace limit"):
        run_experiment(configuration, record=tmp_path / "early")
    read = open_record(tmp_path / "early")
    assert (read.log, read.summary, read.truth is None) == (None, None, False)
    with pytest.raises(RecordError, match=r"has no cycles: the run ended before the first one \(workspace limit: x"):
        read.cycles()


def test_a_record_of_simulated_drives_has_their_truth_and_no_cycles(tmp_path):
    record = begin_record(load_configuration(), tmp_path / "sim")
    record.truth.append(0, np.array((0.092, 0.062, 0.0, 0.0, 1.0, 1.0, 1.0, 0.1, 0.2, 0.3)))
    record.write(origin_ns=7, lost=0)
    read = open_record(tmp_path / "sim")
    assert (read.kind, read.time_zero_ns, read.summary) == (SIM, 7, None)
    assert read.truth.motor_torque.tolist() == [[0.1, 0.2, 0.3]]
    with pytest.raises(RecordError, match="is a record of simulated drives: it has no cycles of a loop"):
        read.cycles()


@pytest.mark.parametrize(
    ("damage", "sentence"),
    [
        (shutil.rmtree, "there is no folder .*copy"),
        (lambda place: (place / "run.json").unlink(), r"copy is no record: there is no run\.json in it"),
        (lambda place: (place / "run.json").write_text("{"), r"run\.json is damaged: it is not JSON"),
        (lambda place: (place / "run.json").write_text("[]"), r"run\.json is damaged: it does not hold an object"),
        (
            lambda place: edit(place, format=None),
            "copy is of format 0, and this version reads format 1: record it again",
        ),
        (lambda place: edit(place, format=99), "copy is of format 99"),
        (lambda place: edit(place, started=None), r"run\.json is damaged: started is missing"),
        (lambda place: edit(place, started="soon"), r"run\.json is damaged: Invalid isoformat"),
        (lambda place: edit(place, summary={"law": "x"}), r"run\.json is damaged: motion is missing"),
        (lambda place: edit(place, versions=3, format=2), "copy is of format 2"),
        (lambda place: (place / "cycles.parquet").unlink(), r"cycles\.parquet is missing"),
        (lambda place: (place / "cycles.parquet").write_text("PAR"), r"cycles\.parquet is damaged: it is not a Parq"),
        (lambda place: (place / "truth.parquet").write_text(""), r"truth\.parquet is damaged"),
    ],
)
def test_a_record_that_cannot_be_read_is_refused_in_one_sentence(copy, damage, sentence):
    damage(copy)
    with pytest.raises(RecordError, match=sentence) as caught:
        open_record(copy)
    assert "\n" not in str(caught.value)


def test_a_missing_column_and_a_wrong_unit_are_named(copy):
    path = copy / "cycles.parquet"
    table = pq.read_table(path)
    pq.write_table(table.drop_columns(["tau_2"]), path)
    with pytest.raises(RecordError, match=r"cycles\.parquet has no column tau_2"):
        open_record(copy)
    wrong = table.schema.field("q_1").with_metadata({"unit": "deg"})
    pq.write_table(table.cast(table.schema.set(table.schema.get_field_index("q_1"), wrong)), path)
    with pytest.raises(RecordError, match=r"column q_1 is in 'deg', it must be in 'rad'"):
        open_record(copy)


def test_a_configuration_of_another_version_is_named_when_it_is_asked_for(copy):
    edit(copy, configuration={"bus": {"url": "lockstep:", "baud": 3}})
    with pytest.raises(RecordError, match=r"is not this version's: bus\.baud is not a setting"):
        open_record(copy).rig()


def test_the_units_told_are_those_of_the_columns(outcome):
    assert column_units() == {column.name: column.unit for column in outcome.log.columns()}
