"""Modes of operation, and what cyclic synchronous torque says of itself (CiA 402-2, 10 and 13.6; objects 6060 f)."""

import pytest
from conversation import golden, talk

pytestmark = pytest.mark.conformance("CiA 402 modes", "golden bytes")


def write(multiplexer: str, value: str, answer: str | None = None) -> str:
    octets = value.split()
    specifier = {1: "2F", 2: "2B", 4: "23"}[len(octets)]
    padded = " ".join(octets + ["00"] * (4 - len(octets)))
    expected = f"60 {multiplexer} 00 00 00 00" if answer is None else f"80 {multiplexer} {answer}"
    return f"\n > 601#{specifier} {multiplexer} {padded}\n < 581#{expected}"


def read(multiplexer: str, value: str) -> str:
    octets = value.split()
    specifier = {1: "4F", 2: "4B", 4: "43"}[len(octets)]
    padded = " ".join(octets + ["00"] * (4 - len(octets)))
    return f"\n > 601#40 {multiplexer} 00 00 00 00\n < 581#{specifier} {multiplexer} {padded}"


def status(statusword: str) -> str:
    return read("41 60 00", statusword)


ENABLED = "\n > 000#01 01" + "".join(write("40 60 00", each) for each in ("06 00", "07 00", "0F 00"))
PER_MILLE = write("70 20 00", "00")  # 2070 = 0: the target is 6071
MAXIMUM_100 = write("72 60 00", "64 00")  # 6072 = 100 per mille: less than the friction holds


@golden(
    {
        "the drive says which modes it has: 4, 6 and 10 (6502)": read("02 65 00", "28 02 00 00"),
        "mode 10 is displayed at power-on (6060, 6061)": read("60 60 00", "0A") + read("61 60 00", "0A"),
        "modes 4, 6 and 10 are taken and displayed": "".join(
            write("60 60 00", mode) + read("61 60 00", mode) for mode in ("04", "06", "0A")
        ),
        "0 changes no mode": write("60 60 00", "00") + read("61 60 00", "0A"),
        "0609 0030 for every mode that 6502 does not name": "".join(
            write("60 60 00", mode, "30 00 09 06")
            for mode in ("01", "02", "03", "05", "07", "08", "09", "0B", "7F", "FF")
        ),
        "the mode changes while operation is enabled": ENABLED
        + write("60 60 00", "04")
        + read("61 60 00", "04")
        + write("60 60 00", "0A")
        + status("37 12"),
    }
)
def test_mode(line, golden):
    talk(line, golden.text)


@golden(
    {
        "bit 12 is 0 while the drive is not enabled": "\n > 000#01 01"
        + status("50 02")
        + write("40 60 00", "06 00")
        + status("31 02")
        + write("40 60 00", "07 00")
        + status("33 02"),
        "bit 12 is 1 while the drive follows its target": ENABLED + status("37 12"),
        "bit 12 is 0 while the drive is halted (controlword bit 8), and 1 again after": ENABLED
        + write("40 60 00", "0F 01")
        + status("37 02")
        + write("40 60 00", "0F 00")
        + status("37 12"),
        "bit 12 is 0 in a quick stop": write("5A 60 00", "06 00")
        + ENABLED
        + write("40 60 00", "02 00")
        + status("17 02"),
        "bit 11 is 0 while the target is within the limits": PER_MILLE
        + MAXIMUM_100
        + ENABLED
        + write("71 60 00", "64 00")
        + status("37 12"),
        "bit 11 is 1 while 6072 limits the target": PER_MILLE
        + MAXIMUM_100
        + ENABLED
        + write("71 60 00", "65 00")
        + status("37 1A")
        + write("71 60 00", "9B FF")
        + status("37 1A"),
        "bit 11 is 1 while 60E0 limits the positive target, and not the negative": PER_MILLE
        + write("E0 60 00", "32 00")
        + ENABLED
        + write("71 60 00", "33 00")
        + status("37 1A")
        + write("71 60 00", "CD FF")
        + status("37 12"),
        "bit 11 is 1 while 60E1 limits the negative target, and not the positive": PER_MILLE
        + write("E1 60 00", "32 00")
        + ENABLED
        + write("71 60 00", "CD FF")
        + status("37 1A")
        + write("71 60 00", "33 00")
        + status("37 12"),
        "the demand is the limit, with its sign (6074)": PER_MILLE
        + MAXIMUM_100
        + ENABLED
        + write("71 60 00", "E8 03")
        + read("74 60 00", "64 00")
        + write("71 60 00", "18 FC")
        + read("74 60 00", "9C FF"),
        "target and offset add up (6071, 60B2)": PER_MILLE
        + ENABLED
        + write("71 60 00", "32 00")
        + write("B2 60 00", "0A 00")
        + read("74 60 00", "3C 00"),
        "no demand outside operation enabled": PER_MILLE + write("71 60 00", "32 00") + read("74 60 00", "00 00"),
        "no demand in quick stop active at its end": write("5A 60 00", "06 00")
        + PER_MILLE
        + ENABLED
        + write("71 60 00", "32 00")
        + write("87 60 00", "00 00 00 10")
        + write("40 60 00", "02 00")
        + read("74 60 00", "00 00"),
    }
)
def test_cst(line, golden):
    talk(line, golden.text)


@golden(
    {
        "homing on the current position: bit 12 attained, bit 8 referenced, 6064 is 607C (method 37)": write(
            "60 60 00", "06"
        )
        + write("98 60 00", "25")
        + write("7C 60 00", "39 30 00 00")
        + ENABLED
        + status("37 06")
        + write("40 60 00", "1F 00")
        + status("37 17")
        + read("64 60 00", "39 30 00 00"),
        "0609 0030 for a homing method that the drive does not have": write("98 60 00", "01", "30 00 09 06"),
        "profile torque: bit 10, target reached": write("60 60 00", "04") + ENABLED + status("37 06"),
    }
)
def test_other_mode(line, golden):
    talk(line, golden.text)
