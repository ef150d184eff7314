"""The client's side of block transfers, as conversations typed from CiA 301: (what it hears, what it must send)."""

import pytest

from torquerig.driver.master.sdo_block_client import SdoBlockDownload, SdoBlockUpload
from torquerig.driver.master.sdo_client import SdoUpload

Z = b"\0"
DIGITS = b"123456789"  # its check sum is 31C3, by the standard
LETTERS = b"abcdefghijklmnopqrstuvwxyzABCDEFGHI"  # 35 bytes: five segments
SEGMENTS = [b"abcdefg", b"hijklmn", b"opqrstu", b"vwxyzAB", b"CDEFGHI"]
UNKNOWN = b"\x80\x00\x60\x01\x01\x00\x04\x05"  # 0504 0001


def answers(transfer, response):
    request = transfer.step(response)
    assert request is not None or transfer.pending == ()
    return [] if request is None else [request, *transfer.pending]


def converse(transfer, conversation):
    for response, expected in conversation:
        assert not transfer.done
        assert answers(transfer, response) == expected, response


UPLOADS = {
    "with check sum": (
        {},
        b"\xa4\x00\x60\x01\x7f" + 3 * Z,
        DIGITS,
        [
            (b"\xc6\x00\x60\x01\x09" + 3 * Z, [b"\xa3" + 7 * Z]),
            (b"\x011234567", []),
            (b"\x8289" + 5 * Z, [b"\xa2\x02\x7f" + 5 * Z]),
            (b"\xd5\xc3\x31" + 5 * Z, [b"\xa1" + 7 * Z]),
        ],
    ),
    "server without check sum, and size": (
        {},
        b"\xa4\x00\x60\x01\x7f" + 3 * Z,
        DIGITS,
        [
            (b"\xc0\x00\x60\x01" + 4 * Z, [b"\xa3" + 7 * Z]),
            (b"\x011234567", []),
            (b"\x8289" + 5 * Z, [b"\xa2\x02\x7f" + 5 * Z]),
            (b"\xd5" + 7 * Z, [b"\xa1" + 7 * Z]),
        ],
    ),
    "client without check sum": (
        {"crc": False},
        b"\xa0\x00\x60\x01\x7f" + 3 * Z,
        DIGITS,
        [
            (b"\xc6\x00\x60\x01\x09" + 3 * Z, [b"\xa3" + 7 * Z]),
            (b"\x011234567", []),
            (b"\x8289" + 5 * Z, [b"\xa2\x02\x7f" + 5 * Z]),
            (b"\xd5" + 7 * Z, [b"\xa1" + 7 * Z]),
        ],
    ),
    "in blocks of two, with segments lost": (
        {"crc": False, "block_size": 2},
        b"\xa0\x00\x60\x01\x02" + 3 * Z,
        LETTERS,
        [
            (b"\xc2\x00\x60\x01\x23" + 3 * Z, [b"\xa3" + 7 * Z]),
            (b"\x01" + SEGMENTS[0], []),
            (b"\x02" + SEGMENTS[1], [b"\xa2\x02\x02" + 5 * Z]),
            (b"\x02" + SEGMENTS[3], [b"\xa2\x00\x02" + 5 * Z]),
            (b"\x01" + SEGMENTS[2], []),
            (b"\x02" + SEGMENTS[3], [b"\xa2\x02\x02" + 5 * Z]),
            (b"\x81" + SEGMENTS[4], [b"\xa2\x01\x02" + 5 * Z]),
            (b"\xc1" + 7 * Z, [b"\xa1" + 7 * Z]),
        ],
    ),
    "nothing": (
        {},
        b"\xa4\x00\x60\x01\x7f" + 3 * Z,
        b"",
        [
            (b"\xc6\x00\x60\x01" + 4 * Z, [b"\xa3" + 7 * Z]),
            (b"\x81" + 7 * Z, [b"\xa2\x01\x7f" + 5 * Z]),
            (b"\xdd" + 7 * Z, [b"\xa1" + 7 * Z]),
        ],
    ),
    "expedited below the threshold": (
        {"switch_threshold": 4},
        b"\xa4\x00\x60\x01\x7f\x04\x00\x00",
        b"\x37\x02",
        [(b"\x4b\x00\x60\x01\x37\x02\x00\x00", [])],
    ),
    "segmented below the threshold": (
        {"switch_threshold": 255},
        b"\xa4\x00\x60\x01\x7f\xff\x00\x00",
        DIGITS,
        [
            (b"\x41\x00\x60\x01\x09" + 3 * Z, [b"\x60" + 7 * Z]),
            (b"\x001234567", [b"\x70" + 7 * Z]),
            (b"\x1b89" + 5 * Z, []),
        ],
    ),
    "fallen back to segments": (
        {"fall_back": True},
        b"\xa4\x00\x60\x01\x7f" + 3 * Z,
        DIGITS,
        [
            (UNKNOWN, [b"\x40\x00\x60\x01" + 4 * Z]),
            (b"\x41\x00\x60\x01\x09" + 3 * Z, [b"\x60" + 7 * Z]),
            (b"\x001234567", [b"\x70" + 7 * Z]),
            (b"\x1b89" + 5 * Z, []),
        ],
    ),
    "fallen back by a server that switches unasked": (
        {"fall_back": True},
        b"\xa4\x00\x60\x01\x7f" + 3 * Z,
        b"\x05",
        [(b"\x4f\x00\x60\x01\x05" + 3 * Z, [])],
    ),
}
DOWNLOADS = {
    "with check sum and size": (
        {},
        b"\xc6\x00\x60\x01\x09" + 3 * Z,
        DIGITS,
        [
            (b"\xa4\x00\x60\x01\x7f" + 3 * Z, [b"\x011234567", b"\x8289" + 5 * Z]),
            (b"\xa2\x02\x7f" + 5 * Z, [b"\xd5\xc3\x31" + 5 * Z]),
            (b"\xa1" + 7 * Z, []),
        ],
    ),
    "server without check sum": (
        {"indicate_size": False},
        b"\xc4\x00\x60\x01" + 4 * Z,
        DIGITS,
        [
            (b"\xa0\x00\x60\x01\x7f" + 3 * Z, [b"\x011234567", b"\x8289" + 5 * Z]),
            (b"\xa2\x02\x7f" + 5 * Z, [b"\xd5" + 7 * Z]),
            (b"\xa1" + 7 * Z, []),
        ],
    ),
    "client without check sum, and a last block size that nobody needs": (
        {"crc": False},
        b"\xc2\x00\x60\x01\x09" + 3 * Z,
        DIGITS,
        [
            (b"\xa4\x00\x60\x01\x7f" + 3 * Z, [b"\x011234567", b"\x8289" + 5 * Z]),
            (b"\xa2\x02\x00" + 5 * Z, [b"\xd5" + 7 * Z]),
            (b"\xa1" + 7 * Z, []),
        ],
    ),
    "with the server's block size changing, and segments lost": (
        {"crc": False},
        b"\xc2\x00\x60\x01\x23" + 3 * Z,
        LETTERS,
        [
            (b"\xa0\x00\x60\x01\x02" + 3 * Z, [b"\x01" + SEGMENTS[0], b"\x02" + SEGMENTS[1]]),
            (b"\xa2\x01\x03" + 5 * Z, [b"\x01" + SEGMENTS[1], b"\x02" + SEGMENTS[2], b"\x03" + SEGMENTS[3]]),
            (b"\xa2\x00\x01" + 5 * Z, [b"\x01" + SEGMENTS[1]]),
            (b"\xa2\x01\x7f" + 5 * Z, [b"\x01" + SEGMENTS[2], b"\x02" + SEGMENTS[3], b"\x83" + SEGMENTS[4]]),
            (b"\xa2\x02\x7f" + 5 * Z, [b"\x81" + SEGMENTS[4]]),
            (b"\xa2\x01\x7f" + 5 * Z, [b"\xc1" + 7 * Z]),
            (b"\xa1" + 7 * Z, []),
        ],
    ),
    "nothing": (
        {},
        b"\xc6\x00\x60\x01" + 4 * Z,
        b"",
        [
            (b"\xa4\x00\x60\x01\x7f" + 3 * Z, [b"\x81" + 7 * Z]),
            (b"\xa2\x01\x7f" + 5 * Z, [b"\xdd" + 7 * Z]),
            (b"\xa1" + 7 * Z, []),
        ],
    ),
    "fallen back to segments": (
        {"fall_back": True},
        b"\xc6\x00\x60\x01\x09" + 3 * Z,
        DIGITS,
        [
            (UNKNOWN, [b"\x21\x00\x60\x01\x09" + 3 * Z]),
            (b"\x60\x00\x60\x01" + 4 * Z, [b"\x001234567"]),
            (b"\x20" + 7 * Z, [b"\x1b89" + 5 * Z]),
            (b"\x30" + 7 * Z, []),
        ],
    ),
    "fallen back to an expedited one": (
        {"fall_back": True},
        b"\xc6\x00\x60\x01\x01" + 3 * Z,
        b"\x05",
        [(UNKNOWN, [b"\x2f\x00\x60\x01\x05" + 3 * Z]), (b"\x60\x00\x60\x01" + 4 * Z, [])],
    ),
}


