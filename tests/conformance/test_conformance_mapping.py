"""PDO mapping and COB-IDs at run time: the standard's procedure and its errors (CiA 301, 7.5.2.35 to 7.5.2.38)."""

import pytest
from conversation import golden, talk

pytestmark = pytest.mark.conformance("PDO mapping", "golden bytes")

START = "\n > 000#01 01"
TPDO1_OFF = """
    > 601#23 00 18 01 81 01 00 80
    < 581#60 00 18 01 00 00 00 00"""
TPDO1_ON = """
    > 601#23 00 18 01 81 01 00 00
    < 581#60 00 18 01 00 00 00 00"""
TPDO1_EMPTY = """
    > 601#2F 00 1A 00 00 00 00 00
    < 581#60 00 1A 00 00 00 00 00"""
TPDO1_OPEN = TPDO1_OFF + TPDO1_EMPTY
RPDO1_OPEN = """
    > 601#23 00 14 01 01 02 00 80
    < 581#60 00 14 01 00 00 00 00
    > 601#2F 00 16 00 00 00 00 00
    < 581#60 00 16 00 00 00 00 00"""


@golden(
    {
        "TPDO1 becomes the position alone": TPDO1_OPEN
        + """
            > 601#23 00 1A 01 20 00 64 60
            < 581#60 00 1A 01 00 00 00 00
            > 601#2F 00 1A 00 01 00 00 00
            < 581#60 00 1A 00 00 00 00 00"""
        + TPDO1_ON
        + START
        + """
            > 080#
            < 181#00 00 00 00""",
        "TPDO1 becomes eight objects of one byte": TPDO1_OPEN
        + "".join(
            f"""
            > 601#23 00 1A {n:02X} 08 00 61 60
            < 581#60 00 1A {n:02X} 00 00 00 00"""
            for n in range(1, 9)
        )
        + """
            > 601#2F 00 1A 00 08 00 00 00
            < 581#60 00 1A 00 00 00 00 00"""
        + TPDO1_ON
        + START
        + """
            > 080#
            < 181#0A 0A 0A 0A 0A 0A 0A 0A""",
        "a TPDO is remapped while the node is operational": START
        + """
            > 080#
            < 181#50 02 00 00 00 00 00 00"""
        + TPDO1_OPEN
        + """
            > 080#
            > 601#23 00 1A 01 10 00 41 60
            < 581#60 00 1A 01 00 00 00 00
            > 601#2F 00 1A 00 01 00 00 00
            < 581#60 00 1A 00 00 00 00 00
            > 080#"""
        + TPDO1_ON
        + """
            > 080#
            < 181#50 02""",
        "RPDO2 carries another drive's torque as a dummy, then this one's": """
            > 601#2F 01 16 00 00 00 00 00
            < 581#60 01 16 00 00 00 00 00
            > 601#23 01 16 01 10 00 03 00
            < 581#60 01 16 01 00 00 00 00
            > 601#23 01 16 02 10 00 71 20
            < 581#60 01 16 02 00 00 00 00
            > 601#2F 01 16 00 02 00 00 00
            < 581#60 01 16 00 00 00 00 00
            > 601#23 01 14 01 00 02 00 00
            < 581#60 01 14 01 00 00 00 00"""
        + START
        + """
            > 200#34 12 E8 03
            > 601#40 71 20 00 00 00 00 00
            < 581#4B 71 20 00 E8 03 00 00""",
        "the mapping that was set is the mapping that is read": """
            > 601#40 00 1A 00 00 00 00 00
            < 581#4F 00 1A 00 03 00 00 00
            > 601#40 00 1A 01 00 00 00 00
            < 581#43 00 1A 01 10 00 41 60
            > 601#40 00 1A 02 00 00 00 00
            < 581#43 00 1A 02 20 00 64 60
            > 601#40 00 1A 03 00 00 00 00
            < 581#43 00 1A 03 10 00 77 20""",
    }
)
def test_procedure(line, golden):
    talk(line, golden.text)


def entry(value: str, abort: str) -> str:
    return f"\n > 601#23 00 1A 01 {value}\n < 581#80 00 1A 01 {abort}"


