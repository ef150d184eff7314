"""SDO messages: golden bytes of CiA 301, 7.2.4.3, both ways.

Byte 0 holds the command specifier in bits 7 to 5. Initiate: bits 3 and 2 n (bytes without data), bit 1 e (expedited),
bit 0 s (size indicated). Segments: bit 4 t (toggle), bits 3 to 1 n, bit 0 c (no more segments). Bytes 1 to 3 are the
multiplexer: index, low byte first, and sub-index. Abort: specifier 4, bytes 4 to 7 the code, low byte first.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.wire import sdo
from torquerig.driver.wire.sdo import (
    Abort,
    AbortCode,
    DownloadInitiate,
    DownloadInitiated,
    DownloadSegment,
    SegmentDownloaded,
    SegmentUploaded,
    Unsupported,
    UploadInitiate,
    UploadInitiated,
    UploadSegment,
)

REQUESTS = [
    # download initiate, ccs = 1: e = 1, s = 1, n = 3, 2, 1, 0
    (DownloadInitiate(0x1019, 0, b"\x0a", 1), b"\x2f\x19\x10\x00\x0a\x00\x00\x00"),
    (DownloadInitiate(0x1017, 0, b"\x64\x00", 2), b"\x2b\x17\x10\x00\x64\x00\x00\x00"),
    (DownloadInitiate(0x2345, 1, b"\x01\x02\x03", 3), b"\x27\x45\x23\x01\x01\x02\x03\x00"),
    (DownloadInitiate(0x1400, 1, b"\x01\x02\x00\x80", 4), b"\x23\x00\x14\x01\x01\x02\x00\x80"),
    (DownloadInitiate(0x1400, 1, b"\x01\x02\x00\x80", None), b"\x22\x00\x14\x01\x01\x02\x00\x80"),  # s = 0
    (
        DownloadInitiate(0x2000, 2, None, 300),
        b"\x21\x00\x20\x02\x2c\x01\x00\x00",
    ),  # e = 0, s = 1: bytes 4 to 7 the size
    (DownloadInitiate(0x2000, 2, None, None), b"\x20\x00\x20\x02\x00\x00\x00\x00"),
    # download segment, ccs = 0
    (DownloadSegment(False, b"1234567", False), b"\x001234567"),
    (DownloadSegment(True, b"1234567", False), b"\x101234567"),
    (DownloadSegment(False, b"1234567", True), b"\x011234567"),
    (DownloadSegment(True, b"abc", True), b"\x19abc\x00\x00\x00\x00"),  # n = 4
    (DownloadSegment(False, b"", True), b"\x0f" + bytes(7)),  # n = 7
    # upload initiate, ccs = 2; upload segment, ccs = 3
    (UploadInitiate(0x1018, 1), b"\x40\x18\x10\x01\x00\x00\x00\x00"),
    (UploadSegment(False), b"\x60" + bytes(7)),
    (UploadSegment(True), b"\x70" + bytes(7)),
    # abort, cs = 4
    (Abort(0x1008, 0, 0x05040000), b"\x80\x08\x10\x00\x00\x00\x04\x05"),
]
RESPONSES = [
    # upload initiate, scs = 2
    (UploadInitiated(0x1001, 0, b"\x11", 1), b"\x4f\x01\x10\x00\x11\x00\x00\x00"),
    (UploadInitiated(0x6041, 0, b"\x37\x02", 2), b"\x4b\x41\x60\x00\x37\x02\x00\x00"),
    (UploadInitiated(0x2345, 1, b"\x01\x02\x03", 3), b"\x47\x45\x23\x01\x01\x02\x03\x00"),
    (UploadInitiated(0x1000, 0, b"\x92\x01\x02\x00", 4), b"\x43\x00\x10\x00\x92\x01\x02\x00"),
    (UploadInitiated(0x1000, 0, b"\x92\x01\x02\x00", None), b"\x42\x00\x10\x00\x92\x01\x02\x00"),
    (UploadInitiated(0x1008, 0, None, 32), b"\x41\x08\x10\x00\x20\x00\x00\x00"),
    (UploadInitiated(0x1008, 0, None, None), b"\x40\x08\x10\x00\x00\x00\x00\x00"),
    # upload segment, scs = 0
    (SegmentUploaded(False, b"torquer", False), b"\x00torquer"),
    (SegmentUploaded(True, b"ig", True), b"\x1big\x00\x00\x00\x00\x00"),  # n = 5
    # download initiate, scs = 3; download segment, scs = 1
    (DownloadInitiated(0x1017, 0), b"\x60\x17\x10\x00\x00\x00\x00\x00"),
    (SegmentDownloaded(False), b"\x20" + bytes(7)),
    (SegmentDownloaded(True), b"\x30" + bytes(7)),
    (Abort(0x6041, 0, 0x06010002), b"\x80\x41\x60\x00\x02\x00\x01\x06"),
]


@pytest.mark.parametrize(("message", "data"), REQUESTS)
def test_requests_are_the_standards_bytes_both_ways(message, data):
    assert sdo.encode(message) == data
    assert sdo.decode_request(data) == message


@pytest.mark.parametrize(("message", "data"), RESPONSES)
def test_responses_are_the_standards_bytes_both_ways(message, data):
    assert sdo.encode(message) == data
    assert sdo.decode_response(data) == message


@pytest.mark.parametrize("decode", [sdo.decode_request, sdo.decode_response])
def test_block_and_reserved_specifiers_decode_to_unsupported(decode):
    # initiate block download (6), block upload (5), and the specifier 7 that no service has
    assert decode(b"\xc6\x00\x20\x01\x00\x01\x00\x00") == Unsupported(6, 0x2000, 1)
    assert decode(b"\xa4\x08\x10\x00\x7f\x00\x00\x00") == Unsupported(5, 0x1008, 0)
    assert decode(b"\xe0\x08\x10\x00\x00\x00\x00\x00") == Unsupported(7, 0x1008, 0)


@pytest.mark.parametrize(
    ("message", "datum"),
    [
        (UploadInitiate(0x10000, 0), "0x10000"),
        (UploadInitiate(0x1000, 256), "0x100"),
        (DownloadInitiate(0x1000, 0, b"", 0), "not 0"),
        (DownloadInitiate(0x1000, 0, b"12345", 5), "not 5"),
        (DownloadInitiate(0x1000, 0, b"12", None), "not 2"),
        (DownloadInitiate(0x1000, 0, b"12", 3), "size 3"),
        (DownloadInitiate(0x1000, 0, None, 2**32), "4294967296"),
        (DownloadSegment(False, b"12345678", True), "not 8"),
        (Abort(0x1000, 0, -1), "-1"),
    ],
)
def test_a_callers_mistake_names_the_datum(message, datum):
    with pytest.raises(ValueError, match=datum):
        sdo.encode(message)


def test_abort_codes_are_the_standards():
    # CiA 301, table of SDO abort codes
    assert {int(code) for code in AbortCode} == {
        *(0x05030000, 0x05040000, 0x05040001, 0x05040002, 0x05040003, 0x05040004, 0x05040005),
        *(0x06010000, 0x06010001, 0x06010002, 0x06020000),
        *(0x06040041, 0x06040042, 0x06040043, 0x06040047, 0x06060000),
        *(0x06070010, 0x06070012, 0x06070013),
        *(0x06090011, 0x06090030, 0x06090031, 0x06090032, 0x06090036, 0x060A0023),
        *(0x08000000, 0x08000020, 0x08000021, 0x08000022, 0x08000023, 0x08000024),
    }


def test_every_abort_code_has_words_of_its_own():
    words = {sdo.describe(code) for code in AbortCode}
    assert len(words) == len(AbortCode)
    assert "unknown reason" not in words
    assert sdo.describe(0xDEAD) == "unknown reason"


multiplexers = {"index": st.integers(0, 0xFFFF), "subindex": st.integers(0, 0xFF)}
expedited = st.binary(min_size=1, max_size=4).map(lambda data: (data, len(data)))
unsized = st.binary(min_size=4, max_size=4).map(lambda data: (data, None))
announced = st.one_of(st.none(), st.integers(0, 2**32 - 1)).map(lambda size: (None, size))
payloads = st.one_of(expedited, unsized, announced)


@given(payload=payloads, **multiplexers)
def test_initiates_survive_the_round_trip(index, subindex, payload):
    request, response = DownloadInitiate(index, subindex, *payload), UploadInitiated(index, subindex, *payload)
    assert sdo.decode_request(sdo.encode(request)) == request
    assert sdo.decode_response(sdo.encode(response)) == response


@given(st.booleans(), st.binary(max_size=7), st.booleans())
def test_segments_survive_the_round_trip(toggle, data, last):
    assert sdo.decode_request(sdo.encode(DownloadSegment(toggle, data, last))) == DownloadSegment(toggle, data, last)
    assert sdo.decode_response(sdo.encode(SegmentUploaded(toggle, data, last))) == SegmentUploaded(toggle, data, last)