@pytest.mark.parametrize("kind", UPLOADS)
def test_block_uploads_go_as_the_standard_says(kind):
    options, request, value, conversation = UPLOADS[kind]
    upload = SdoBlockUpload(0x6000, 1, **options)
    assert upload.request == request
    converse(upload, conversation)
    assert upload.done
    assert upload.result == value
    assert upload.farewell is None


@pytest.mark.parametrize("kind", DOWNLOADS)
def test_block_downloads_go_as_the_standard_says(kind):
    options, request, value, conversation = DOWNLOADS[kind]
    download = SdoBlockDownload(0x6000, 1, value, **options)
    assert download.request == request
    converse(download, conversation)
    assert download.done
    assert download.farewell is None


def test_the_clients_block_size_may_change_with_each_acknowledgement():
    upload = SdoBlockUpload(0x6000, 1, block_size=1)
    upload.step(b"\xc2\x00\x60\x01\x23" + 3 * Z)
    upload.block_size = 2
    assert upload.step(b"\x01" + SEGMENTS[0]) == b"\xa2\x01\x02" + 5 * Z
    assert upload.step(b"\x01" + SEGMENTS[1]) is None
    assert upload.step(b"\x02" + SEGMENTS[2]) == b"\xa2\x02\x02" + 5 * Z


def test_segments_out_of_sequence_are_counted():
    options, _, _, conversation = UPLOADS["in blocks of two, with segments lost"]
    upload = SdoBlockUpload(0x6000, 1, **options)
    converse(upload, conversation)
    assert upload.ignored == 1


def test_the_plain_machines_have_never_anything_pending():
    upload = SdoUpload(0x6000, 1)
    converse(upload, UPLOADS["fallen back to segments"][3][1:])
    assert upload.done
    assert upload.result == DIGITS
