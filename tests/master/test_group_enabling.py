"""Enabling: concurrent, atomic, by the controlwords of CiA 402; and what is reset or refused before it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from torquerig.driver.errors import DriveFault, EnablingRefused, NoAnswer
from torquerig.driver.wire.cia402 import DriveState
from torquerig.driver.wire.sdo import AbortCode

MS = 1_000_000
PERIOD = 4 * MS


def without_repeats(items: list[bytes]) -> list[bytes]:
    return [item for place, item in enumerate(items) if place == 0 or item != items[place - 1]]


def test_a_run_sends_the_controlwords_of_cia_402_and_no_torque_but_the_commanded(rig):
    """Typed from CiA 402: disable voltage 0, shutdown 6, switch on 7, enable operation F; 0.1 N·m is 2010 = 07DAh."""
    with rig.group() as group:
        group.enable()
        due = group.now_ns() + PERIOD
        group.sample(due)
        group.command(np.array([0.1, -0.1, 0.0]), due + MS)
    frames = [bytes.fromhex(text) for text in ("00000000", "06000000", "07000000", "0F000000", "0F00DA07", "00000000")]
    assert without_repeats(rig.bus.sent_to(0x201)) == frames
    assert b"\x0f\x00\x26\xf8" in rig.bus.sent_to(0x202)


def test_a_drive_visits_the_states_in_order_and_ends_disabled(rig):
    with rig.group() as group:
        group.enable()
        assert [axis.state for axis in group.axes] == [DriveState.OPERATION_ENABLED] * 3
    for drive in rig.drives.values():
        assert [state.words for state in drive.visited] == [
            "switch on disabled",
            "ready to switch on",
            "switched on",
            "operation enabled",
            "switch on disabled",
        ]


def test_all_drives_are_enabled_by_rpdos_of_the_same_cycle(rig):
    with rig.group() as group:
        group.enable()
        enabling = [at for at, frame in rig.bus.log if 0x201 <= frame.can_id <= 0x203 and frame.data[0] == 0x0F]
        assert enabling[2] - enabling[0] < PERIOD // 2


def test_a_drive_that_does_not_switch_on_keeps_all_others_from_operation(rig):
    rig.drives[2].barred = {3}
    with rig.group() as group, pytest.raises(EnablingRefused) as refusal:
        group.enable()
    assert "drive 2 stays in 'ready to switch on'" in str(refusal.value)
    assert "'switched on'" in str(refusal.value)
    for drive in rig.drives.values():
        assert DriveState.OPERATION_ENABLED not in drive.visited
        assert drive.state is DriveState.SWITCH_ON_DISABLED


def test_a_drive_that_does_not_go_the_last_step_takes_all_others_back(rig):
    rig.drives[3].barred = {4}
    with rig.group() as group:
        with pytest.raises(EnablingRefused, match="drive 3 stays in 'switched on'"):
            group.enable()
        assert all(axis.is_disabled for axis in group.axes)


def test_a_drive_that_falls_into_fault_while_walking_is_told_in_words(rig):
    rig.drives[1].fault_at_state = {DriveState.SWITCHED_ON: 0x3220}
    with rig.group() as group, pytest.raises(DriveFault, match=r"drive 1 is in fault: DC link undervoltage \(0x3220\)"):
        group.enable()
    assert all(DriveState.OPERATION_ENABLED not in drive.visited for drive in rig.drives.values())


def test_old_communication_faults_are_reset_and_named(rig):
    for node_id, code in ((1, 0x8250), (2, 0x8130), (3, 0xFF01)):
        rig.drives[node_id].fault(code, told=False)
    with rig.group() as group:
        notices = group.enable()
    assert notices == [
        "drive 1 was in fault since communication was lost: RPDO timeout (0x8250); reset",
        "drive 2 was in fault since communication was lost: heartbeat or life guarding lost (0x8130); reset",
        "drive 3 was in fault since communication was lost: stopped because a sibling drive stopped (0xFF01); reset",
    ]


def test_a_second_enable_has_nothing_to_tell(rig):
    rig.drives[1].fault(0x8700, told=False)
    with rig.group() as group:
        assert len(group.enable()) == 1
        group.wait(0.01)
        assert group.enable() == []


def test_any_other_fault_is_refused_in_words_and_not_reset(rig):
    rig.drives[2].fault(0x7310, told=False)
    rig.drives[1].fault(0xFF01, told=False)
    with rig.group() as group, pytest.raises(DriveFault) as refusal:
        group.enable()
    assert str(refusal.value) == "drive 2 is in fault: overspeed (0x7310)"
    assert rig.drives[2].state is DriveState.FAULT
    assert rig.drives[1].state is DriveState.FAULT


def test_a_fault_whose_code_is_nowhere_but_in_the_history_is_known(rig):
    rig.drives[2].fault(0, told=False)
    rig.drives[2].values[0x1003, 1] = 0x0000_4310
    with rig.group() as group, pytest.raises(DriveFault, match="drive over-temperature"):
        group.enable()


def test_a_fault_without_any_code_is_no_communication_fault(rig):
    rig.drives[2].fault(0, told=False)
    with rig.group() as group, pytest.raises(DriveFault, match="drive 2 is in fault: it does not say why"):
        group.enable()


def test_a_fault_that_stays_after_its_reset_is_told(rig):
    rig.drives[3].fault(0x8250, told=False)
    rig.drives[3].barred = {15}
    with rig.group() as group, pytest.raises(DriveFault, match=r"RPDO timeout \(0x8250\), also after a reset"):
        group.enable()


def test_a_watchdog_that_was_disarmed_meanwhile_refuses_enabling(rig):
    with rig.group() as group:
        rig.drives[2].values[0x1400, 5] = 0
        with pytest.raises(EnablingRefused) as refusal:
            group.enable()
        assert "drive 2 holds 0 in 1400:5" in str(refusal.value)
        assert "not 12 (0xc)" in str(refusal.value)
    assert DriveState.READY_TO_SWITCH_ON not in rig.drives[1].visited


def test_a_watchdog_that_cannot_be_armed_refuses_the_group(rig):
    rig.drives[3].refused[0x1400, 5] = AbortCode.READ_ONLY
    with pytest.raises(EnablingRefused, match=r"drive 3 refuses 12 .* in 1400:5 .*Event timer.*: attempt to write"):
        rig.group().__enter__()


def test_a_watchdog_that_forgets_its_value_refuses_the_group(rig):
    rig.drives[1].forgotten.add((0x1016, 1))
    with pytest.raises(EnablingRefused, match="drive 1 holds 0 in 1016:1"):
        rig.group().__enter__()


def test_a_drive_that_shows_another_mode_is_not_driven(rig):
    with rig.group() as group:
        rig.drives[2].values[0x6060, 0] = 4
        with pytest.raises(EnablingRefused, match=r"drive 2 shows mode of operation 4 \(6061\), where 10 is needed"):
            group.enable()
        assert all(axis.is_disabled for axis in group.axes)


def test_silent_drives_are_named_with_how_long_was_waited(rig):
    rig.drives[1].mute = {"sdo"}
    rig.drives[3].mute = {"sdo"}
    with pytest.raises(NoAnswer, match=r"^no answer from drives 1 and 3 within 0.9 s\b"):
        rig.group().__enter__()


def test_a_drive_without_process_data_is_named(rig):
    rig.drives[2].mute = {"sync"}
    with pytest.raises(NoAnswer, match="no process data from drive 2 within 2 s"):
        rig.group().__enter__()


def test_sync_and_rpdos_go_on_while_drives_are_asked_and_enabled(rig):
    with rig.group() as group:
        group.enable()
        start = group.now_ns()
        for _ in range(100):
            group.read(1, 0x1018, 2)
        syncs = [at for at, frame in rig.bus.log if frame.can_id == 0x080]
        assert group.now_ns() - start > 2 * PERIOD
        assert {later - earlier for earlier, later in pairwise(syncs)} == {PERIOD}
        rpdos = [at for at, frame in rig.bus.log if frame.can_id == 0x201]
        assert max(later - earlier for earlier, later in pairwise(rpdos)) <= 2 * PERIOD


def test_the_masters_heartbeat_goes_on_every_40_ms(rig):
    with rig.group() as group:
        group.enable()
        group.wait(1.0)
        beats = [at for at, frame in rig.bus.log if frame.can_id == 0x77F and frame.data == b"\x05"]
    assert {later - earlier for earlier, later in pairwise(beats)} == {40 * MS}
