"""Torque profile, halt, quick stop and the other ways to zero torque: steps of 100 us along the slope 6087."""

from __future__ import annotations

import pytest

MS = 1_000_000
US = 1_000
STEP = 30 * 0.319e-3 * 20100  # counts: 300000 per mille/s in 100 us


@pytest.fixture
def pushing(enabled, machine):
    """0.5 N·m, 10335 counts, are flowing; time is 10 ms."""
    enabled.rpdo(0x0F, 10335, 9 * MS)
    enabled.wait(10 * MS)
    assert enabled.torque == 0.5
    machine.commands.clear()
    return enabled


def ramp_of(machine) -> list[tuple[int, float]]:
    return [(at_ns, torque * (20670 if torque >= 0 else 19528)) for at_ns, _, torque in machine.commands]


def expect_ramp_down(machine, from_ns: int) -> None:
    """The first step a period after the start, STEP counts each, the last one to exactly zero."""
    ramp = ramp_of(machine)
    full = int(10335 / STEP)
    assert [at_ns for at_ns, _ in ramp] == [from_ns + (k + 1) * 100 * US for k in range(full + 1)]
    assert [counts for _, counts in ramp[:-1]] == pytest.approx([10335 - (k + 1) * STEP for k in range(full)])
    assert ramp[-1][1] == 0.0


@pytest.mark.parametrize(("option", "state"), [(1, 0x40), (2, 0x40), (5, 0x07), (6, 0x07)])
def test_quick_stop_ramps_with_the_slope_and_then_stays_or_not(pushing, machine, option, state):
    pushing.write(0x605A, option, 2)
    pushing.rpdo(0x02, 10335)
    assert pushing.state == 0x07
    pushing.wait(30 * MS)
    expect_ramp_down(machine, 10 * MS)
    assert pushing.state == state


def test_quick_stop_0_cuts(pushing, machine):
    pushing.write(0x605A, 0, 2)
    pushing.rpdo(0x02, 10335)
    assert machine.commands == [(10 * MS, 0, 0.0)]
    assert pushing.state == 0x40


def test_targets_are_ignored_while_quick_stop_is_active(pushing):
    pushing.write(0x605A, 6, 2)
    pushing.rpdo(0x02, 10335)
    pushing.rpdo(0x02, 3000, 20 * MS)
    pushing.wait(40 * MS)
    assert pushing.torque == 0.0


def test_disable_voltage_cuts_even_during_a_quick_stop(pushing):
    pushing.rpdo(0x02, 0)
    pushing.rpdo(0x00, 0, 11 * MS)
    assert pushing.torque == 0.0
    assert pushing.state == 0x40


def test_disable_operation_ramps_by_default_and_ends_in_switched_on(pushing, machine):
    pushing.rpdo(0x07, 10335)
    assert pushing.state == 0x27
    pushing.rpdo(0x07, 10335, 12 * MS)
    pushing.wait(30 * MS)
    expect_ramp_down(machine, 10 * MS)
    assert pushing.state == 0x23


def test_shutdown_cuts_by_default_and_ramps_if_605b_says_so(pushing, machine):
    pushing.write(0x605B, 1, 2)
    pushing.rpdo(0x06, 10335)
    pushing.wait(30 * MS)
    expect_ramp_down(machine, 10 * MS)
    assert pushing.state == 0x21
    machine.commands.clear()
    pushing.write(0x605B, 0, 2)
    pushing.rpdo(0x0F, 10335)
    pushing.wait(31 * MS)
    pushing.rpdo(0x06, 10335)
    assert pushing.torque == 0.0
    assert pushing.state == 0x21


def test_halt_ramps_to_zero_and_its_end_returns_to_the_target(pushing, machine):
    pushing.rpdo(0x10F, 10335)
    assert not pushing.statusword & 0x1000
    pushing.wait(30 * MS)
    expect_ramp_down(machine, 10 * MS)
    assert pushing.state == 0x27
    pushing.rpdo(0x0F, 10335)
    pushing.wait(31 * MS)
    assert pushing.torque == 0.5
    assert pushing.statusword & 0x1000


def test_torque_profile_ramps_to_its_target_and_says_when_it_is_reached(enabled, machine):
    enabled.write(0x6060, 4, 1)
    assert enabled.read(0x6061) == 4
    machine.commands.clear()
    enabled.rpdo(0x0F, 5 * 193, 10 * MS)
    assert not enabled.statusword & 0x0400
    enabled.wait(30 * MS)
    assert enabled.statusword & 0x0400
    ramp = ramp_of(machine)
    assert [at_ns for at_ns, _ in ramp] == [10 * MS + (k + 1) * 100 * US for k in range(6)]
    assert ramp[0][1] == pytest.approx(STEP)
    assert ramp[-1][1] == pytest.approx(965)


