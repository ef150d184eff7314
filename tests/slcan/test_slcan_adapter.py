"""The adapter in the words of its manual: a conversation is what the host says, and what it hears back."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.bus.slcan_adapter import Channel, SlcanAdapter
from torquerig.driver.wire.frame import Frame

BITRATE = 1_000_000
FRAME = Frame(0x100, b"\x11\x33")
OPEN = b"S8\rO\r"
LISTEN = b"S8\rL\r"
BELL = b"\a"


def an_adapter(*said: bytes) -> SlcanAdapter:
    """Return an adapter to which something was said, and all of it done."""
    adapter = SlcanAdapter(BITRATE)
    for data in said:
        assert BELL not in adapter.hear(data).replies
    return adapter


@pytest.mark.parametrize(
    ("before", "said", "reply"),
    [
        (b"", b"S0\r", b"\r"),
        (b"", b"S8\r", b"\r"),
        (b"", b"S9\r", BELL),
        (OPEN, b"S8\r", BELL),
        (b"", b"s0014\r", b"\r"),
        (b"", b"s031C\r", b"\r"),
        (b"", b"s01\r", BELL),
        (b"", b"s0014FF\r", BELL),
        (OPEN, b"s0014\r", BELL),
        (b"", b"O\r", BELL),  # no bit rate yet
        (b"", b"L\r", BELL),
        (b"S8\r", b"O\r", b"\r"),
        (b"s0014\r", b"L\r", b"\r"),
        (OPEN, b"O\r", BELL),
        (OPEN, b"L\r", BELL),
        (LISTEN, b"O\r", BELL),
        (b"", b"C\r", BELL),
        (OPEN, b"C\r", b"\r"),
        (LISTEN, b"C\r", b"\r"),
        (OPEN, b"t10021133\r", b"z\r"),
        (OPEN, b"r1002\r", b"z\r"),
        (OPEN, b"T0000010021133\r", b"Z\r"),
        (OPEN, b"R000001002\r", b"Z\r"),
        (b"", b"t10021133\r", BELL),
        (LISTEN, b"t10021133\r", BELL),
        (OPEN, b"t100211\r", BELL),
        (OPEN, b"F\r", b"F00\r"),
        (LISTEN, b"F\r", b"F00\r"),
        (b"", b"F\r", BELL),
        (b"", b"V\r", b"V1010\r"),
        (OPEN, b"V\r", b"V1010\r"),
        (b"", b"v\r", b"v1010\r"),
        (b"", b"N\r", b"NTRIG\r"),
        (OPEN, b"N\r", b"NTRIG\r"),
        (b"", b"Z0\r", b"\r"),
        (b"", b"Z1\r", b"\r"),
        (b"", b"Z2\r", BELL),
        (OPEN, b"Z1\r", BELL),
        (b"", b"M00000000\r", BELL),  # no bit rate yet
        (b"S8\r", b"M00000000\r", b"\r"),
        (b"S8\r", b"mFFFFFFFF\r", b"\r"),
        (b"S8\r", b"mFFFF\r", BELL),
        (OPEN, b"mFFFFFFFF\r", BELL),
        (b"", b"\r", b"\r"),
        (b"", b"\r\r\rV\r", b"\r\r\rV1010\r"),
        (b"", b"Q1\r", BELL),
        (b"", b"\n\r", BELL),
        (b"", b"V", b""),  # not ended yet
    ],
)
def test_conversation(before: bytes, said: bytes, reply: bytes) -> None:
    assert an_adapter(before).hear(said).replies == reply


def test_what_slcand_says_opens_the_channel() -> None:
    """`slcand -o -f -s8`: the F comes before the channel is open, and nobody waits for replies."""
    adapter = SlcanAdapter(BITRATE)
    assert adapter.hear(b"C\rS8\rF\rO\r").replies == b"\a\r\a\r"
    assert adapter.channel is Channel.OPEN
    assert adapter.counts == {"refused": 2}


def test_frames_come_out_in_order_however_the_bytes_are_cut() -> None:
    adapter = an_adapter(OPEN)
    frames, replies = [], b""
    for byte in b"t10021133\rr1230\rT12ABCDEF2AA55\r":
        heard = adapter.hear(bytes([byte]))
        frames += heard.frames
        replies += heard.replies
    assert frames == [FRAME, Frame(0x123, remote=True), Frame(0x12ABCDEF, b"\xaa\x55", extended=True)]
    assert replies == b"z\rz\rZ\r"


class TestTowardsTheHost:
    def test_a_frame_goes_to_an_open_and_to_a_listening_channel(self) -> None:
        assert an_adapter(OPEN).tell(FRAME, 0) == b"t10021133\r"
        assert an_adapter(LISTEN).tell(FRAME, 0) == b"t10021133\r"

    def test_no_frame_goes_to_a_closed_channel_and_that_is_counted(self) -> None:
        for adapter in (an_adapter(), an_adapter(b"S8\r"), an_adapter(OPEN, b"C\r")):
            assert adapter.tell(FRAME, 0) == b""
            assert adapter.counts == {"unheard": 1}

    def test_time_stamps_are_milliseconds_of_a_minute(self) -> None:
        adapter = an_adapter(b"Z1\r", OPEN)
        assert adapter.tell(FRAME, 19_815_999_999) == b"t100211334D67\r"
        assert adapter.tell(FRAME, 59_999_000_000) == b"t10021133EA5F\r"
        assert adapter.tell(FRAME, 60_000_000_000) == b"t100211330000\r"
        assert an_adapter(b"Z1\r", b"Z0\r", OPEN).tell(FRAME, 19_815_000_000) == b"t10021133\r"

    def test_acceptance_registers_pick_the_frames(self) -> None:
        adapter = an_adapter(b"S8\rM00006000\rm00001FF0\rO\r")
        assert adapter.tell(Frame(0x345, b"\x01"), 0) == b"t345101\r"
        assert adapter.tell(Frame(0x445, b"\x01"), 0) == b""

    def test_bus_timing_registers_serve_as_well_as_a_speed(self) -> None:
        assert an_adapter(b"s0014\rO\r").tell(FRAME, 0) == b"t10021133\r"


class TestWrongBitRate:
    def test_no_frame_passes_either_way(self) -> None:
        adapter = an_adapter(b"S6\rO\r")
        heard = adapter.hear(b"t10021133\r")
        assert (heard.replies, heard.frames) == (b"z\r", [])
        assert adapter.tell(FRAME, 0) == b""
        assert adapter.counts == {"wrong_bit_rate": 2}

    def test_the_flags_tell_a_bus_error_once(self) -> None:
        adapter = an_adapter(b"S6\rO\r")
        adapter.tell(FRAME, 0)
        assert adapter.hear(b"F\rF\r").replies == b"FA0\rF00\r"

    def test_the_right_one_helps_at_once(self) -> None:
        adapter = an_adapter(b"S6\rO\r", b"C\rS8\rO\r")
        assert adapter.hear(b"t10021133\r").frames == [FRAME]


def test_an_overrun_is_counted_and_told_once() -> None:
    adapter = an_adapter(OPEN)
    adapter.overrun()
    assert adapter.counts == {"overrun": 1}
    assert adapter.hear(b"F\rF\r").replies == b"F09\rF00\r"


def test_half_a_line_of_a_host_that_went_does_not_spoil_the_next_ones_first() -> None:
    adapter = an_adapter(OPEN)
    adapter.hear(b"t100211")
    adapter.hang_up()
    assert adapter.hear(b"C\r").replies == b"\r"


def test_a_line_without_end_costs_no_memory_and_the_next_line_is_whole() -> None:
    adapter = an_adapter(OPEN)
    for _ in range(1000):
        assert adapter.hear(b"t1" * 500).replies == b""
    assert len(adapter._rest) < 100
    assert adapter.hear(b"\rt10021133\r") == (b"\az\r", [FRAME])
    assert adapter.counts == {"garbage": 1}


def test_a_line_too_long_is_garbage_though_it_begins_well() -> None:
    adapter = an_adapter(OPEN)
    line = b"T1FFFFFFF8" + b"00" * 8
    assert adapter.hear(line).replies == b""
    assert adapter.hear(b"00").replies == b""
    assert adapter.hear(b"00\r") == (BELL, [])


words = st.sampled_from([b"S8", b"S6", b"O", b"L", b"C", b"F", b"Z1", b"V", b"v", b"N", b"M00000000", b"mFFFFFFFF"])
noise = st.one_of(words, st.binary(max_size=40), st.sampled_from([b"\r", b"t10021133", b"R000001002", b"t1009"]))


@given(st.lists(noise, max_size=60))
def test_no_bytes_make_it_raise_and_every_line_gets_one_reply(said: list[bytes]) -> None:
    adapter = SlcanAdapter(BITRATE)
    replies, frames = b"", 0
    for data in said:
        heard = adapter.hear(data)
        replies += heard.replies
        frames += len(heard.frames)
        adapter.tell(FRAME, 0)
    assert replies.count(b"\r") + replies.count(BELL) == b"".join(said).count(b"\r")
    counts = adapter.counts
    assert counts.get("garbage", 0) + counts.get("refused", 0) == replies.count(BELL)
    assert frames <= replies.count(b"z") + replies.count(b"Z")
