"""EMCY: golden frames, words, and which codes come of lost communication."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.wire import emcy
from torquerig.driver.wire.emcy import Emergency, EmergencyCode
from torquerig.driver.wire.frame import Frame

# protocol write EMCY: COB-ID 0x80 + node-id; bytes 0 and 1 the error code, low byte first; byte 2 the error register;
# bytes 3 to 7 the manufacturer's
GOLDEN = [
    (Emergency(1, 0x8250, 0x11), Frame(0x081, b"\x50\x82\x11\x00\x00\x00\x00\x00")),
    (Emergency(2, 0x8700, 0x11, b"\x01\x02\x03\x04\x05"), Frame(0x082, b"\x00\x87\x11\x01\x02\x03\x04\x05")),
    (Emergency(3, 0xFF01, 0x81), Frame(0x083, b"\x01\xff\x81\x00\x00\x00\x00\x00")),
    (Emergency(127, 0x0000, 0x00), Frame(0x0FF, bytes(8))),
]


@pytest.mark.parametrize(("emergency", "frame"), GOLDEN)
def test_emergencies_are_the_standards_frames_both_ways(emergency, frame):
    assert emcy.encode(emergency) == frame
    assert emcy.decode(frame) == emergency


def test_an_emergency_follows_its_cob_id():
    frame = emcy.encode(Emergency(1, 0x8250, 0x11), cob_id=0x90)
    assert frame.can_id == 0x90
    assert emcy.decode_payload(1, frame.data) == Emergency(1, 0x8250, 0x11)


@pytest.mark.parametrize(
    "frame",
    [
        Frame(0x080, bytes(8)),  # SYNC's identifier
        Frame(0x100, bytes(8)),
        Frame(0x081, bytes(7)),
        Frame(0x081, bytes(8), remote=True),
        Frame(0x081, bytes(8), extended=True),
    ],
)
def test_what_is_no_emergency_decodes_to_none(frame):
    assert emcy.decode(frame) is None


@pytest.mark.parametrize(
    ("emergency", "datum"),
    [
        (Emergency(0, 0, 0), "not 0"),
        (Emergency(1, 0x10000, 0), "65536"),
        (Emergency(1, 0, 256), "256"),
        (Emergency(1, 0, 0, b"1234"), "not 4"),
    ],
)
def test_a_callers_mistake_names_the_datum(emergency, datum):
    with pytest.raises(ValueError, match=datum):
        emcy.encode(emergency)


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (0x0000, "no error, or the error is gone"),
        (0x8130, "heartbeat or life guarding lost"),
        (0x8131, "communication"),
        (0x8300, "monitoring"),
        (0x2310, "continuous overcurrent at the output"),
        (0x2399, "current at the device's output"),
        (0x2999, "current"),
        (0xFF02, "device-specific error"),
        (0xA000, "unknown error"),
    ],
)
def test_words_are_as_specific_as_the_standard(code, words):
    assert emcy.describe(code) == words


def test_every_code_of_the_drive_has_words_of_its_own():
    words = [emcy.describe(code) for code in EmergencyCode]
    assert len(set(words)) == len(words)
    assert "unknown error" not in words


def test_the_drive_knows_the_codes_of_the_servo_protocol():
    codes = {0x2310, 0x2350, 0x3210, 0x3220, 0x4210, 0x4310, 0x7305, 0x7310, 0x8130, 0x8250, 0x8700, 0xFF01, 0}
    assert codes <= {int(code) for code in EmergencyCode}


@pytest.mark.parametrize("code", [0x8110, 0x8130, 0x81FF, 0x8210, 0x8250, 0x8700, 0xFF01])
def test_communication_codes_are_told_from_the_drives_own(code):
    assert emcy.is_communication(code)


@pytest.mark.parametrize("code", [0x0000, 0x2310, 0x7310, 0x8000, 0x8300, 0x8611, 0x8701, 0xFF00, 0xFF02])
def test_the_drives_own_codes_are_no_communication_codes(code):
    assert not emcy.is_communication(code)


@pytest.mark.parametrize(
    ("code", "register"),
    [
        (0x0000, 0x00),
        (0x2310, 0x03),
        (0x3220, 0x05),
        (0x4310, 0x09),
        (0x8250, 0x11),
        (0x7310, 0x21),
        (0xFF01, 0x81),
    ],
)
def test_the_error_register_has_the_generic_bit_and_the_class(code, register):
    assert emcy.register_bits(code) == register


@given(
    st.builds(
        Emergency,
        st.integers(1, 127),
        st.integers(0, 0xFFFF),
        st.integers(0, 0xFF),
        st.binary(min_size=5, max_size=5),
    )
)
def test_emergencies_survive_the_round_trip(emergency):
    assert emcy.decode(emcy.encode(emergency)) == emergency


@given(st.integers())
def test_any_number_has_words(code):
    assert emcy.describe(code)
    emcy.is_communication(code)