def test_a_profile_target_beyond_the_limit_is_reached_at_the_limit(enabled):
    enabled.write(0x6060, 4, 1)
    enabled.rpdo(0x0F, -32768, 10 * MS)
    enabled.wait(40 * MS)
    assert enabled.torque == pytest.approx(-0.98)
    assert enabled.statusword & 0x0C00 == 0x0C00


def test_no_event_is_left_when_a_ramp_is_over(enabled):
    enabled.write(0x6060, 4, 1)
    enabled.rpdo(0x0F, 3000, 10 * MS)
    enabled.wait(40 * MS)
    assert enabled.drive.next_event_ns() == 50 * MS  # the supervision of the slow protections


def test_a_fault_reaction_1_ramps_and_then_is_in_fault(pushing, machine):
    pushing.write(0x605E, 1, 2)
    pushing.write(0x2F00, 3, 4)
    assert pushing.statusword & 0x4F == 0x0F
    pushing.wait(30 * MS)
    expect_ramp_down(machine, 10 * MS)
    assert pushing.statusword & 0x4F == 0x08


@pytest.mark.parametrize("method", [37, 35])
def test_homing_makes_the_position_the_home_offset_and_references_it(enabled, machine, method):
    machine.angle[0] = 1.0
    enabled.write(0x607C, -1234, 4)
    enabled.write(0x6098, method, 1)
    enabled.write(0x6060, 6, 1)
    assert enabled.statusword & 0x3500 == 0x0400  # not started
    enabled.write(0x6040, 0x1F, 2)
    assert enabled.statusword & 0x3500 == 0x1500  # attained, reached, referenced
    assert enabled.read(0x6064) == -1234
    assert enabled.torque == 0.0


def test_homing_of_a_turning_motor_fails(enabled, machine):
    machine.velocity[0] = 10.0
    enabled.write(0x6060, 6, 1)
    enabled.write(0x6040, 0x1F, 2)
    assert enabled.statusword & 0x3500 == 0x2400
    machine.velocity[0] = 0.0
    enabled.write(0x6040, 0x0F, 2)
    enabled.write(0x6040, 0x1F, 2)
    assert enabled.statusword & 0x3500 == 0x1500


def test_homing_starts_in_operation_enabled_only(bench):
    bench.write(0x6060, 6, 1)
    bench.write(0x6040, 0x16, 2)
    assert bench.statusword & 0x3500 == 0x0400


def test_the_reference_is_lost_by_reset_node_and_power_cycle_and_kept_by_reset_communication(enabled):
    def home() -> None:
        enabled.write(0x6060, 6, 1)
        for controlword in (0x06, 0x07, 0x0F, 0x1F, 0x00):
            enabled.write(0x6040, controlword, 2)
        assert enabled.statusword & 0x0100

    home()
    enabled.hear(0x000, b"\x82\x01")
    enabled.wait(enabled.now_ns + 2 * MS)
    assert enabled.statusword & 0x0100
    enabled.hear(0x000, b"\x81\x01")
    enabled.wait(enabled.now_ns + 2 * MS)
    assert not enabled.statusword & 0x0100
    home()
    enabled.drive.power_cycle(enabled.now_ns)
    enabled.wait(enabled.now_ns)
    assert not enabled.statusword & 0x0100


def test_a_drive_that_is_enabled_halted_gives_no_torque_even_for_an_instant(bench, machine):
    bench.write(0x1400, 1, 1, 2)
    for k, controlword in enumerate((0x06, 0x07, 0x10F)):
        bench.rpdo(controlword, 3000, (k + 1) * MS)
        bench.sync()
    bench.wait(20 * MS)
    assert bench.state == 0x27
    assert all(torque == 0.0 for _, _, torque in machine.commands)


def test_an_overcurrent_ends_the_ramp_of_a_fault_reaction(pushing, machine):
    pushing.write(0x605E, 1, 2)
    pushing.write(0x2F00, 3, 4)
    pushing.wait(11 * MS)
    assert pushing.torque > 0.0
    pushing.write(0x2F00, 1, 4)
    assert machine.commands[-1] == (11 * MS, 0, 0.0)
    assert pushing.statusword & 0x4F == 0x08
    assert pushing.drive.next_event_ns() == 50 * MS
