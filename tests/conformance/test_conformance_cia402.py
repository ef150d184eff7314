"""The power state machine of CiA 402: every transition, and every command that makes none (CiA 402-2, 8.3).

Statuswords as they are read (6041, low byte first), with voltage enabled (bit 4) and remote (bit 9); bit 12 tells in
CST that the target is used.
"""

import pytest
from conversation import golden, talk

pytestmark = pytest.mark.conformance("CiA 402 states", "golden bytes")

DISABLED, READY, SWITCHED_ON, ENABLED = "50 02", "31 02", "33 02", "37 12"
STOPPING, FAULT, REACTING = "17 02", "18 02", "1F 02"
SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP, DISABLE_VOLTAGE = "06", "07", "0F", "02", "00"


def command(controlword: str) -> str:
    """Write 6040."""
    return f"\n > 601#2B 40 60 00 {controlword} 00 00 00\n < 581#60 40 60 00 00 00 00 00"


def status(statusword: str) -> str:
    """Read 6041."""
    return f"\n > 601#40 41 60 00 00 00 00 00\n < 581#4B 41 60 00 {statusword} 00 00"


def walk(*controlwords: str) -> str:
    return "".join(command(each) for each in controlwords)


def quick_stop_option(code: str) -> str:
    return f"\n > 601#2B 5A 60 00 {code} 00 00 00\n < 581#60 5A 60 00 00 00 00 00"


START = "\n > 000#01 01"
STAY = quick_stop_option("06")
OVERCURRENT = """
    > 601#23 00 2F 00 01 00 00 00
    < 081#10 23 03 .. .. .. .. ..
    < 581#60 00 2F 00 00 00 00 00"""
TO_ENABLED = START + walk(SHUTDOWN, SWITCH_ON, ENABLE)
# 1000 counts, 605E = 2 (ramp), 6087 = 1 per mille a second: the way to zero takes a minute
SLOW_FALL = """
    > 601#2B 71 20 00 E8 03 00 00
    < 581#60 71 20 00 00 00 00 00
    > 601#23 87 60 00 01 00 00 00
    < 581#60 87 60 00 00 00 00 00"""
RAMP_IN_FAULT = """
    > 601#2B 5E 60 00 02 00 00 00
    < 581#60 5E 60 00 00 00 00 00"""
TOO_HOT = """
    > 601#23 00 2F 00 04 00 00 00
    < 081#10 42 09 .. .. .. .. ..
    < 581#60 00 2F 00 00 00 00 00"""
TO = {
    DISABLED: START,
    READY: START + walk(SHUTDOWN),
    SWITCHED_ON: START + walk(SHUTDOWN, SWITCH_ON),
    ENABLED: TO_ENABLED,
    STOPPING: STAY + TO_ENABLED + command(QUICK_STOP),
    REACTING: RAMP_IN_FAULT + TO_ENABLED + SLOW_FALL + TOO_HOT,
    FAULT: START + OVERCURRENT,
}
NAMES = {
    DISABLED: "switch on disabled",
    READY: "ready to switch on",
    SWITCHED_ON: "switched on",
    ENABLED: "operation enabled",
    STOPPING: "quick stop active",
    REACTING: "fault reaction active",
    FAULT: "fault",
}


