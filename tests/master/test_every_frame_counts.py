"""What a master hears and cannot use is counted, wherever it came to: no frame is dropped in silence."""

from __future__ import annotations

import pytest

from torquerig.driver.master.pump import Pump
from torquerig.driver.master.scan import scan_with
from torquerig.driver.master.sdo_jobs import SdoService, Upload
from torquerig.driver.wire.frame import Frame

MS = 1_000_000


def read(index: int):
    return (yield Upload(index))


@pytest.mark.parametrize(
    ("answer", "unknown", "malformed"),
    [
        (Frame(0x581, bytes.fromhex("43 18 10 01 00 00 00 00")), 1, 0),  # to another question
        (Frame(0x581, bytes.fromhex("60 00 10 00 00 00 00 00")), 1, 0),  # to a download
        (Frame(0x581, bytes.fromhex("43 00 10 00")), 0, 1),
        (Frame(0x581, bytes(8), remote=True), 1, 0),
        (Frame(0x581, bytes(8), extended=True), 1, 0),
    ],
)
def test_an_sdo_answer_of_no_use_is_counted_and_harms_nothing(rig, answer, unknown, malformed):
    pump = Pump(rig.bus)
    rig.bus.inject(rig.bus.now_ns() + 1, answer)
    assert SdoService(pump).run({1: read(0x1000)}) == {1: bytes.fromhex("92 01 02 00")}
    assert (pump.counts.unknown, pump.counts.malformed) == (unknown, malformed)


def test_a_heartbeat_that_is_none_is_counted_by_a_scan(rig):
    pump = Pump(rig.bus)
    for data in (b"", b"\x33", b"\x05\x05"):
        rig.bus.inject(rig.bus.now_ns() + MS, Frame(0x701, data))
    scan_with(pump)
    assert pump.counts.malformed == 3
