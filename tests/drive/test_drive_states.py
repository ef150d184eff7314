"""The power state machine by statuswords and controlwords typed from CiA 402: what leads where, and what nowhere."""

from __future__ import annotations

import pytest

MS = 1_000_000

# statusword bits 0 to 3, 5 and 6 of the states
DISABLED, READY, ON, ENABLED, QUICK_STOP, FAULT = 0x40, 0x21, 0x23, 0x27, 0x07, 0x08
# controlwords
SHUTDOWN, SWITCH_ON, ENABLE, DISABLE_VOLTAGE, QUICK, RESET = 0x06, 0x07, 0x0F, 0x00, 0x02, 0x80

# every state, with the way there, and where each command leads from it
TO_STATE = {
    DISABLED: (),
    READY: (SHUTDOWN,),
    ON: (SHUTDOWN, SWITCH_ON),
    ENABLED: (SHUTDOWN, SWITCH_ON, ENABLE),
    QUICK_STOP: (SHUTDOWN, SWITCH_ON, ENABLE, QUICK),
    FAULT: ("fault",),
}
LEADS_TO = {
    DISABLED: {SHUTDOWN: READY, SWITCH_ON: DISABLED, ENABLE: DISABLED, DISABLE_VOLTAGE: DISABLED, QUICK: DISABLED},
    READY: {SHUTDOWN: READY, SWITCH_ON: ON, ENABLE: ENABLED, DISABLE_VOLTAGE: DISABLED, QUICK: DISABLED},
    ON: {SHUTDOWN: READY, SWITCH_ON: ON, ENABLE: ENABLED, DISABLE_VOLTAGE: DISABLED, QUICK: DISABLED},
    ENABLED: {SHUTDOWN: READY, SWITCH_ON: ON, ENABLE: ENABLED, DISABLE_VOLTAGE: DISABLED, QUICK: QUICK_STOP},
    QUICK_STOP: {
        SHUTDOWN: QUICK_STOP,
        SWITCH_ON: QUICK_STOP,
        ENABLE: ENABLED,
        DISABLE_VOLTAGE: DISABLED,
        QUICK: QUICK_STOP,
    },
    FAULT: {SHUTDOWN: FAULT, SWITCH_ON: FAULT, ENABLE: FAULT, DISABLE_VOLTAGE: FAULT, QUICK: FAULT, RESET: DISABLED},
}
CASES = [(state, command, target) for state, commands in LEADS_TO.items() for command, target in commands.items()]


def command_by_sdo(bench, controlword: int) -> None:
    bench.write(0x6040, controlword, 2)


def command_by_rpdo(bench, controlword: int) -> None:
    bench.rpdo(controlword, 0)


@pytest.mark.parametrize("command", [command_by_sdo, command_by_rpdo])
@pytest.mark.parametrize(("state", "controlword", "target"), CASES)
def test_a_command_leads_where_the_standard_says(bench, command, state, controlword, target):
    bench.write(0x605A, 6, 2)  # stay in quick stop active, so that transition 16 exists
    for step in TO_STATE[state]:
        if step == "fault":
            bench.write(0x2F00, 1, 4)
        else:
            command(bench, step)
    assert bench.state & 0x4F == state & 0x4F
    command(bench, controlword)
    bench.wait(bench.now_ns + 20 * MS)
    mask = 0x4F if target in {DISABLED, FAULT} else 0x6F
    assert bench.state & mask == target & mask


def test_power_on_ends_in_switch_on_disabled_with_voltage_and_remote(make_bench):
    assert make_bench().statusword == 0x0250


def test_the_whole_statusword_of_a_drive_that_follows_its_target(enabled):
    assert enabled.statusword == 0x1237  # target used, remote, voltage enabled


def test_without_stay_quick_stop_ends_in_switch_on_disabled(enabled):
    enabled.rpdo(QUICK, 0)
    enabled.wait(enabled.now_ns + 20 * MS)
    assert enabled.state == DISABLED


def test_transition_16_is_barred_unless_quick_stop_stays(enabled):
    enabled.rpdo(ENABLE, 3000)
    enabled.wait(enabled.now_ns + MS)
    enabled.rpdo(QUICK, 3000)
    assert enabled.state == QUICK_STOP
    enabled.rpdo(ENABLE, 3000)
    assert enabled.state == QUICK_STOP


def test_a_fault_is_reset_by_a_rising_edge_only(bench):
    bench.rpdo(RESET, 0)
    bench.write(0x2F00, 1, 4)
    bench.rpdo(RESET, 0)
    assert bench.state & 0x4F == FAULT
    bench.rpdo(0, 0)
    bench.rpdo(RESET, 0)
    assert bench.state == DISABLED


def test_a_reset_fault_clears_the_error_code_and_says_so(bench):
    bench.write(0x2F00, 1, 4)
    assert bench.read(0x603F) == 0x2310
    assert bench.read(0x1001) == 0x03
    bench.rpdo(RESET, 0)
    assert [code for _, code in bench.emergencies] == [0x2310, 0x0000]
    assert bench.read(0x603F) == 0
    assert bench.read(0x1001) == 0


def test_a_master_that_keeps_enabling_does_not_enable_after_a_fault(enabled):
    enabled.write(0x2F00, 1, 4)
    enabled.rpdo(ENABLE, 3000)
    enabled.rpdo(RESET | ENABLE, 3000)
    enabled.rpdo(ENABLE, 3000)
    enabled.wait(enabled.now_ns + MS)
    assert enabled.state == DISABLED
    assert enabled.torque == 0.0


def test_a_drive_can_be_walked_by_sdo_in_pre_operational(make_bench):
    bench = make_bench()
    for controlword in (SHUTDOWN, SWITCH_ON, ENABLE):
        bench.write(0x6040, controlword, 2)
    assert bench.state == ENABLED


@pytest.mark.parametrize(
    ("index", "refused"),
    [
        (0x605A, (3, 4, 7, 8)),
        (0x605D, (3, 4)),
        (0x605E, (3, 4)),
        (0x6060, (1, 3, 8, 9)),
        (0x6098, (0, 1, 17, 34)),
    ],
)
def test_options_and_modes_that_a_torque_drive_has_not_are_refused(bench, index, refused):
    size = 1 if index in {0x6060, 0x6098} else 2
    for value in refused:
        assert bench.sdo(index, 0, value.to_bytes(size, "little")) == 0x06090030