@golden(
    {
        "0, 1: after power-on the drive is in switch on disabled": status(DISABLED),
        "2: shutdown": TO[DISABLED] + command(SHUTDOWN) + status(READY),
        "3: switch on": TO[READY] + command(SWITCH_ON) + status(SWITCHED_ON),
        "3 and 4 by one command: enable operation from ready to switch on": TO[READY]
        + command(ENABLE)
        + status(ENABLED),
        "4: enable operation": TO[SWITCHED_ON] + command(ENABLE) + status(ENABLED),
        "5: disable operation": TO[ENABLED] + command(SWITCH_ON) + status(SWITCHED_ON),
        "6: shutdown from switched on": TO[SWITCHED_ON] + command(SHUTDOWN) + status(READY),
        "7: disable voltage from ready to switch on": TO[READY] + command(DISABLE_VOLTAGE) + status(DISABLED),
        "7: quick stop from ready to switch on": TO[READY] + command(QUICK_STOP) + status(DISABLED),
        "8: shutdown from operation enabled": TO[ENABLED] + command(SHUTDOWN) + status(READY),
        "9: disable voltage from operation enabled": TO[ENABLED] + command(DISABLE_VOLTAGE) + status(DISABLED),
        "10: disable voltage from switched on": TO[SWITCHED_ON] + command(DISABLE_VOLTAGE) + status(DISABLED),
        "10: quick stop from switched on": TO[SWITCHED_ON] + command(QUICK_STOP) + status(DISABLED),
        "11: quick stop": TO[STOPPING] + status(STOPPING),
        "12: disable voltage from quick stop active": TO[STOPPING] + command(DISABLE_VOLTAGE) + status(DISABLED),
        "12: by itself when the stop is done (605A = 2)": TO_ENABLED + command(QUICK_STOP) + status(DISABLED),
        "13, 14 from switch on disabled": TO[DISABLED] + OVERCURRENT + status(FAULT),
        "13, 14 from ready to switch on": TO[READY] + OVERCURRENT + status(FAULT),
        "13, 14 from switched on": TO[SWITCHED_ON] + OVERCURRENT + status(FAULT),
        "13, 14 from operation enabled": TO[ENABLED] + OVERCURRENT + status(FAULT),
        "13, 14 from quick stop active": TO[STOPPING] + OVERCURRENT + status(FAULT),
        "13: the fault reaction is a state while it lasts (605E = 2)": TO[REACTING] + status(REACTING),
        "15: fault reset, a rising edge": TO[FAULT]
        + command("80").replace("<", "< 081#00 00 00 .. .. .. .. ..\n <", 1)
        + status(DISABLED),
        "16: enable operation from quick stop active (605A = 6)": TO[STOPPING] + command(ENABLE) + status(ENABLED),
        "a disabled drive is enabled by RPDO1 as by SDO": START
        + "\n > 201#06 00 00 00\n > 201#07 00 00 00\n > 201#0F 00 00 00"
        + status(ENABLED),
    }
)
def test_transition(line, golden):
    talk(line, golden.text)


IDLE = {
    DISABLED: {
        "switch on": "07",
        "enable operation": "0F",
        "quick stop": "02",
        "disable voltage": "00",
        "fault reset": "80",
    },
    READY: {"shutdown": "06", "fault reset with shutdown": "86"},
    SWITCHED_ON: {"switch on": "07", "fault reset with switch on": "87"},
    ENABLED: {"enable operation": "0F", "fault reset with enable operation": "8F"},
    STOPPING: {"shutdown": "06", "switch on": "07", "quick stop": "02", "fault reset with quick stop": "82"},
    REACTING: {
        "shutdown": "06",
        "switch on": "07",
        "enable operation": "0F",
        "quick stop": "02",
        "disable voltage": "00",
        "fault reset": "80",
    },
    FAULT: {
        "shutdown": "06",
        "switch on": "07",
        "enable operation": "0F",
        "quick stop": "02",
        "disable voltage": "00",
    },
}


@golden(
    {
        f"{words} in {NAMES[state]}": TO[state] + command(controlword) + status(state)
        for state, commands in IDLE.items()
        for words, controlword in commands.items()
    }
)
def test_command_without_transition(line, golden):
    talk(line, golden.text)


EDGE = command("80").replace("<", "< 081#00 00 00 .. .. .. .. ..\n <", 1)


@golden(
    {
        "a bit 7 that stays set resets no second fault": TO[FAULT]
        + EDGE
        + OVERCURRENT
        + command("80")
        + status(FAULT)
        + command("00")
        + EDGE
        + status(DISABLED),
        "no fault reset while the cause is there": START
        + TOO_HOT
        + command("80")
        + status(FAULT)
        + """
            > 601#23 00 2F 00 00 00 00 00
            < 581#60 00 2F 00 00 00 00 00"""
        + status(FAULT)
        + command("00")
        + EDGE
        + status(DISABLED),
        "a reset fault leads no further, whatever else the controlword says": TO[FAULT]
        + command("8F").replace("<", "< 081#00 00 00 .. .. .. .. ..\n <", 1)
        + status(DISABLED)
        + command("0F")
        + status(DISABLED),
        "no transition 16 from a quick stop that ends in switch on disabled (605A = 2)": TO_ENABLED
        + SLOW_FALL
        + command(QUICK_STOP)
        + status(STOPPING)
        + command(ENABLE)
        + status(STOPPING),
        "a fault in quick stop active cuts a ramp that a reset does not resume": STAY
        + TO_ENABLED
        + SLOW_FALL
        + command(QUICK_STOP)
        + status(STOPPING)
        + OVERCURRENT
        + status(FAULT)
        + EDGE
        + status(DISABLED),
        "an enabled drive that is reset (NMT) is in switch on disabled": TO_ENABLED
        + """
            ~ 701#..
            > 000#81 01
            < 081#.. .. .. .. .. .. .. ..
            < 701#00"""
        + status(DISABLED),
    }
)
def test_rule(line, golden):
    talk(line, golden.text)


