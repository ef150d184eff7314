"""Process data: transmission types, remote frames, lengths (CiA 301, 7.2.2 and 7.5.2.37)."""

import pytest
from conversation import golden, talk

pytestmark = pytest.mark.conformance("PDO transmission", "golden bytes")

START = "\n > 000#01 01"
TPDO2_OFF = """
    > 601#23 01 18 01 81 02 00 80
    < 581#60 01 18 01 00 00 00 00"""
# TPDO3: the statusword alone, on 0x381
STATUS_TPDO3 = """
    > 601#23 02 1A 01 10 00 41 60
    < 581#60 02 1A 01 00 00 00 00
    > 601#2F 02 1A 00 01 00 00 00
    < 581#60 02 1A 00 00 00 00 00
    > 601#2F 02 18 02 {type} 00 00 00
    < 581#60 02 18 02 00 00 00 00
    > 601#23 02 18 01 81 03 00 00
    < 581#60 02 18 01 00 00 00 00
    > 601#23 00 18 01 81 01 00 80
    < 581#60 00 18 01 00 00 00 00"""
SHUTDOWN = "\n > 201#06 00 00 00"
SWITCH_ON = "\n > 201#07 00 00 00"
DISABLE_VOLTAGE = "\n > 201#00 00 00 00"
DISABLED, READY, SWITCHED_ON = "50 02", "31 02", "33 02"


def tpdo1_type(value: str) -> str:
    return f"""
        > 601#2F 00 18 02 {value} 00 00 00
        < 581#60 00 18 02 00 00 00 00"""


def rpdo1_type(value: str) -> str:
    return f"""
        > 601#2F 00 14 02 {value} 00 00 00
        < 581#60 00 14 02 00 00 00 00"""


def status_is(status: str) -> str:
    return f"""
        > 601#40 41 60 00 00 00 00 00
        < 581#4B 41 60 00 {status} 00 00"""


def every(count: int) -> str:
    """Twice so many SYNCs, each time with a TPDO1 after the last one only."""
    silent = f"\n > 080# x{count - 1}" if count > 1 else ""
    answered = "\n > 080#\n < 181#50 02 00 00 00 00 00 00"
    return TPDO2_OFF + tpdo1_type(f"{count:02X}") + START + (silent + answered) * 2


@golden({f"type {count}: at every SYNC number {count}": every(count) for count in (1, 2, 3, 10, 100, 239, 240)})
def test_cyclic_tpdo(line, golden):
    talk(line, golden.text)


@golden(
    {
        "two TPDOs of one SYNC go by their identifiers": TPDO2_OFF
        + """
            > 601#2F 01 18 02 01 00 00 00
            < 581#60 01 18 02 00 00 00 00
            > 601#23 01 18 01 81 02 00 00
            < 581#60 01 18 01 00 00 00 00"""
        + START
        + """
            > 080#
            < 181#50 02 00 00 00 00 00 00
            < 281#00 00 00 00 2C 01 00 00""",
        "type 0: at the SYNC after an event, and at no other": STATUS_TPDO3.format(type="00")
        + TPDO2_OFF
        + START
        + f"""
            > 080#
            < 381#{DISABLED}
            > 080# x3"""
        + SHUTDOWN
        + f"""
            > 080#
            < 381#{READY}
            > 080# x3""",
        "type 252: SYNC samples, a remote frame fetches the sample": STATUS_TPDO3.format(type="FC")
        + TPDO2_OFF
        + START
        + "\n > 080#"
        + SHUTDOWN
        + f"""
            > 381#R2
            < 381#{DISABLED}
            > 080#
            > 381#R2
            < 381#{READY}""",
        "type 253: a remote frame fetches what is true now": STATUS_TPDO3.format(type="FD")
        + TPDO2_OFF
        + START
        + "\n > 080#"
        + SHUTDOWN
        + f"""
            > 381#R2
            < 381#{READY}""",
        "type 254: at an event": STATUS_TPDO3.format(type="FE")
        + START
        + f"\n < 381#{DISABLED}"
        + SHUTDOWN
        + f"\n < 381#{READY}"
        + SHUTDOWN
        + SWITCH_ON
        + f"\n < 381#{SWITCHED_ON}",
        "type 255: at an event": STATUS_TPDO3.format(type="FF")
        + START
        + f"\n < 381#{DISABLED}"
        + SHUTDOWN
        + f"\n < 381#{READY}"
        + SHUTDOWN
        + SWITCH_ON
        + f"\n < 381#{SWITCHED_ON}",
        "type 255: SYNC is no event": STATUS_TPDO3.format(type="FF")
        + TPDO2_OFF
        + START
        + f"""
            < 381#{DISABLED}
            > 080# x3""",
        "types 241 to 251 are refused": "".join(
            f"""
            > 601#2F 00 18 02 {n:02X} 00 00 00
            < 581#80 00 18 02 30 00 09 06"""
            for n in range(241, 252)
        ),
        "types 0 to 240 and 252 to 255 are accepted and read back": "".join(
            tpdo1_type(f"{n:02X}")
            + f"""
            > 601#40 00 18 02 00 00 00 00
            < 581#4F 00 18 02 {n:02X} 00 00 00"""
            for n in (0, 1, 2, 120, 239, 240, 252, 253, 254, 255)
        ),
        "the inhibit time changes only while the TPDO does not exist": """
            > 601#2B 00 18 03 64 00 00 00
            < 581#80 00 18 03 30 00 09 06
            > 601#23 00 18 01 81 01 00 80
            < 581#60 00 18 01 00 00 00 00
            > 601#2B 00 18 03 64 00 00 00
            < 581#60 00 18 03 00 00 00 00
            > 601#40 00 18 03 00 00 00 00
            < 581#4B 00 18 03 64 00 00 00""",
    }
)
def test_tpdo(line, golden):
    talk(line, golden.text)


