"""The unix bus's packets: what goes in comes out, and no bytes whatever make the decoder raise."""

from __future__ import annotations

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.bus.unix_packet import HEADER, MAGIC, decode, encode

messages = st.builds(
    lambda wide, kind, can_id, data: can.Message(
        arbitration_id=can_id if wide else can_id & 0x7FF,
        is_extended_id=wide,
        is_remote_frame=kind == "remote",
        is_error_frame=kind == "error",
        dlc=len(data),
        data=None if kind == "remote" else data,
    ),
    st.booleans(),
    st.sampled_from(["data", "remote", "error"]),
    st.integers(0, 0x1FFFFFFF),
    st.binary(max_size=8),
)


@given(messages, st.integers(0, 2**32 - 1), st.integers(0, 2**64 - 1))
def test_a_message_survives_its_packet(message, sequence, sent_ns):
    packet = decode(encode(message, sequence, sent_ns))
    assert packet is not None
    assert packet.message.equals(message)
    assert (packet.sequence, packet.sent_ns) == (sequence, sent_ns)


@given(st.binary(max_size=64))
def test_no_bytes_make_the_decoder_raise(junk):
    decode(junk)


@given(st.binary(min_size=20, max_size=28))
def test_no_bytes_behind_the_right_magic_make_the_decoder_raise(junk):
    packet = decode(MAGIC + junk)
    if packet is not None:
        assert encode(packet.message, packet.sequence, packet.sent_ns)[:6] == (MAGIC + junk)[:6]


def test_the_layout_is_as_documented():
    message = can.Message(arbitration_id=0x181, data=b"\x01\x02", is_extended_id=False)
    assert encode(message, 0x01020304, 0x1122334455667788) == bytes.fromhex(
        "43414e01 00 02 0000 81010000 04030201 8877665544332211 0102"
    )


@pytest.mark.parametrize(
    ("flags", "length", "can_id", "carried"),
    [(8, 0, 1, 0), (6, 0, 1, 0), (0, 9, 1, 9), (0, 2, 1, 1), (0, 0, 0x800, 0), (1, 0, 1 << 29, 0), (2, 4, 1, 4)],
    ids=["unknown flag", "remote error", "nine bytes", "too short", "12 bits", "30 bits", "remote with data"],
)
def test_what_no_can_frame_is_is_not_decoded(flags, length, can_id, carried):
    assert decode(HEADER.pack(MAGIC, flags, length, can_id, 0, 0) + bytes(carried)) is None


@pytest.mark.parametrize("can_id", [-1, 0x800])
def test_an_identifier_that_does_not_fit_is_refused(can_id):
    with pytest.raises(can.CanOperationError, match="classic CAN"):
        encode(can.Message(arbitration_id=can_id, is_extended_id=False), 0, 0)
