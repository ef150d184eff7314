"""A disk that takes no more: one sentence, no half file, and nothing that calls itself done."""

import errno
import json

import pytest

from torquerig import load_configuration, run_experiment
from torquerig.control.errors import LimitExceeded
from torquerig.driver.wire.frame import Frame
from torquerig.errors import RecordError
from torquerig.record import BusLog, write_run, write_table


class Numbers:
    """A column."""

    name, unit, values = "k", "1", [1, 2]


def write_bus_log(path):
    log = BusLog()
    log.tap(0, Frame(0x80))
    log.write(path, "lockstep")


@pytest.fixture
def full_disk(monkeypatch):
    """Every file can be written, but no table."""

    def full(*_arguments, **_options):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("pyarrow.parquet.write_table", full)


@pytest.mark.parametrize(
    "write",
    [write_bus_log, lambda path: write_table(path, [Numbers()]), lambda path: write_run(path, {})],
    ids=["bus.log", "table", "run.json"],
)
def test_a_file_is_whole_or_not_there(tmp_path, monkeypatch, write):
    write(tmp_path / "whole")
    assert [path.name for path in tmp_path.iterdir()] == ["whole"]

    def full(*_arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("torquerig.record.os.replace", full)
    with pytest.raises(RecordError, match=r"cannot write the record's file .*half: No space left on device"):
        write(tmp_path / "half")
    assert [path.name for path in tmp_path.iterdir()] == ["whole"]


@pytest.mark.usefixtures("full_disk")
def test_a_run_whose_cycles_cannot_be_written_does_not_say_it_is_done(tmp_path):
    with pytest.raises(RecordError, match=r"cycles.parquet: No space left on device"):
        run_experiment(load_configuration(), record=tmp_path / "r")
    assert [path.name for path in (tmp_path / "r").iterdir()] == ["bus.log"]


@pytest.mark.usefixtures("full_disk")
def test_what_ended_the_run_is_told_first(tmp_path):
    stopped = load_configuration(options={"limits.position_error": 1e-5})
    with pytest.raises(LimitExceeded) as caught:
        run_experiment(stopped, record=tmp_path / "r")
    assert "No space left on device" in caught.value.__notes__[0]


def test_run_json_is_the_last_file_written(tmp_path):
    place = tmp_path / "r"
    run_experiment(load_configuration(), record=place)
    assert json.loads((place / "run.json").read_text(encoding="utf-8"))["ended"] == "done"
    times = {path.name: path.stat().st_mtime_ns for path in place.iterdir()}
    assert max(times, key=times.__getitem__) == "run.json"
