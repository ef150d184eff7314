"""Loss of communication: when exactly, which EMCY, torque zero in that tick, and nothing re-enables by itself."""

from __future__ import annotations

import pytest

from torquerig.driver.wire.frame import Frame

MS = 1_000_000
US = 1_000


@pytest.fixture
def pushing(bench, machine):
    """0.5 N·m are flowing since before 10 ms; the RPDO's event timer is 12 ms; the last RPDO came at 9 ms."""
    bench.write(0x1400, 12, 2, 5)
    bench.enable()
    bench.rpdo(0x0F, 10335, 9 * MS)
    bench.wait(10 * MS)
    assert bench.torque == 0.5
    machine.commands.clear()
    return bench


def expect_fault(bench, machine, at_ns: int, code: int) -> None:
    assert bench.emergencies == [(at_ns, code)]
    assert machine.commands == [(at_ns, 0, 0.0)]
    assert bench.statusword & 0x4F == 0x08
    assert bench.read(0x603F) == code


def test_a_missing_rpdo_is_8250_and_zero_torque_at_the_last_rpdo_plus_12_ms(pushing, machine):
    pushing.wait(21 * MS - 1)
    assert pushing.emergencies == []
    pushing.wait(21 * MS)
    expect_fault(pushing, machine, 21 * MS, 0x8250)


def test_after_a_missing_rpdo_it_takes_a_reset_edge_and_the_whole_sequence(pushing):
    pushing.wait(21 * MS)
    for controlword, state in ((0x0F, 0x08), (0x8F, 0x40), (0x0F, 0x40), (0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)):
        assert pushing.torque == 0.0
        pushing.rpdo(controlword, 10335)
        mask = 0x4F if state in {0x08, 0x40} else 0x6F
        assert pushing.state & mask == state
    pushing.wait(pushing.now_ns + MS)
    assert pushing.torque == 0.5


def test_the_rpdo_watchdog_is_armed_in_operation_enabled_only(bench):
    bench.write(0x1400, 12, 2, 5)
    bench.rpdo(0x06, 0)
    bench.rpdo(0x07, 0)
    bench.wait(100 * MS)
    bench.write(0x6040, 0x0F, 2)
    bench.wait(112 * MS - 1)
    assert bench.state == 0x27
    bench.wait(112 * MS)
    assert bench.emergencies == [(112 * MS, 0x8250)]


def test_a_disabled_drive_misses_no_rpdo(pushing):
    pushing.rpdo(0x00, 0)
    pushing.wait(1000 * MS)
    assert pushing.emergencies == []


def test_missing_syncs_are_8700_after_more_than_three_periods(pushing, machine):
    pushing.write(0x1400, 0, 2, 5)
    pushing.sync(11 * MS)
    pushing.wait(23 * MS)
    assert pushing.emergencies == []
    pushing.wait(23 * MS + 1)
    expect_fault(pushing, machine, 23 * MS + 1, 0x8700)


def test_sync_is_not_missed_before_the_first_one_in_operation_enabled(bench):
    bench.sync(0)
    bench.enable()
    bench.wait(1000 * MS)
    assert bench.emergencies == []


@pytest.mark.parametrize(("index", "subindex", "size"), [(0x1006, 0, 4), (0x2120, 1, 1)])
def test_sync_is_not_missed_without_a_period_or_a_multiple(enabled, index, subindex, size):
    enabled.write(index, 0, size, subindex)
    enabled.sync()
    enabled.wait(1000 * MS)
    assert enabled.emergencies == []


def test_missed_syncs_are_counted(bench):
    for at_ms in (0, 4, 8, 20, 24):
        bench.sync(at_ms * MS)
    assert bench.read(0x2120, 3) == 2


def test_a_lost_master_heartbeat_is_8130_and_by_default_a_fault(pushing, machine):
    pushing.write(0x1400, 0, 2, 5)
    pushing.write(0x1016, 127 << 16 | 100, 4, 1)
    pushing.hear(0x77F, b"\x05")
    pushing.wait(200 * MS)
    expect_fault(pushing, machine, 110 * MS, 0x8130)


@pytest.mark.parametrize(("option", "state"), [(0, 0x40), (1, 0x08), (2, 0x40), (3, 0x40)])
def test_whatever_6007_says_there_is_no_torque_once_operational_is_left(pushing, machine, option, state):
    """1029 is 0: the communication error makes the node pre-operational."""
    pushing.write(0x6007, option, 2)
    pushing.write(0x1016, 127 << 16 | 5, 4, 1)
    pushing.hear(0x77F, b"\x05")
    pushing.wait(16 * MS)
    assert machine.commands == [(15 * MS, 0, 0.0)]
    assert pushing.state & 0x4F == state


@pytest.mark.parametrize(("option", "state"), [(0, 0x27), (1, 0x08), (2, 0x40), (3, 0x40)])
def test_6007_decides_alone_if_1029_keeps_the_node_operational(pushing, machine, option, state):
    pushing.write(0x1400, 0, 2, 5)
    pushing.write(0x1029, 1, 1, 1)
    pushing.write(0x6007, option, 2)
    pushing.write(0x1016, 127 << 16 | 5, 4, 1)
    pushing.hear(0x77F, b"\x05")
    pushing.wait(40 * MS)
    assert pushing.state & (0x6F if state == 0x27 else 0x4F) == state
    assert pushing.torque == (0.5 if option == 0 else 0.0)
    assert (len(machine.commands) > 1) is (option == 3)  # quick stop ramps, the others cut


