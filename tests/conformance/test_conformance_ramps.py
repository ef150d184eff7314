"""How the torque goes its way: ramps with 6087, option codes, when a target acts, in virtual time.

CiA 402-2: 605A to 605E, 6071, 6074, 6087. Statuswords are read by
SDO: 37 operation enabled, 17 quick stop active, 50 switch on disabled, 18 fault, 1F fault reaction active.
"""

import pytest
from conversation import golden
from enabled_drive import CYCLE_OFF, ENABLE, demand, status

pytestmark = pytest.mark.conformance("Times of the drive", "golden bytes at exact times", bus="bench")

SYNC = "\n {0} > 080#\n {0} < 181#.. .. .. .. .. .. .. .."
# 6071 = 300 per mille by 2070 = 0, and 6087 = 1000 per mille a second: the way to zero takes 300 ms
LOADED = """
    > 601#2F 70 20 00 00 00 00 00
    < 581#60 70 20 00 00 00 00 00
    > 601#2B 71 60 00 2C 01 00 00
    < 581#60 71 60 00 00 00 00 00
    > 601#23 87 60 00 E8 03 00 00
    < 581#60 87 60 00 00 00 00 00"""
HALFWAY, NOTHING, ALL = "96 00", "00 00", "2C 01"


def option(index: str, code: str) -> str:
    return f"\n 0 > 601#2B {index} 00 {code} 00 00 00\n 0 < 581#60 {index} 00 00 00 00 00"


@golden(
    {
        "605A = 1: quick stop by the slope, then switch on disabled": option("5A 60", "01")
        + "\n 0 > 201#02 00 00 00"
        + demand("150", HALFWAY)
        + status("299.9", "17 02")
        + status("300", "50 02")
        + demand("300", NOTHING)
        + "\n 400 < .",
        "605A = 2: quick stop by the slope, then switch on disabled": "0 > 201#02 00 00 00"
        + demand("150", HALFWAY)
        + status("299.9", "17 02")
        + status("300", "50 02")
        + demand("300", NOTHING)
        + "\n 400 < .",
        "605A = 5, 6: quick stop by the slope, and stays": option("5A 60", "06")
        + "\n 0 > 201#02 00 00 00"
        + demand("150", HALFWAY)
        + demand("300", NOTHING)
        + status("1000", "17 02")
        + "\n 1000 < .",
        "605A = 0: no torque at once": option("5A 60", "00")
        + "\n 0 > 201#02 00 00 00"
        + demand("0", NOTHING)
        + status("0", "50 02")
        + "\n 400 < .",
        "605B = 1: shutdown by the slope": option("5B 60", "01")
        + "\n 0 > 201#06 00 00 00"
        + demand("150", HALFWAY)
        + status("299.9", "37 02")
        + status("300", "31 02")
        + "\n 400 < .",
        "605C = 1: disable operation by the slope": "0 > 201#07 00 00 00"
        + demand("150", HALFWAY)
        + status("299.9", "37 02")
        + status("300", "33 02")
        + "\n 400 < .",
        "605E = 2: fault reaction by the slope": option("5E 60", "02")
        + """
            0 > 601#23 00 2F 00 04 00 00 00
            0 < 081#10 42 09 .. .. .. .. ..
            0 < 581#60 00 2F 00 00 00 00 00"""
        + demand("150", HALFWAY)
        + status("299.9", "1F 02")
        + status("300", "18 02")
        + "\n 400 < .",
        "halt by the slope, and operation stays enabled": "0 > 201#0F 01 00 00"
        + demand("150", HALFWAY)
        + demand("300", NOTHING)
        + status("300", "37 02")
        + "\n 301 > 201#0F 00 00 00"
        + demand("301", ALL)
        + status("301", "37 12")
        + "\n 400 < .",
        "disable voltage is at once, whatever ramp is under way": "0 > 201#02 00 00 00\n 100 > 201#00 00 00 00"
        + demand("100", NOTHING)
        + status("100", "50 02")
        + "\n 400 < .",
        "CST follows its target at once, whatever 6087 says": """
            0 > 601#2B 71 60 00 96 00 00 00
            0 < 581#60 71 60 00 00 00 00 00"""
        + demand("0", HALFWAY)
        + "\n 10 < .",
    }
)
def test_way_of_the_torque(bench, golden):
    bench.prepare(CYCLE_OFF + LOADED + ENABLE)
    bench.follow(golden.text)


@golden(
    {
        "the target is reached by the slope: bit 10": status("0", "37 02")
        + demand("150", HALFWAY)
        + status("299.9", "37 02")
        + status("300", "37 06")
        + demand("300", ALL)
        + "\n 400 < .",
        "a new target begins where the torque is": demand("150", HALFWAY)
        + """
            150 > 601#2B 71 60 00 00 00 00 00
            150 < 581#60 71 60 00 00 00 00 00"""
        + demand("225", "4B 00")
        + status("300.1", "37 06")
        + demand("300.1", NOTHING)
        + "\n 400 < .",
    }
)
def test_profile_torque(bench, golden):
    bench.prepare(CYCLE_OFF + LOADED + "\n > 601#2F 60 60 00 04 00 00 00\n < 581#60 60 60 00 00 00 00 00" + ENABLE)
    bench.follow(golden.text)


@golden(
    {
        "type 255: on reception": "0 > 201#0F 00 E8 03" + demand("0", "9C 00") + "\n 10 < .",
        "type 1: at SYNC": """
            0 > 601#2F 00 14 02 01 00 00 00
            0 < 581#60 00 14 02 00 00 00 00
            1 > 201#0F 00 E8 03"""
        + demand("3.9", NOTHING)
        + SYNC.format(4)
        + demand("4", "9C 00")
        + "\n 10 < .",
    }
)
def test_torque_of_an_rpdo_acts(bench, golden):
    bench.prepare(CYCLE_OFF + ENABLE)
    bench.follow(golden.text)