@golden(
    {
        "605A = 0: no ramp, switch on disabled": quick_stop_option("00")
        + TO_ENABLED
        + SLOW_FALL
        + command(QUICK_STOP)
        + status(DISABLED),
        "605A = 1: a ramp in quick stop active": quick_stop_option("01")
        + TO_ENABLED
        + SLOW_FALL
        + command(QUICK_STOP)
        + status(STOPPING),
        "605A = 1: then switch on disabled": quick_stop_option("01")
        + TO_ENABLED
        + command(QUICK_STOP)
        + status(DISABLED),
        "605A = 2: a ramp in quick stop active": TO_ENABLED + SLOW_FALL + command(QUICK_STOP) + status(STOPPING),
        "605A = 2: then switch on disabled": TO_ENABLED + command(QUICK_STOP) + status(DISABLED),
        "605A = 5: stays in quick stop active, and is enabled again": quick_stop_option("05")
        + TO_ENABLED
        + command(QUICK_STOP)
        + status(STOPPING)
        + command(ENABLE)
        + status(ENABLED),
        "605A = 6: stays in quick stop active, and is enabled again": STAY
        + TO_ENABLED
        + command(QUICK_STOP)
        + status(STOPPING)
        + command(ENABLE)
        + status(ENABLED),
        "605A = 3, 4, 7, 8 stop on limits of speed control, and are refused (0609 0030)": "".join(
            f"""
            > 601#2B 5A 60 00 {code} 00 00 00
            < 581#80 5A 60 00 30 00 09 06"""
            for code in ("03", "04", "07", "08")
        ),
        "605A below -32768 to -1 and above 8 does not exist here (0609 0032, 0609 0031)": """
            > 601#2B 5A 60 00 FF FF 00 00
            < 581#80 5A 60 00 32 00 09 06
            > 601#2B 5A 60 00 09 00 00 00
            < 581#80 5A 60 00 31 00 09 06""",
        "605D = 3, 4 and 605E = 3, 4 stop on limits of speed control, and are refused (0609 0030)": "".join(
            f"""
            > 601#2B {index} 60 00 {code} 00 00 00
            < 581#80 {index} 60 00 30 00 09 06"""
            for index in ("5D", "5E")
            for code in ("03", "04")
        ),
        "605B = 0: shutdown without a ramp": TO_ENABLED + SLOW_FALL + command(SHUTDOWN) + status(READY),
        "605B = 1: shutdown by a ramp, operation enabled until it is done": """
            > 601#2B 5B 60 00 01 00 00 00
            < 581#60 5B 60 00 00 00 00 00"""
        + TO_ENABLED
        + SLOW_FALL
        + command(SHUTDOWN)
        + status("37 02"),
        "605C = 0: disable operation without a ramp": """
            > 601#2B 5C 60 00 00 00 00 00
            < 581#60 5C 60 00 00 00 00 00"""
        + TO_ENABLED
        + SLOW_FALL
        + command(SWITCH_ON)
        + status(SWITCHED_ON),
        "605C = 1: disable operation by a ramp, operation enabled until it is done": TO_ENABLED
        + SLOW_FALL
        + command(SWITCH_ON)
        + status("37 02"),
        "605E = 0: the fault reaction is no torque": TO_ENABLED + SLOW_FALL + TOO_HOT + status(FAULT),
        "605E = 2: the fault reaction is a ramp": TO[REACTING] + status(REACTING),
    }
)
def test_option_code(line, golden):
    talk(line, golden.text)
