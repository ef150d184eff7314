"""What an enabled drive does when communication fails, in virtual time.

RPDO event timer (CiA 301, 7.5.2.35), SYNC, heartbeats and 6007 (CiA 402-2). Statuswords are read by
SDO: 37 operation enabled, 17 quick stop active, 50 switch on disabled, 18 fault.
"""

import pytest
from conversation import golden
from enabled_drive import CYCLE_OFF, ENABLE, demand, status

pytestmark = pytest.mark.conformance("Times of the drive", "golden bytes at exact times", bus="bench")


@golden(
    {
        "EMCY 8250 after 1400:5 without RPDO1": """
            0 > 201#0F 00 00 00
            12 < 081#50 82 11 .. .. .. .. .."""
        + status("12", "18 02")
        + "\n 100 < .",
        "every RPDO1 begins the time anew": """
            0 > 201#0F 00 00 00
            11.9 > 201#0F 00 00 00
            23.8 > 201#0F 00 00 00
            35.8 < 081#50 82 11 .. .. .. .. ..
            100 < .""",
        "one that is too short does not": """
            0 > 201#0F 00 00 00
            10 > 201#0F 00
            10 < 081#10 82 11 .. .. .. .. ..
            12 < 081#50 82 11 .. .. .. .. ..
            100 < .""",
        "it is not watched before operation enabled": """
            0 > 201#07 00 00 00
            1000 < .""",
        "torque is zero in that tick, and stays it": """
            0 > 201#0F 00 E8 03"""
        + demand("11.9", "9C 00")
        + "\n 12 < 081#50 82 11 .. .. .. .. .."
        + demand("12", "00 00")
        + """
            13 > 201#0F 00 E8 03"""
        + demand("14", "00 00")
        + "\n 100 < .",
    }
)
def test_rpdo_watchdog(bench, golden):
    bench.prepare(CYCLE_OFF + "\n > 601#2B 00 14 05 0C 00 00 00\n < 581#60 00 14 05 00 00 00 00" + ENABLE)
    bench.follow(golden.text)


SYNC = "\n {0} > 080#\n {0} < 181#.. .. .. .. .. .. .. .."


@golden(
    {
        "EMCY 8700 after more than three periods 1006 without SYNC": SYNC.format(0)
        + "\n 12.000001 < 081#00 87 11 .. .. .. .. .."
        + status("13", "18 02")
        + "\n 100 < .",
        "SYNC after three periods is in time": SYNC.format(0)
        + SYNC.format(12)
        + "\n 24.000001 < 081#00 87 11 .. .. .. .. ..\n 100 < .",
        "it is not watched before the first SYNC": "1000 < .",
        "2120:1 = 5 makes it five periods": """
            0 > 601#2F 20 21 01 05 00 00 00
            0 < 581#60 20 21 01 00 00 00 00"""
        + SYNC.format(0)
        + "\n 20.000001 < 081#00 87 11 .. .. .. .. ..\n 100 < .",
        "1006 = 0 turns it off": """
            0 > 601#23 06 10 00 00 00 00 00
            0 < 581#60 06 10 00 00 00 00 00"""
        + SYNC.format(0)
        + "\n 1000 < .",
    }
)
def test_sync_watchdog(bench, golden):
    bench.prepare(ENABLE)
    bench.follow(golden.text)


WATCH = """
    > 601#23 16 10 01 64 00 7F 00
    < 581#60 16 10 01 00 00 00 00
    > 601#2F 29 10 01 01 00 00 00
    < 581#60 29 10 01 00 00 00 00"""
LOST = "\n 0 > 77F#05\n 100 < 081#30 81 11 .. .. .. .. .."


@golden(
    {
        "6007 = 0: goes on": "\n 0 > 601#2B 07 60 00 00 00 00 00\n 0 < 581#60 07 60 00 00 00 00 00"
        + LOST
        + status("100", "37 12")
        + "\n 200 < .",
        "6007 = 1: fault": LOST + status("100", "18 02") + "\n 200 < .",
        "6007 = 2: disable voltage": "\n 0 > 601#2B 07 60 00 02 00 00 00\n 0 < 581#60 07 60 00 00 00 00 00"
        + LOST
        + status("100", "50 02")
        + "\n 200 < .",
        "6007 = 3: quick stop, by the ramp of 605A": """
            0 > 601#2B 07 60 00 03 00 00 00
            0 < 581#60 07 60 00 00 00 00 00
            0 > 601#23 87 60 00 E8 03 00 00
            0 < 581#60 87 60 00 00 00 00 00
            0 > 201#0F 00 05 05"""
        + LOST
        + status("100", "17 02")
        + status("250", "17 02")
        + status("350", "50 02")
        + "\n 400 < .",
        "by default the node becomes pre-operational, and gives no torque (1029:1 = 0)": """
            0 > 601#2F 29 10 01 00 00 00 00
            0 < 581#60 29 10 01 00 00 00 00
            0 > 201#0F 00 E8 03"""
        + LOST
        + demand("100", "00 00")
        + """
            101 > 701#R1
            101 < 701#7F
            200 < .""",
    }
)
def test_lost_heartbeat(bench, golden):
    bench.prepare(CYCLE_OFF + WATCH + ENABLE)
    bench.follow(golden.text)


@golden(
    {
        "NMT stop": "\n 0 > 201#0F 00 E8 03\n 1 > 000#02 01\n 1 < 081#00 81 11 .. .. .. .. ..\n 2 > 000#80 01"
        + status("3", "18 02")
        + demand("3", "00 00")
        + "\n 100 < .",
        "NMT pre-operational": "\n 0 > 201#0F 00 E8 03\n 1 > 000#80 01\n 1 < 081#00 81 11 .. .. .. .. .."
        + status("1", "18 02")
        + demand("1", "00 00")
        + "\n 100 < .",
        "a start does not enable it again": "\n 1 > 000#80 01\n 1 < 081#00 81 11 .. .. .. .. ..\n 2 > 000#01 01"
        + "\n 3 > 201#0F 00 E8 03"
        + status("4", "18 02")
        + "\n 100 < .",
        "NMT reset communication": """
            0 > 201#0F 00 E8 03
            1 > 000#82 01
            1 < 081#00 81 11 .. .. .. .. ..
            2 < 701#00"""
        + demand("3", "00 00")
        + "\n 52 < 701#7F\n 60 < .",
    }
)
def test_leaving_operational_while_enabled(bench, golden):
    bench.prepare(CYCLE_OFF + ENABLE)
    bench.follow(golden.text)


@golden(
    {
        "its EMCY stops this drive: FF01": "0 > 082#10 23 03 00 00 00 00 00\n 0 < 081#01 FF 81 .. .. .. .. .."
        + status("0", "18 02")
        + "\n 100 < .",
        "its FF01 does not, or drives would latch each other": "0 > 082#01 FF 81 00 00 00 00 00"
        + status("1", "37 12")
        + "\n 100 < .",
        "its error reset does not": "0 > 082#00 00 00 00 00 00 00 00" + status("1", "37 12") + "\n 100 < .",
        "another drive's EMCY does not": "0 > 083#10 23 03 00 00 00 00 00" + status("1", "37 12") + "\n 100 < .",
    }
)
def test_watched_sibling(bench, golden):
    bench.prepare(CYCLE_OFF + "\n > 601#23 28 10 02 82 00 00 00\n < 581#60 28 10 02 00 00 00 00" + ENABLE)
    bench.follow(golden.text)
