"""The adapters' lines, against strings of the makers' manuals and of the kernel's driver; and what is no line."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.bus.slcan_codec import SPEEDS, AcceptanceFilter, bit_rate_of, decode_frame, encode_frame
from torquerig.driver.wire.frame import Frame

# the first four: Lawicel's manuals, under t, T, r and R; the others: the comment in Linux' slcan driver
GOLDEN = {
    b"t10021133": Frame(0x100, b"\x11\x33"),
    b"T0000010021133": Frame(0x100, b"\x11\x33", extended=True),
    b"r1002": Frame(0x100, bytes(2), remote=True),
    b"R000001002": Frame(0x100, bytes(2), remote=True, extended=True),
    b"t1230": Frame(0x123),
    b"t4563112233": Frame(0x456, b"\x11\x22\x33"),
    b"T12ABCDEF2AA55": Frame(0x12ABCDEF, b"\xaa\x55", extended=True),
    b"r1230": Frame(0x123, remote=True),
}

frames = st.builds(
    lambda extended, remote, number, data: Frame(
        number & (0x1FFF_FFFF if extended else 0x7FF), bytes(len(data)) if remote else data, remote, extended
    ),
    st.booleans(),
    st.booleans(),
    st.integers(0, 0x1FFF_FFFF),
    st.binary(max_size=8),
)


@pytest.mark.parametrize(
    ("line", "frame"), GOLDEN.items(), ids=lambda each: each.decode() if type(each) is bytes else ""
)
def test_a_frame_and_its_line_are_as_the_manual_has_them(line: bytes, frame: Frame) -> None:
    assert encode_frame(frame) == line + b"\r"
    assert decode_frame(line) == frame


def test_small_letters_mean_the_same_numbers() -> None:
    assert decode_frame(b"T12abcdef2aA5f") == Frame(0x12ABCDEF, b"\xaa\x5f", extended=True)


def test_a_time_stamp_stands_behind_the_data() -> None:
    assert encode_frame(Frame(0x100, b"\x11\x33"), stamp_ms=19815) == b"t100211334D67\r"
    assert encode_frame(Frame(0x100, remote=True), stamp_ms=59_999) == b"r1000EA5F\r"
    assert encode_frame(Frame(0x100), stamp_ms=7) == b"t10000007\r"


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"t",
        b"t1",
        b"t100",
        b"t1009" + b"00" * 9,  # nine bytes
        b"t8000",  # an identifier of twelve bits
        b"T200000000",  # of thirty
        b"t100211",  # a byte too few
        b"t1002113344",  # one too many
        b"t10021133\n",
        b"t100211 3",
        b"t+102",
        b"t1_02",
        b"t10x0",
        b"t100211+3",
        b"r100211",  # a remote frame carries nothing
        b"r10021133",
        b"d10021133",  # a frame of CAN FD
        b" t1230",
        b"t123\xb2",  # a superscript two, which is a digit to some
        b"T1230",
        b"t00000100",
    ],
)
def test_what_is_no_line_gives_no_frame(line: bytes) -> None:
    assert decode_frame(line) is None


@given(frames)
def test_every_frame_comes_back_from_its_line(frame: Frame) -> None:
    assert decode_frame(encode_frame(frame)[:-1]) == frame


@given(st.binary(max_size=30))
def test_no_bytes_make_the_decoder_raise(line: bytes) -> None:
    frame = decode_frame(line)
    assert frame is None or encode_frame(frame)[:-1] == line.upper().replace(line[:1].upper(), line[:1], 1)


def test_speeds_are_those_of_the_manual() -> None:
    assert {0: 10_000, 4: 125_000, 6: 500_000, 7: 800_000, 8: 1_000_000}.items() <= dict(enumerate(SPEEDS)).items()


@pytest.mark.parametrize(
    ("timing", "bitrate"),
    # the manual's example of the command s, then Philips' usual values for 16 MHz
    [(0x031C, 125_000), (0x0014, 1_000_000), (0x001C, 500_000), (0x011C, 250_000), (0x0016, 800_000), (0x311C, 10_000)],
)
def test_bus_timing_registers_mean_the_bit_rate_of_a_sja1000_at_16_mhz(timing: int, bitrate: int) -> None:
    assert bit_rate_of(timing) == bitrate


@given(frames)
def test_at_power_on_every_frame_is_accepted(frame: Frame) -> None:
    assert AcceptanceFilter().accepts(frame)


class TestAcceptance:
    """The SJA1000's two filters, of which one has to let a frame pass."""

    def test_second_filter_alone_picks_a_range_of_base_frames(self) -> None:
        # AC0/AC1 ask for identifier 0 and nothing else; AC2 0x60 and AM2 0x1F for 0x300 to 0x3FF, remote or not
        accepted = AcceptanceFilter(code=0x0000_6000, mask=0x0000_1FF0)
        passing = {number for number in range(0x800) if accepted.accepts(Frame(number, b"\x01"))}
        assert passing == set(range(0x300, 0x400))
        assert accepted.accepts(Frame(0x345, bytes(2), remote=True))

    def test_first_filter_looks_at_the_first_byte_too_where_there_is_one(self) -> None:
        # filter 1: identifier 0x181, data frame, byte 0x5A; filter 2: identifier 0x7FF, data frame
        accepted = AcceptanceFilter(code=0x3025_FFEA, mask=0x0000_0000)
        assert accepted.accepts(Frame(0x181, b"\x5a\x00"))
        assert accepted.accepts(Frame(0x181))
        assert accepted.accepts(Frame(0x7FF, b"\x00"))
        assert not accepted.accepts(Frame(0x181, b"\x5b"))
        assert not accepted.accepts(Frame(0x181, remote=True))
        assert not accepted.accepts(Frame(0x182, b"\x5a"))

    def test_extended_frames_are_told_by_their_first_sixteen_bits(self) -> None:
        accepted = AcceptanceFilter(code=0x1234_ABCD, mask=0x0000_0000)
        assert accepted.accepts(Frame(0x1234 << 13 | 0x1FFF, extended=True))
        assert accepted.accepts(Frame(0xABCD << 13, extended=True))
        assert not accepted.accepts(Frame(0x1235 << 13, extended=True))
        assert not accepted.accepts(Frame(0x12CD << 13, extended=True))  # half of the one, half of the other