@pytest.mark.parametrize("command", [b"\x02\x01", b"\x80\x01", b"\x81\x01", b"\x82\x01"])
def test_leaving_nmt_operational_is_zero_torque_at_once(pushing, machine, command):
    pushing.hear(0x000, command, 11 * MS)
    assert machine.commands[0] == (11 * MS, 0, 0.0)
    assert pushing.statusword & 0x4F == 0x08
    pushing.wait(20 * MS)
    pushing.hear(0x000, b"\x01\x01")
    pushing.rpdo(0x0F, 10335)
    pushing.wait(30 * MS)
    assert pushing.torque == 0.0


def test_a_quick_stop_ramp_ends_when_operational_is_left(pushing, machine):
    pushing.rpdo(0x02, 0)
    pushing.hear(0x000, b"\x80\x01", 11 * MS)
    assert machine.commands[-1] == (11 * MS, 0, 0.0)
    pushing.wait(30 * MS)
    assert machine.commands[-1] == (11 * MS, 0, 0.0)


def test_a_fault_reaction_ramp_ends_in_fault_when_operational_is_left(pushing, machine):
    pushing.write(0x605E, 2, 2)
    pushing.write(0x2F00, 4, 4)
    pushing.wait(11 * MS)
    assert pushing.statusword & 0x4F == 0x0F
    pushing.hear(0x000, b"\x02\x01", 11 * MS)
    assert machine.commands[-1] == (11 * MS, 0, 0.0)
    assert pushing.statusword & 0x4F == 0x08


def test_life_guarding_acts_like_a_lost_heartbeat(pushing, machine):
    pushing.write(0x1400, 0, 2, 5)
    pushing.write(0x100C, 10, 2)
    pushing.write(0x100D, 3, 1)
    pushing.drive.receive(Frame(0x701, b"\0", remote=True), 11 * MS)
    pushing.wait(100 * MS)
    expect_fault(pushing, machine, 41 * MS, 0x8130)


def test_a_power_cycle_ends_torque(pushing, machine):
    pushing.drive.power_cycle(11 * MS)
    pushing.wait(11 * MS)
    assert machine.commands[0] == (11 * MS, 0, 0.0)
    assert pushing.statusword == 0x0250


@pytest.mark.parametrize("code", [0x8250, 0x2310, 0x8130])
def test_a_siblings_emergency_stops_this_drive_with_ff01(pushing, machine, code):
    pushing.write(0x1028, 0x82, 4, 1)
    pushing.hear(0x082, code.to_bytes(2, "little") + bytes(6), 12 * MS)
    expect_fault(pushing, machine, 12 * MS, 0xFF01)


@pytest.mark.parametrize("code", [0x0000, 0xFF01])
def test_the_siblings_own_sibling_stop_and_its_recovery_stop_nobody(pushing, code):
    pushing.write(0x1028, 0x82, 4, 1)
    pushing.hear(0x082, code.to_bytes(2, "little") + bytes(6), 12 * MS)
    assert pushing.state == 0x27


def test_2120_2_switches_the_sibling_stop_off(pushing):
    pushing.write(0x1028, 0x82, 4, 1)
    pushing.write(0x2120, 0, 1, 2)
    pushing.hear(0x082, b"\x10\x23" + bytes(6), 12 * MS)
    assert pushing.state == 0x27


def test_a_sibling_that_leaves_operational_stops_this_drive(pushing, machine):
    pushing.write(0x1016, 2 << 16 | 100, 4, 1)
    pushing.hear(0x702, b"\x05", 10 * MS)
    pushing.hear(0x702, b"\x7f", 12 * MS)
    expect_fault(pushing, machine, 12 * MS, 0xFF01)


def test_a_lost_sibling_stops_this_drive_even_if_6007_does_nothing(pushing, machine):
    pushing.write(0x1400, 0, 2, 5)
    pushing.write(0x6007, 0, 2)
    pushing.write(0x1029, 1, 1, 1)
    pushing.write(0x1028, 0x82, 4, 1)
    pushing.write(0x1016, 2 << 16 | 10, 4, 1)
    pushing.hear(0x702, b"\x05", 10 * MS)
    pushing.wait(20 * MS)
    assert pushing.emergencies == [(20 * MS, 0x8130), (20 * MS, 0xFF01)]
    assert machine.commands == [(20 * MS, 0, 0.0)]


def test_a_disabled_drive_hears_emergencies_and_lost_heartbeats_without_a_fault(bench):
    bench.write(0x1028, 0x82, 4, 1)
    bench.write(0x1016, 127 << 16 | 10, 4, 1)
    bench.hear(0x082, b"\x10\x23" + bytes(6))
    bench.hear(0x77F, b"\x05")
    bench.wait(100 * MS)
    assert bench.emergencies == [(10 * MS, 0x8130)]
    assert bench.state == 0x40


def test_a_disabled_drive_misses_no_sync(pushing):
    pushing.sync(10 * MS)
    pushing.rpdo(0x00, 0)
    pushing.wait(1000 * MS)
    assert pushing.emergencies == []
