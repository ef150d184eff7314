"""A server that never ends an upload costs a master what the object may hold, and no more."""

from __future__ import annotations

import pytest

from torquerig.driver.errors import ConfigurationMismatch
from torquerig.driver.master.faults import read_fault
from torquerig.driver.master.objects import DriveObjects
from torquerig.driver.master.pump import Pump
from torquerig.driver.master.scan import scan
from torquerig.driver.master.sdo_jobs import SdoService, Upload
from torquerig.driver.wire.dictionary import DRIVE_EDS
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sdo import AbortCode, SdoAbort

SEGMENTS_OF_A_NUMBER = 2  # 8 bytes need two; what comes with the second is too much


class EndlessDrive:
    """Answers every upload with segments of which none is the last."""

    node_id = 1

    def __init__(self) -> None:
        self.segments = 0
        self.farewells: list[bytes] = []

    def hear(self, frame: Frame) -> list[Frame]:
        if frame.can_id != 0x601:
            return []
        if frame.data[0] == 0x80:
            self.farewells.append(frame.data)
            return []
        if frame.data[0] == 0x40:
            return [Frame(0x581, frame.data[:4] + bytes(4))]
        self.segments += 1
        return [Frame(0x581, bytes((frame.data[0] & 0x10,)) + b"endless")]


@pytest.fixture
def endless() -> EndlessDrive:
    return EndlessDrive()


@pytest.fixture
def bus(fake_bus, endless):
    return fake_bus([endless])


def test_a_number_takes_two_segments_at_most(bus, endless):
    objects = DriveObjects(1, DRIVE_EDS)
    with pytest.raises(SdoAbort) as abort:
        SdoService(Pump(bus)).run({1: objects.read(0x6076)})
    assert abort.value.code == AbortCode.OUT_OF_MEMORY
    assert endless.segments == SEGMENTS_OF_A_NUMBER
    assert endless.farewells == [bytes.fromhex("80 76 60 00 05 00 04 05")]


def test_a_setting_that_is_read_back_without_an_end_is_a_mismatch(bus):
    objects = DriveObjects(1, DRIVE_EDS)
    with pytest.raises(ConfigurationMismatch, match="does not say what 6076"):
        SdoService(Pump(bus)).run({1: objects.verify(0x6076, 0, 319)})


def test_a_fault_is_asked_for_in_numbers(bus, endless):
    with pytest.raises(SdoAbort):
        SdoService(Pump(bus)).run({1: read_fault(1)})
    assert endless.segments == SEGMENTS_OF_A_NUMBER


def test_a_scan_takes_neither_numbers_nor_names_without_an_end(bus, endless):
    (node,) = scan(bus)
    assert node.identity is not None
    assert node.identity.vendor is None
    assert node.identity.name is None
    assert endless.segments < 200


def test_whoever_does_not_know_the_object_takes_a_megabyte(bus, endless):
    def job():
        yield Upload(0x1021)

    with pytest.raises(SdoAbort):
        SdoService(Pump(bus)).run({1: job()})
    assert endless.segments * 7 > 1 << 20
