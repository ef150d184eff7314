"""SDO block transfer: golden bytes of CiA 301, 7.2.4.3.8 to 7.2.4.3.16, both ways.

Byte 0 holds the command specifier in bits 7 to 5: 6 from whoever sends the data, 5 from whoever receives them.
Initiate: bit 2 cc or sc (CRC), with specifier 6 also bit 1 s (size indicated). End: bits 4 to 2 n (bytes without data).
The lowest bits are the subcommand: 0 initiate, 1 end, and with specifier 5 also 2 block response, 3 start upload. A
segment has bit 7 c (no more segments) and bits 6 to 0 seqno.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.wire import sdo, sdo_block
from torquerig.driver.wire.sdo import Abort, Unsupported, UploadInitiate, UploadInitiated
from torquerig.driver.wire.sdo_block import (
    Acknowledge,
    End,
    Ended,
    ReceiverInitiate,
    Segment,
    SenderInitiate,
    Start,
)
from torquerig.driver.wire.sdo_block_transfer import check_sum

Z = b"\0"

# both a request (download) and a response (upload), or the other way round
EITHER = [
    # initiate block download request, ccs = 6; initiate block upload response, scs = 6: bytes 4 to 7 the size
    (SenderInitiate(0x2000, 1, True, 300), b"\xc6\x00\x20\x01\x2c\x01\x00\x00"),
    (SenderInitiate(0x2000, 1, False, 300), b"\xc2\x00\x20\x01\x2c\x01\x00\x00"),
    (SenderInitiate(0x2000, 1, True, None), b"\xc4\x00\x20\x01" + 4 * Z),
    (SenderInitiate(0x1F50, 2, False, None), b"\xc0\x50\x1f\x02" + 4 * Z),
    (SenderInitiate(0x2000, 1, False, 0), b"\xc2\x00\x20\x01" + 4 * Z),
    # initiate block download response, scs = 5; initiate block upload request, ccs = 5: byte 4 blksize, byte 5 pst
    (ReceiverInitiate(0x2000, 1, True, 127), b"\xa4\x00\x20\x01\x7f" + 3 * Z),
    (ReceiverInitiate(0x2000, 1, False, 1), b"\xa0\x00\x20\x01\x01" + 3 * Z),
    (ReceiverInitiate(0x1008, 0, True, 16, 21), b"\xa4\x08\x10\x00\x10\x15\x00\x00"),
    # block response: byte 1 ackseq, byte 2 blksize
    (Acknowledge(127, 127), b"\xa2\x7f\x7f" + 5 * Z),
    (Acknowledge(0, 4), b"\xa2\x00\x04" + 5 * Z),
    # end of the data: n, and the CRC, low byte first
    (End(0, 0x31C3), b"\xc1\xc3\x31" + 5 * Z),
    (End(5, 0x31C3), b"\xd5\xc3\x31" + 5 * Z),
    (End(7, 0), b"\xdd" + 7 * Z),
    # end of the transfer
    (Ended(), b"\xa1" + 7 * Z),
]
SEGMENTS = [
    (Segment(1, b"1234567", False), b"\x011234567"),
    (Segment(127, b"1234567", False), b"\x7f1234567"),
    (Segment(2, b"1234567", True), b"\x821234567"),
    (Segment(127, b"1234567", True), b"\xff1234567"),
]


@pytest.mark.parametrize(("message", "data"), EITHER)
def test_messages_are_the_standards_bytes_both_ways(message, data):
    assert sdo_block.encode(message) == data
    assert sdo_block.decode_request(data) == message
    assert sdo_block.decode_response(data) == message


def test_the_start_of_an_upload_is_a_request_only():
    assert sdo_block.encode(Start()) == b"\xa3" + 7 * Z
    assert sdo_block.decode_request(b"\xa3" + 7 * Z) == Start()
    assert sdo_block.decode_response(b"\xa3" + 7 * Z) == Unsupported(5, 0, 0)


@pytest.mark.parametrize(("message", "data"), SEGMENTS)
def test_segments_are_the_standards_bytes_both_ways(message, data):
    assert sdo_block.encode(message) == data
    assert sdo_block.decode_segment(data) == message


def test_a_short_segment_is_filled_up():
    assert sdo_block.encode(Segment(3, b"ab", True)) == b"\x83ab" + 5 * Z
    assert sdo_block.encode(Segment(1, b"", True)) == b"\x81" + 7 * Z


def test_in_a_block_only_an_abort_is_no_segment():
    assert sdo_block.decode_segment(b"\x80\x00\x20\x01\x00\x00\x04\x05") == Abort(0x2000, 1, 0x05040000)
    assert sdo_block.decode_segment(b"\x40\x08\x10\x00" + 4 * Z) == Segment(64, b"\x08\x10\x00" + 4 * Z, False)
    assert sdo_block.decode_segment(8 * Z) == Segment(0, 7 * Z, False)


def test_plain_messages_pass_through():
    assert sdo_block.decode_request(b"\x40\x18\x10\x01" + 4 * Z) == UploadInitiate(0x1018, 1)
    assert sdo_block.decode_response(b"\x4f\x01\x10\x00\x11" + 3 * Z) == UploadInitiated(0x1001, 0, b"\x11", 1)
    assert sdo_block.encode(UploadInitiate(0x1018, 1)) == b"\x40\x18\x10\x01" + 4 * Z


@pytest.mark.parametrize("decode", [sdo_block.decode_request, sdo_block.decode_response])
def test_the_reserved_specifier_stays_unsupported(decode):
    assert decode(b"\xe0\x08\x10\x00" + 4 * Z) == Unsupported(7, 0x1008, 0)


def test_plain_codecs_do_not_know_blocks():
    assert sdo.decode_request(b"\xc6\x00\x20\x01" + 4 * Z) == Unsupported(6, 0x2000, 1)


def test_the_check_sum_is_the_standards():
    assert check_sum(b"123456789") == 0x31C3  # CiA 301, 7.2.4.3.16
    assert check_sum(b"") == 0


@pytest.mark.parametrize(
    ("message", "datum"),
    [
        (SenderInitiate(0x10000, 0, True, 1), "0x10000"),
        (SenderInitiate(0x1000, 0, True, 2**32), "4294967296"),
        (ReceiverInitiate(0x1000, 0, True, 0), "not 0"),
        (ReceiverInitiate(0x1000, 0, True, 128), "not 128"),
        (ReceiverInitiate(0x1000, 0, True, 1, 256), "not 256"),
        (Segment(0, b"", False), "not 0"),
        (Segment(128, b"", False), "not 128"),
        (Segment(1, b"12345678", False), "not 8"),
        (Acknowledge(128, 1), "not 128"),
        (Acknowledge(1, 0), "not 0"),
        (End(8, 0), "not 8"),
        (End(0, 0x10000), "not 65536"),
    ],
)
def test_a_callers_mistake_names_the_datum(message, datum):
    with pytest.raises(ValueError, match=datum):
        sdo_block.encode(message)


@pytest.mark.parametrize("decode", [sdo_block.decode_request, sdo_block.decode_response, sdo_block.decode_segment])
@given(data=st.binary(max_size=12) | st.binary(min_size=8, max_size=8))
def test_any_bytes_decode_or_are_none(decode, data):
    assert (decode(data) is None) == (len(data) != 8)
