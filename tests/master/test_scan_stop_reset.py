"""What a person at the machine can do without a group: see who is there, stop all, clear faults."""

from __future__ import annotations

from itertools import pairwise

import pytest

from torquerig.driver.errors import DriveError, DriveFault, NoAnswer
from torquerig.driver.master.scan import Identity, scan
from torquerig.driver.master.stop import reset, stop
from torquerig.driver.wire import nmt
from torquerig.driver.wire.cia402 import DriveState
from torquerig.driver.wire.nmt import NmtState

MS = 1_000_000


def enabled(rig) -> None:
    for drive in rig.drives.values():
        drive.nmt = NmtState.OPERATIONAL
        drive.go(DriveState.OPERATION_ENABLED)
        drive.values[0x2071, 0] = 4000


def test_a_scan_finds_every_node_with_state_identity_and_name(rig):
    rig.bus.inject(rig.bus.now_ns() + 50 * MS, nmt.encode_heartbeat(2, NmtState.PRE_OPERATIONAL))
    nodes = scan(rig.bus)
    assert [node.node_id for node in nodes] == [1, 2, 3]
    assert [node.state for node in nodes] == [None, NmtState.PRE_OPERATIONAL, None]
    assert nodes[2].identity == Identity(0x00020192, 0, 1, 0x00010000, 3, "torquerig simulated torque drive")


def test_a_scan_asks_all_node_ids_within_a_third_of_a_second_and_no_two_at_once(rig):
    start = rig.bus.now_ns()
    scan(rig.bus)
    assert rig.bus.now_ns() - start < 333 * MS
    first = [at for at, frame in rig.bus.log if frame.data[:4] == bytes.fromhex("40001000")]
    assert len(first) == 127
    assert min(later - earlier for earlier, later in pairwise(first)) >= 500_000


def test_a_node_that_only_beats_is_listed_too(rig):
    rig.drives[3].mute = {"sdo"}
    rig.bus.inject(rig.bus.now_ns() + MS, nmt.encode_heartbeat(3, NmtState.STOPPED))
    assert [(node.node_id, node.state, node.identity is None) for node in scan(rig.bus)] == [
        (1, None, False),
        (2, None, False),
        (3, NmtState.STOPPED, True),
    ]


def test_a_node_without_a_name_is_listed_without_it(rig):
    del rig.drives[1].texts[0x1008, 0]
    identity = scan(rig.bus)[0].identity
    assert identity is not None
    assert identity.name is None


def test_an_empty_bus_has_no_nodes(fake_bus):
    assert scan(fake_bus()) == []


def test_stop_takes_the_torque_away_first_and_disables_by_every_road(rig):
    enabled(rig)
    sentences = stop(rig.bus, rig.axes)
    assert sentences == [f"drive {node_id} is in 'switch on disabled'" for node_id in (1, 2, 3)]
    assert [frame for _, frame in rig.bus.log[:3]] == [(0x200 + n, bytes(4), False, False) for n in (1, 2, 3)]
    assert bytes.fromhex("2B40600000000000") in rig.bus.sent_to(0x602)
    assert [data.hex() for data in rig.bus.sent_to(0x000)] == ["8001", "8002", "8003"]
    assert all(drive.values[0x2071, 0] == 0 for drive in rig.drives.values())


def test_stop_tells_of_a_silent_drive_after_stopping_the_others(rig):
    enabled(rig)
    rig.drives[2].mute = {"sdo"}
    with pytest.raises(NoAnswer, match=r"no answer from drive 2 within 0\.2 s"):
        stop(rig.bus, rig.axes)
    assert {drive.state for drive in rig.drives.values()} == {DriveState.SWITCH_ON_DISABLED}
    assert {drive.nmt for drive in rig.drives.values()} == {NmtState.PRE_OPERATIONAL}


def test_stop_tells_of_a_drive_that_does_not_obey(rig):
    enabled(rig)
    rig.drives[1].barred = {9}
    with pytest.raises(DriveError, match="drive 1 was told to disable, but is in 'operation enabled'"):
        stop(rig.bus, rig.axes)


def test_reset_clears_any_fault_and_says_what_it_was(rig):
    rig.drives[1].fault(0x7310, told=False)
    rig.drives[3].fault(0xFF01, told=False)
    assert reset(rig.bus, [1, 2, 3]) == [
        "drive 1 was in fault: overspeed (0x7310); reset",
        "drive 2 was in no fault",
        "drive 3 was in fault: stopped because a sibling drive stopped (0xFF01); reset",
    ]
    assert {drive.state for drive in rig.drives.values()} == {DriveState.SWITCH_ON_DISABLED}


def test_reset_is_a_rising_edge_of_bit_7_also_where_it_was_set_before(rig):
    rig.drives[1].fault(0x7310, told=False)
    rig.drives[1].values[0x6040, 0] = 0x80
    reset(rig.bus, [1])
    assert [data for data in rig.bus.sent_to(0x601) if data[:4] == bytes.fromhex("2B406000")] == [
        bytes.fromhex("2B40600000000000"),
        bytes.fromhex("2B40600080000000"),
        bytes.fromhex("2B40600000000000"),
    ]


def test_a_fault_whose_cause_stays_is_told(rig):
    rig.drives[2].fault(0x4310, told=False)
    rig.drives[2].barred = {15}
    with pytest.raises(DriveFault, match=r"drive 2 is in fault: drive over-temperature \(0x4310\), also after a reset"):
        reset(rig.bus, [1, 2])
