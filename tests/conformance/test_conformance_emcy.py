"""EMCY, the error register and the error history (CiA 301, 7.2.7, 7.5.2.2, 7.5.2.4 and 7.5.2.15).

The simulation's own object 2F00 makes the errors: 1 overcurrent, 2 encoder, 3 motor and 4 device too hot, 5 DC link too
low, 6 too high, 0 all in order again.
"""

import pytest
from conversation import golden, talk

pytestmark = pytest.mark.conformance("EMCY", "golden bytes")

MADE = "\n < 581#60 00 2F 00 00 00 00 00"


def make(error: int, emergency: str) -> str:
    return f"\n > 601#23 00 2F 00 {error:02X} 00 00 00\n < 081#{emergency}" + MADE


def silently(error: int) -> str:
    return f"\n > 601#23 00 2F 00 {error:02X} 00 00 00" + MADE


def controlword(value: str) -> str:
    return f"\n > 601#2B 40 60 00 {value} 00 00 00"


def reads(multiplexer: str, value: str) -> str:
    specifier = {1: "4F", 2: "4B", 4: "43"}[len(value.split())]
    padded = value + " 00" * (4 - len(value.split()))
    return f"\n > 601#40 {multiplexer} 00 00 00 00\n < 581#{specifier} {multiplexer} {padded}"


WRITTEN = "\n < 581#60 40 60 00 00 00 00 00"
LOWERED = controlword("00") + WRITTEN
RESET = LOWERED + controlword("80") + "\n < 081#00 00 00 00 00 00 00 00" + WRITTEN
RESET_IN_VAIN = LOWERED + controlword("80") + WRITTEN
OVERCURRENT = "10 23 03 .. .. .. .. .."


@golden(
    {
        "2310 overcurrent: register bits 0 and 1": make(1, OVERCURRENT) + reads("01 10 00", "03"),
        "7305 encoder: register bits 0 and 5, for it is the profile's code": make(2, "05 73 21 .. .. .. .. .."),
        "4310 motor too hot: register bits 0 and 3": make(3, "10 43 09 .. .. .. .. ..") + reads("01 10 00", "09"),
        "4210 device too hot: register bits 0 and 3": make(4, "10 42 09 .. .. .. .. ..") + reads("01 10 00", "09"),
        "3220 DC link too low: register bits 0 and 2": make(5, "20 32 05 .. .. .. .. ..") + reads("01 10 00", "05"),
        "3210 DC link too high: register bits 0 and 2": make(6, "10 32 05 .. .. .. .. ..") + reads("01 10 00", "05"),
        "an error is told once": make(4, "10 42 09 .. .. .. .. ..") + silently(4),
        "the register adds up the errors that are there": make(6, "10 32 05 .. .. .. .. ..")
        + """
            > 000#01 01
            > 201#06
            < 081#10 82 15 .. .. .. .. .."""
        + reads("01 10 00", "15"),
        "603F holds the code until the fault is reset": make(1, OVERCURRENT)
        + reads("3F 60 00", "10 23")
        + RESET
        + reads("3F 60 00", "00 00"),
        "0000 when the last error is gone, and the register is 0": make(1, OVERCURRENT)
        + RESET
        + reads("01 10 00", "00"),
        "no reset while the cause is there": make(3, "10 43 09 .. .. .. .. ..")
        + RESET_IN_VAIN
        + reads("01 10 00", "09")
        + silently(0)
        + RESET,
        "EMCY moves to another identifier by way of bit 31 (1014)": """
            > 601#23 14 10 00 81 00 00 80
            < 581#60 14 10 00 00 00 00 00
            > 601#23 14 10 00 A1 00 00 00
            < 581#60 14 10 00 00 00 00 00
            > 601#23 00 2F 00 01 00 00 00
            < 0A1#10 23 03 .. .. .. .. .."""
        + MADE,
        "no EMCY while bit 31 of 1014 is set, but history and register": """
            > 601#23 14 10 00 81 00 00 80
            < 581#60 14 10 00 00 00 00 00"""
        + silently(1)
        + reads("01 10 00", "03")
        + reads("03 10 01", "10 23 00 00"),
        "0609 0030 another identifier while EMCY exists, a 29-bit or a restricted one (1014)": """
            > 601#23 14 10 00 A1 00 00 00
            < 581#80 14 10 00 30 00 09 06
            > 601#23 14 10 00 81 00 00 20
            < 581#80 14 10 00 30 00 09 06
            > 601#23 14 10 00 81 00 00 80
            < 581#60 14 10 00 00 00 00 00
            > 601#23 14 10 00 01 07 00 00
            < 581#80 14 10 00 30 00 09 06""",
    }
)
def test_emcy(line, golden):
    talk(line, golden.text)


NO_ENTRY = "\n > 601#40 03 10 {:02X} 00 00 00 00\n < 581#80 03 10 {:02X} 24 00 00 08"


@golden(
    {
        "is empty at first": reads("03 10 00", "00") + "".join(NO_ENTRY.format(n, n) for n in range(1, 9)),
        "has the newest error first": make(1, OVERCURRENT)
        + reads("03 10 00", "01")
        + reads("03 10 01", "10 23 00 00")
        + RESET
        + make(6, "10 32 05 .. .. .. .. ..")
        + reads("03 10 00", "02")
        + reads("03 10 01", "10 32 00 00")
        + reads("03 10 02", "10 23 00 00")
        + NO_ENTRY.format(3, 3),
        "does not count the reset of an error": make(1, OVERCURRENT) + RESET + reads("03 10 00", "01"),
        "keeps eight, and loses the oldest": make(5, "20 32 05 .. .. .. .. ..")
        + silently(0)
        + RESET
        + (make(1, OVERCURRENT) + RESET) * 7
        + reads("03 10 00", "08")
        + reads("03 10 08", "20 32 00 00")
        + make(1, OVERCURRENT)
        + reads("03 10 00", "08")
        + reads("03 10 08", "10 23 00 00")
        + reads("03 10 01", "10 23 00 00"),
        "is cleared by writing 0 to its count": make(1, OVERCURRENT)
        + """
            > 601#2F 03 10 00 00 00 00 00
            < 581#60 03 10 00 00 00 00 00"""
        + reads("03 10 00", "00")
        + NO_ENTRY.format(1, 1),
        "0609 0030 for any other count, and nothing is cleared": make(1, OVERCURRENT)
        + """
            > 601#2F 03 10 00 01 00 00 00
            < 581#80 03 10 00 30 00 09 06"""
        + reads("03 10 00", "01"),
        "0601 0002 for writing an entry": make(1, OVERCURRENT)
        + """
            > 601#23 03 10 01 00 00 00 00
            < 581#80 03 10 01 02 00 01 06""",
    }
)
def test_history(line, golden):
    talk(line, golden.text)