AT_SYNC = (
    SHUTDOWN
    + status_is(DISABLED)
    + """
        > 080#
        < 181#50 02 00 00 00 00 00 00"""
    + status_is(READY)
    + """
        > 080#
        < 181#31 02 00 00 00 00 00 00"""
)


@golden(
    {
        **{
            f"type {n}: acts at the next SYNC, and shows in the TPDO of the one after": TPDO2_OFF
            + rpdo1_type(f"{n:02X}")
            + START
            + AT_SYNC
            for n in (0, 1, 2, 240)
        },
        **{
            f"type {n}: acts on reception": rpdo1_type(f"{n:02X}") + START + SHUTDOWN + status_is(READY)
            for n in (254, 255)
        },
        "type 1: of several frames before SYNC the last one acts": TPDO2_OFF
        + rpdo1_type("01")
        + START
        + SWITCH_ON
        + SHUTDOWN
        + """
            > 080#
            < 181#50 02 00 00 00 00 00 00"""
        + status_is(READY),
        "type 1: what waits for SYNC is forgotten when operational is left": TPDO2_OFF
        + rpdo1_type("01")
        + START
        + SHUTDOWN
        + "\n > 000#80 01"
        + START
        + """
            > 080#
            < 181#50 02 00 00 00 00 00 00"""
        + status_is(DISABLED),
        "types 241 to 251, 252 and 253 are refused": "".join(
            f"""
            > 601#2F 00 14 02 {n:02X} 00 00 00
            < 581#80 00 14 02 30 00 09 06"""
            for n in range(241, 254)
        ),
        "types 0 to 240, 254 and 255 are accepted and read back": "".join(
            rpdo1_type(f"{n:02X}")
            + f"""
            > 601#40 00 14 02 00 00 00 00
            < 581#4F 00 14 02 {n:02X} 00 00 00"""
            for n in (0, 1, 2, 120, 239, 240, 254, 255)
        ),
        "too short: EMCY 8210, and not processed": START
        + """
            > 201#06 00 00
            < 081#10 82 11 .. .. .. .. .."""
        + status_is(DISABLED),
        "too long: EMCY 8220, and processed as far as mapped": START
        + """
            > 201#06 00 00 00 FF
            < 081#20 82 11 .. .. .. .. .."""
        + status_is(READY),
        "a wrong length is told again after reset node": """
            ~ 701#7F
            > 000#01 01
            > 201#06
            < 081#10 82 11 .. .. .. .. ..
            > 000#81 01
            < 701#00
            > 000#01 01
            ~ 701#05
            > 201#06
            < 081#10 82 11 .. .. .. .. ..""",
        "the right length again: EMCY 0000": START
        + """
            > 201#06
            < 081#10 82 11 .. .. .. .. ..
            > 201#06
            > 201#06 00 00 00
            < 081#00 00 00 .. .. .. .. .."""
        + status_is(READY),
    }
)
def test_rpdo(line, golden):
    talk(line, golden.text)


@golden(
    {
        "a remote frame on a cyclic TPDO fetches it": START
        + """
            > 181#R8
            < 181#50 02 00 00 00 00 00 00""",
        "a remote frame is answered whatever length it asks for": START
        + """
            > 181#R0
            < 181#50 02 00 00 00 00 00 00""",
        "no answer when the COB-ID forbids it (bit 30)": """
            > 601#23 00 18 01 81 01 00 80
            < 581#60 00 18 01 00 00 00 00
            > 601#23 00 18 01 81 01 00 40
            < 581#60 00 18 01 00 00 00 00"""
        + START
        + "\n > 181#R8",
        "no answer for a TPDO that does not exist": START + "\n > 381#R2",
        "no answer on an RPDO's identifier": START + "\n > 201#R4",
    }
)
def test_remote_frame(line, golden):
    talk(line, golden.text)
