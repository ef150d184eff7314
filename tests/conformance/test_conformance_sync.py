"""SYNC: identifier, counter, length (CiA 301, 7.2.5, 7.5.2.5, 7.5.2.6 and 7.5.2.22)."""

import pytest
from conversation import golden, talk

pytestmark = pytest.mark.conformance("SYNC", "golden bytes")

START = "\n > 000#01 01"
TPDO1 = "\n < 181#50 02 00 00 00 00 00 00"
CYCLE_OFF = """
    > 601#23 06 10 00 00 00 00 00
    < 581#60 06 10 00 00 00 00 00"""
COUNTER_TO_10 = (
    CYCLE_OFF
    + """
    > 601#2F 19 10 00 0A 00 00 00
    < 581#60 19 10 00 00 00 00 00"""
)


@golden(
    {
        "an empty frame on 0x080 is SYNC": START + "\n > 080#" + TPDO1,
        "a remote frame on 0x080 is none": START + "\n > 080#R0",
        "SYNC moves to another identifier (1005)": """
            > 601#23 05 10 00 A0 00 00 00
            < 581#60 05 10 00 00 00 00 00"""
        + START
        + "\n > 080# \n > 0A0#"
        + TPDO1,
        "0609 0030 this node generates no SYNC (1005 bit 30)": """
            > 601#23 05 10 00 80 00 00 40
            < 581#80 05 10 00 30 00 09 06""",
        "0609 0030 a 29-bit or a restricted identifier (1005)": """
            > 601#23 05 10 00 80 00 00 20
            < 581#80 05 10 00 30 00 09 06
            > 601#23 05 10 00 01 06 00 00
            < 581#80 05 10 00 30 00 09 06""",
        "with a counter (1019 = 10) SYNC has one byte": COUNTER_TO_10
        + START
        + "".join(f"\n > 080#{n:02X}{TPDO1}" for n in (1, 2, 3)),
        "a TPDO of type 10 counts SYNCs, whatever the counter says": COUNTER_TO_10
        + """
            > 601#23 00 18 01 81 01 00 80
            < 581#60 00 18 01 00 00 00 00"""
        + START
        + """
            > 080#05 x9
            > 080#06
            < 281#00 00 00 00 2C 01 00 00""",
        "EMCY 8240 for a SYNC without the counter that 1019 asks for, and no TPDO": COUNTER_TO_10
        + START
        + "\n > 080# \n < 081#40 82 11 .. .. .. .. ..",
        "EMCY 8240 for a SYNC with a counter that 1019 does not ask for, and no TPDO": START
        + "\n > 080#01 \n < 081#40 82 11 .. .. .. .. ..",
        "EMCY 8240 comes once, and EMCY 0000 with the right length": START
        + """
            > 080#01
            < 081#40 82 11 .. .. .. .. ..
            > 080#01
            > 080#
            < 081#00 00 00 .. .. .. .. .."""
        + TPDO1,
        "0800 0022 for 1019 while the cycle period 1006 is set": """
            > 601#2F 19 10 00 0A 00 00 00
            < 581#80 19 10 00 22 00 00 08"""
        + COUNTER_TO_10,
        "1019 is 0 or 2 to 240": CYCLE_OFF
        + """
            > 601#2F 19 10 00 01 00 00 00
            < 581#80 19 10 00 30 00 09 06
            > 601#2F 19 10 00 F1 00 00 00
            < 581#80 19 10 00 31 00 09 06
            > 601#2F 19 10 00 F0 00 00 00
            < 581#60 19 10 00 00 00 00 00
            > 601#2F 19 10 00 02 00 00 00
            < 581#60 19 10 00 00 00 00 00
            > 601#2F 19 10 00 00 00 00 00
            < 581#60 19 10 00 00 00 00 00""",
    }
)
def test_sync(line, golden):
    talk(line, golden.text)
