"""Stopping: one drive's trouble stops all at once, and every road out of the group ends disabled and confirmed."""

from __future__ import annotations

import numpy as np
import pytest

from torquerig.driver.errors import BusError, DriveError, DriveFault, NoAnswer, SecondMaster
from torquerig.driver.wire import emcy, nmt
from torquerig.driver.wire.cia402 import DriveState
from torquerig.driver.wire.emcy import Emergency
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.nmt import NmtState

MS = 1_000_000
PERIOD = 4 * MS
PUSH = np.array([0.2, 0.2, 0.2])
ZERO = bytes(4)


def lead(rig, body) -> None:
    """Let a body have a group that runs, and leave it."""
    with rig.group() as group:
        body(group, run(group))


def cycle(group, due: int) -> int:
    group.sample(due)
    group.command(PUSH, due + MS)
    return due + PERIOD


def run(group, cycles: int = 5) -> int:
    group.enable()
    due = group.now_ns() + PERIOD
    for _ in range(cycles):
        due = cycle(group, due)
    return due


def rpdos(rig, since: int = 0) -> list[Frame]:
    return [frame for at, frame in rig.bus.log if at >= since and 0x201 <= frame.can_id <= 0x203]


def assert_left_disabled(rig):
    for drive in rig.drives.values():
        assert drive.state in {DriveState.SWITCH_ON_DISABLED, DriveState.FAULT}
        assert drive.values[0x2071, 0] == 0
        assert drive.nmt is NmtState.PRE_OPERATIONAL
    assert [frame.data for frame in rpdos(rig)[-3:]] == [ZERO] * 3


@pytest.mark.parametrize("failure", [RuntimeError("boom"), KeyboardInterrupt(), SystemExit(15)])
def test_whatever_leaves_the_group_ends_at_zero_torque_and_disabled(rig, failure):
    def fail(_group, _due):
        assert rpdos(rig)[-1].data != ZERO
        raise failure

    with pytest.raises(type(failure)):
        lead(rig, fail)
    assert_left_disabled(rig)


def test_leaving_sends_zero_torque_and_disable_voltage_before_anything_else(rig):
    with rig.group() as group:
        run(group)
        left = len(rig.bus.log)
    assert [(frame.can_id, frame.data) for _, frame in rig.bus.log[left : left + 3]] == [
        (0x201, ZERO),
        (0x202, ZERO),
        (0x203, ZERO),
    ]


def test_leaving_asks_every_drive_for_its_statusword(rig):
    with rig.group() as group:
        run(group)
        left = len(rig.bus.log)
    asked = {frame.can_id for _, frame in rig.bus.log[left:] if frame.data[:4] == bytes.fromhex("40416000")}
    assert asked == {0x601, 0x602, 0x603}


def test_a_faulty_statusword_stops_all_drives_before_anything_is_asked(rig):
    with rig.group() as group:
        due = run(group)
        rig.drives[2].fault(0x7310, told=False)
        sent = len(rig.bus.log)
        with pytest.raises(DriveFault) as fault:
            cycle(group, due)
        assert str(fault.value) == "drive 2 is in fault: overspeed (0x7310)"
        after = [(frame.can_id, frame.data) for _, frame in rig.bus.log[sent:] if frame.can_id != 0x77F]
        assert after[:4] == [(0x080, b""), (0x201, ZERO), (0x202, ZERO), (0x203, ZERO)]
    assert_left_disabled(rig)


def test_an_emergency_stops_the_group_before_the_next_torque_goes_out(rig):
    with rig.group() as group:
        due = run(group)
        group.sample(due)
        rig.drives[3].fault(0x2310, told=False)
        rig.bus.inject(due + 2 * MS, emcy.encode(Emergency(3, 0x2310, 3)))
        with pytest.raises(DriveFault, match="drive 3 is in fault: continuous overcurrent"):
            group.command(PUSH, due + 3 * MS)
        assert rpdos(rig)[-1].data == ZERO
    assert_left_disabled(rig)


def test_siblings_that_stopped_are_told_as_such(rig):
    with rig.group() as group:
        due = run(group)
        rig.drives[2].fault(0x7305)
        for node_id in (1, 3):
            rig.drives[node_id].fault(0xFF01)
        with pytest.raises(DriveFault) as fault:
            cycle(group, due)
    assert str(fault.value).splitlines()[0] == (
        "drive 2 is in fault: encoder fault (0x7305); drives 1 and 3 stopped because a sibling did"
    )


def test_a_warning_emergency_of_an_enabled_drive_stops_the_group_too(rig):
    with rig.group() as group:
        due = run(group)
        rig.bus.inject(due, emcy.encode(Emergency(1, 0x8210, 17)))
        with pytest.raises(DriveFault, match=r"drive 1 PDO too short, not processed \(0x8210\)"):
            cycle(group, due)
    assert_left_disabled(rig)


