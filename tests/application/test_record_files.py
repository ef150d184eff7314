"""The files of a record, read by programs that are not ours."""

from dataclasses import dataclass
from pathlib import Path

import can
import numpy as np
import pyarrow.parquet as pq
import pytest

from torquerig.driver.wire.frame import Frame
from torquerig.errors import RecordError
from torquerig.record import BusLog, candump_line, channel_name, claim, write_table


@dataclass(frozen=True)
class Values:
    name: str
    unit: str
    values: np.ndarray


def test_a_frame_is_written_as_candump_writes_it():
    assert candump_line(4_000_999, "lockstep", Frame(0x080)) == "(0000000000.004000) lockstep 080#\n"
    assert (
        candump_line(1_700_000_000_123_456_789, "vcan0", Frame(0x201, bytes.fromhex("0f00a0ff")))
        == "(1700000000.123456) vcan0 201#0F00A0FF\n"
    )


def test_python_can_reads_the_bus_log(tmp_path: Path):
    log = BusLog()
    frames = [
        Frame(0x080),
        Frame(0x181, bytes(range(8))),
        Frame(0x701, b"\x00", remote=True),
        Frame(0x701, remote=True),
        Frame(0x12345678, b"\x01\x02", extended=True),
    ]
    for number, frame in enumerate(frames):
        log.tap(number * 1_000_000, frame)
    log.write(tmp_path / "bus.log", "lockstep")
    with can.LogReader(tmp_path / "bus.log") as reader:
        messages = list(reader)
    assert [message.channel for message in messages] == ["lockstep"] * 5
    assert [message.timestamp for message in messages] == pytest.approx([0, 0.001, 0.002, 0.003, 0.004])
    for message, frame in zip(messages, frames, strict=True):
        assert message.arbitration_id == frame.can_id
        assert message.is_extended_id == frame.extended
        assert message.is_remote_frame == frame.remote
        assert message.dlc == len(frame.data)
        assert frame.remote or bytes(message.data) == frame.data


def test_the_load_of_a_cycle_is_that_of_its_worst_case_bits():
    log = BusLog()
    for frame in [Frame(0x080)] + 3 * [Frame(0x181, bytes(8))] + 3 * [Frame(0x201, bytes(4))]:
        log.tap(1_000_000, frame)
    assert log.load(0, 4_000_000, 1_000_000) == pytest.approx(0.18625)
    assert np.isnan(log.load(5, 5, 1_000_000))


@pytest.mark.parametrize(
    ("url", "name"), [("lockstep:", "lockstep"), ("socketcan:vcan0", "vcan0"), ("unix:/run/my rig", "unix")]
)
def test_a_bus_has_a_name_without_blanks_in_its_log(url, name):
    assert channel_name(url) == name


def test_a_column_keeps_its_unit(tmp_path: Path):
    columns = [
        Values("q_1", "rad", np.array([[1.0, 2.0], [3.0, 4.0]])[:, 0]),
        Values("skipped", "1", np.array([True, False])),
    ]
    write_table(tmp_path / "cycles.parquet", columns)
    table = pq.read_table(tmp_path / "cycles.parquet")
    assert {field.name: field.metadata[b"unit"] for field in table.schema} == {"q_1": b"rad", "skipped": b"1"}
    assert table["q_1"].to_pylist() == [1.0, 3.0]


def test_a_folder_that_cannot_be_written_to_is_refused_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("torquerig.record.os.access", lambda _path, _mode: False)  # root may write everywhere
    with pytest.raises(RecordError, match=r"cannot write a record into .*: there is no permission"):
        claim(tmp_path)


def test_a_record_is_never_overwritten(tmp_path: Path):
    place = claim(tmp_path / "a" / "b")
    assert claim(place) == place
    (place / "run.json").touch()
    with pytest.raises(RecordError, match="is not empty, and a record is never overwritten"):
        claim(place)
    with pytest.raises(RecordError, match="cannot make the record's folder"):
        claim(place / "run.json")