@golden(
    {
        "0602 0000 a missing object": TPDO1_OPEN + entry("10 00 FF 5F", "00 00 02 06"),
        "0602 0000 a missing sub-index": TPDO1_OPEN + entry("20 09 18 10", "00 00 02 06"),
        "0604 0041 an object that is not mappable (1017)": TPDO1_OPEN + entry("10 00 17 10", "41 00 04 06"),
        "0604 0041 a string (1008)": TPDO1_OPEN + entry("40 00 08 10", "41 00 04 06"),
        "0604 0041 a length that is not the object's (6041 with 8 bits)": TPDO1_OPEN
        + entry("08 00 41 60", "41 00 04 06"),
        "0604 0041 a dummy in a TPDO": TPDO1_OPEN + entry("10 00 03 00", "41 00 04 06"),
        "0604 0041 a read-only object in an RPDO (6041)": RPDO1_OPEN
        + """
            > 601#23 00 16 01 10 00 41 60
            < 581#80 00 16 01 41 00 04 06""",
        "0602 0000 a dummy that the EDS does not declare (0001, boolean)": RPDO1_OPEN
        + """
            > 601#23 00 16 01 01 00 01 00
            < 581#80 00 16 01 00 00 02 06""",
        "0604 0042 more than eight bytes": TPDO1_OPEN
        + "".join(
            f"""
            > 601#23 00 1A {n:02X} 20 00 64 60
            < 581#60 00 1A {n:02X} 00 00 00 00"""
            for n in (1, 2, 3)
        )
        + """
            > 601#2F 00 1A 00 03 00 00 00
            < 581#80 00 1A 00 42 00 04 06
            > 601#40 00 1A 00 00 00 00 00
            < 581#4F 00 1A 00 00 00 00 00""",
        "0602 0000 more objects counted than were entered": """
            > 601#2F 02 1A 00 01 00 00 00
            < 581#80 02 1A 00 00 00 02 06""",
        "0609 0031 a count of nine, or of a multiplexed PDO": TPDO1_OPEN
        + """
            > 601#2F 00 1A 00 09 00 00 00
            < 581#80 00 1A 00 31 00 09 06
            > 601#2F 00 1A 00 FE 00 00 00
            < 581#80 00 1A 00 31 00 09 06""",
        "0800 0022 the count while the PDO is enabled": """
            > 601#2F 00 1A 00 00 00 00 00
            < 581#80 00 1A 00 22 00 00 08
            > 601#2F 00 16 00 00 00 00 00
            < 581#80 00 16 00 22 00 00 08""",
        "0800 0022 an entry while the PDO is enabled": entry("20 00 64 60", "22 00 00 08"),
        "0800 0022 an entry while the count is not 0": TPDO1_OFF + entry("20 00 64 60", "22 00 00 08"),
        "a refused entry leaves the mapping as it was": entry("10 00 FF 5F", "22 00 00 08")
        + """
            > 601#40 00 1A 01 00 00 00 00
            < 581#43 00 1A 01 10 00 41 60"""
        + START
        + """
            > 080#
            < 181#50 02 00 00 00 00 00 00""",
    }
)
def test_error(line, golden):
    talk(line, golden.text)


def cob_id(value: str, answer: str = "60 00 18 01 00 00 00 00") -> str:
    return f"\n > 601#23 00 18 01 {value}\n < 581#{answer}"


REFUSED = "80 00 18 01 30 00 09 06"


@golden(
    {
        "a TPDO moves to another identifier by way of bit 31": TPDO1_OFF
        + cob_id("A1 01 00 00")
        + START
        + """
            > 080#
            < 1A1#50 02 00 00 00 00 00 00""",
        "an RPDO moves to another identifier by way of bit 31": """
            > 601#23 00 14 01 01 02 00 80
            < 581#60 00 14 01 00 00 00 00
            > 601#23 00 14 01 21 02 00 00
            < 581#60 00 14 01 00 00 00 00"""
        + START
        + """
            > 201#06 00 00 00
            > 601#40 40 60 00 00 00 00 00
            < 581#4B 40 60 00 00 00 00 00
            > 221#06 00 00 00
            > 601#40 40 60 00 00 00 00 00
            < 581#4B 40 60 00 06 00 00 00""",
        "a TPDO that does not exist (bit 31) is not sent": TPDO1_OFF + START + "\n > 080# x3",
        "an RPDO that does not exist (bit 31) is not taken": """
            > 601#23 00 14 01 01 02 00 80
            < 581#60 00 14 01 00 00 00 00"""
        + START
        + """
            > 201#06 00 00 00
            > 601#40 40 60 00 00 00 00 00
            < 581#4B 40 60 00 00 00 00 00""",
        "0609 0030 another identifier while the PDO exists": cob_id("A1 01 00 00", REFUSED),
        "0609 0030 a 29-bit identifier": TPDO1_OFF + cob_id("81 01 00 20", REFUSED),
        "0609 0030 a restricted identifier (NMT, SDO, error control)": TPDO1_OFF
        + cob_id("00 00 00 00", REFUSED)
        + cob_id("81 05 00 00", REFUSED)
        + cob_id("01 06 00 00", REFUSED)
        + cob_id("01 07 00 00", REFUSED),
    }
)
def test_cob_id(line, golden):
    talk(line, golden.text)