def test_a_drive_that_restarts_stops_the_group(rig):
    with rig.group() as group:
        due = run(group)
        rig.bus.inject(due, nmt.encode_heartbeat(2, NmtState.BOOT_UP))
        with pytest.raises(DriveFault, match="drive 2 restarted"):
            cycle(group, due)
    assert_left_disabled(rig)


def test_a_drive_that_leaves_nmt_operational_stops_the_group(rig):
    with rig.group() as group:
        due = run(group)
        rig.bus.inject(due, nmt.encode_heartbeat(2, NmtState.STOPPED))
        with pytest.raises(DriveFault, match="drive 2 left NMT operational: it is stopped"):
            cycle(group, due)


def test_three_missing_answers_are_tolerated_and_the_fourth_is_not(rig):
    with rig.group() as group:
        due = run(group)
        rig.drives[1].mute = {"sync"}
        for _ in range(3):
            sample = group.sample(due)
            group.command(PUSH, due + 3 * MS)
            assert not sample.complete
            due += PERIOD
        with pytest.raises(NoAnswer, match="drive 1 left 4 SYNCs in a row unanswered"):
            group.sample(due)
        assert group.cycle_counts.missed == [4, 0, 0]
        assert rpdos(rig)[-1].data == ZERO
        rig.drives[1].mute = set()
    assert_left_disabled(rig)


def test_a_missing_answer_repeats_the_sample_and_ends_at_half_a_period(rig):
    with rig.group() as group:
        due = run(group)
        rig.drives[2].encoder = 500
        rig.drives[2].mute = {"sync"}
        rig.drives[1].encoder = 200_000
        sample = group.sample(due)
        assert group.now_ns() == due + PERIOD // 2
        assert sample.q[0] == pytest.approx(2 * np.pi)
        assert sample.q[1] == 0.0


def test_answers_come_back_to_life(rig):
    with rig.group() as group:
        due = run(group)
        for _ in range(4):
            rig.drives[1].mute = {"sync"}
            for _ in range(3):
                due = cycle(group, due)
            rig.drives[1].mute = set()
            due = cycle(group, due)


def test_a_lost_bus_is_told_with_what_stops_the_drives_now(rig):
    def unplug(_group, _due):
        rig.bus.gone = True

    with pytest.raises(BusError) as lost:
        lead(rig, unplug)
    assert "nobody could see the drives disabled" in str(lost.value)
    assert "12 ms after the last command" in str(lost.value)


def test_a_bus_lost_in_the_middle_keeps_the_first_error_and_notes_the_rest(rig):
    def unplug(group, due):
        rig.bus.gone = True
        group.sample(due)

    with pytest.raises(BusError) as lost:
        lead(rig, unplug)
    assert "the interface is gone" in str(lost.value)
    assert "their watchdogs have to stop them" in lost.value.__notes__[0]


def test_a_drive_that_does_not_confirm_is_named_and_the_others_are_stopped_all_the_same(rig):
    def silence(_group, _due):
        rig.drives[2].mute = {"sdo", "sync"}

    with pytest.raises(NoAnswer, match=r"no answer from drive 2 within 0\.2 s"):
        lead(rig, silence)
    assert_left_disabled(rig)


def test_a_drive_that_stays_enabled_is_told(rig):
    def bar(_group, _due):
        rig.drives[1].barred = {9, 5, 8}

    with pytest.raises(DriveError, match="drive 1 was told to disable, but is in 'operation enabled'"):
        lead(rig, bar)


def test_a_second_interrupt_while_leaving_does_not_keep_the_drives_enabled(rig):
    interrupts = iter([True])

    def interrupt(frame: Frame) -> None:
        if frame.can_id == 0x601 and frame.data[:3] == b"\x2b\x40\x60" and next(interrupts, False):
            raise KeyboardInterrupt

    def arm(_group, _due):
        rig.bus.on_send = interrupt

    with pytest.raises(KeyboardInterrupt):
        lead(rig, arm)
    assert_left_disabled(rig)


def test_a_torque_that_is_no_number_is_not_sent(rig):
    with rig.group() as group:
        due = run(group)
        group.sample(due)
        sent = len(rpdos(rig))
        with pytest.raises(ValueError, match="nan is no torque"):
            group.command(np.array([0.1, np.nan, 0.1]), due)
        assert len(rpdos(rig)) == sent


def test_raw_counts_are_exchanged_as_they_are(rig):
    with rig.group() as group:
        group.enable()
        due = group.now_ns() + PERIOD
        group.sample_raw(due)
        group.command_raw([8000, -3500, 0], due)
        sample = group.sample_raw(due + PERIOD)
        assert sample.torques.tolist() == [8000, -3500, 0]
        with pytest.raises(ValueError, match="40000 does not fit object 2071:0"):
            group.command_raw([0, 0, 40000], due + PERIOD)


def test_another_master_in_the_middle_of_a_run_stops_the_group(rig):
    with rig.group() as group:
        due = run(group)
        rig.bus.inject(due, Frame(0x080))
        with pytest.raises(SecondMaster, match="another master speaks on the bus: it sends SYNC"):
            cycle(group, due)
    assert_left_disabled(rig)
