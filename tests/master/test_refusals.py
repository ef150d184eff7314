"""The refusal counters of drives, read by a master: all at once, and of those that have them."""

from __future__ import annotations

import pytest

from torquerig.driver.errors import BusError
from torquerig.driver.master.objects import DriveObjects
from torquerig.driver.master.profile import load_profile
from torquerig.driver.master.pump import Pump
from torquerig.driver.master.refusals import RefusalCounters, read_refusals
from torquerig.driver.master.sdo_jobs import SdoService
from torquerig.driver.wire.dictionary import DRIVE_EDS


@pytest.fixture
def drives():
    profile = load_profile()
    return {node_id: RefusalCounters(DriveObjects(node_id, DRIVE_EDS), profile) for node_id in (1, 2, 3)}


def test_counters_have_the_names_of_the_eds(rig, drives):
    rig.drives[2].values[0x2140, 3] = 17
    counts = read_refusals(SdoService(Pump(rig.bus)), drives)
    assert counts[2]["NMT commands malformed"] == 17
    assert sum(counts[1].values()) == 0
    assert len(counts[3]) == 14


def test_a_drive_of_another_make_a_silent_one_and_one_that_refuses_have_none(rig, drives):
    rig.drives[1].values[0x1018, 2] = 7
    rig.drives[2].mute = {"sdo"}
    del rig.drives[3].values[0x2140, 5]
    assert read_refusals(SdoService(Pump(rig.bus)), drives) == {1: None, 2: None, 3: None}


def test_a_profile_without_counters_asks_nothing(rig, drives):
    nanotec = RefusalCounters(drives[1].objects, load_profile("nanotec", eds=DRIVE_EDS))
    assert read_refusals(SdoService(Pump(rig.bus)), {1: nanotec}) == {1: None}
    assert rig.bus.log == []


def test_a_bus_that_is_gone_is_an_error(rig, drives):
    rig.bus.gone = True
    with pytest.raises(BusError):
        read_refusals(SdoService(Pump(rig.bus)), drives)
