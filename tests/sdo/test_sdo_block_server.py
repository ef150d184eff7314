"""The server's side of block transfers, as conversations typed from CiA 301: (what the client sends, what it hears)."""

import pytest

from torquerig.device_sim.canopen.sdo_server import SdoServer

Z = b"\0"
DIGITS = b"123456789"  # its check sum is 31C3, by the standard
LETTERS = b"abcdefghijklmnopqrstuvwxyzABCDEFGHI"  # 35 bytes: five segments
SEGMENTS = [b"abcdefg", b"hijklmn", b"opqrstu", b"vwxyzAB", b"CDEFGHI"]


def answers(server, request):
    response = server.handle(request)
    assert response is not None or server.pending == ()
    return [] if response is None else [response, *server.pending]


def converse(server, conversation):
    for request, expected in conversation:
        assert answers(server, request) == expected, request


def abort(index, subindex, code):
    return b"\x80" + index.to_bytes(2, "little") + bytes((subindex,)) + code.to_bytes(4, "little")


DOWNLOADS = {
    "with check sum and size": (
        {},
        DIGITS,
        [
            (b"\xc6\x00\x20\x00\x09" + 3 * Z, [b"\xa4\x00\x20\x00\x7f" + 3 * Z]),
            (b"\x011234567", []),
            (b"\x8289" + 5 * Z, [b"\xa2\x02\x7f" + 5 * Z]),
            (b"\xd5\xc3\x31" + 5 * Z, [b"\xa1" + 7 * Z]),  # n = 5
        ],
    ),
    "size not said": (
        {},
        DIGITS,
        [
            (b"\xc4\x00\x20\x00" + 4 * Z, [b"\xa4\x00\x20\x00\x7f" + 3 * Z]),
            (b"\x011234567", []),
            (b"\x8289" + 5 * Z, [b"\xa2\x02\x7f" + 5 * Z]),
            (b"\xd5\xc3\x31" + 5 * Z, [b"\xa1" + 7 * Z]),
        ],
    ),
    "client without check sum": (
        {},
        DIGITS,
        [
            (b"\xc2\x00\x20\x00\x09" + 3 * Z, [b"\xa0\x00\x20\x00\x7f" + 3 * Z]),
            (b"\x011234567", []),
            (b"\x8289" + 5 * Z, [b"\xa2\x02\x7f" + 5 * Z]),
            (b"\xd5" + 7 * Z, [b"\xa1" + 7 * Z]),
        ],
    ),
    "server without check sum": (
        {"crc": False},
        DIGITS,
        [
            (b"\xc6\x00\x20\x00\x09" + 3 * Z, [b"\xa0\x00\x20\x00\x7f" + 3 * Z]),
            (b"\x011234567", []),
            (b"\x8289" + 5 * Z, [b"\xa2\x02\x7f" + 5 * Z]),
            (b"\xd5" + 7 * Z, [b"\xa1" + 7 * Z]),
        ],
    ),
    "in three blocks": (
        {"block_size": 2, "crc": False},
        LETTERS,
        [
            (b"\xc2\x00\x20\x00\x23" + 3 * Z, [b"\xa0\x00\x20\x00\x02" + 3 * Z]),
            (b"\x01" + SEGMENTS[0], []),
            (b"\x02" + SEGMENTS[1], [b"\xa2\x02\x02" + 5 * Z]),
            (b"\x01" + SEGMENTS[2], []),
            (b"\x02" + SEGMENTS[3], [b"\xa2\x02\x02" + 5 * Z]),
            (b"\x81" + SEGMENTS[4], [b"\xa2\x01\x02" + 5 * Z]),
            (b"\xc1" + 7 * Z, [b"\xa1" + 7 * Z]),  # n = 0
        ],
    ),
    "with the second segment lost": (
        {"block_size": 4, "crc": False},
        LETTERS,
        [
            (b"\xc2\x00\x20\x00\x23" + 3 * Z, [b"\xa0\x00\x20\x00\x04" + 3 * Z]),
            (b"\x01" + SEGMENTS[0], []),
            (b"\x03" + SEGMENTS[2], []),
            (b"\x04" + SEGMENTS[3], [b"\xa2\x01\x04" + 5 * Z]),
            (b"\x01" + SEGMENTS[1], []),
            (b"\x02" + SEGMENTS[2], []),
            (b"\x03" + SEGMENTS[3], []),
            (b"\x84" + SEGMENTS[4], [b"\xa2\x04\x04" + 5 * Z]),
            (b"\xc1" + 7 * Z, [b"\xa1" + 7 * Z]),
        ],
    ),
    "with the first lost, two swapped and one twice": (
        {},
        LETTERS,
        [
            (b"\xc2\x00\x20\x00\x23" + 3 * Z, [b"\xa0\x00\x20\x00\x7f" + 3 * Z]),
            (b"\x02" + SEGMENTS[1], []),
            (b"\x03" + SEGMENTS[2], []),
            (b"\x04" + SEGMENTS[3], []),
            (b"\x85" + SEGMENTS[4], [b"\xa2\x00\x7f" + 5 * Z]),
            (b"\x01" + SEGMENTS[0], []),
            (b"\x02" + SEGMENTS[1], []),
            (b"\x04" + SEGMENTS[3], []),
            (b"\x03" + SEGMENTS[2], []),
            (b"\x85" + SEGMENTS[4], [b"\xa2\x03\x7f" + 5 * Z]),
            (b"\x01" + SEGMENTS[3], []),
            (b"\x01" + SEGMENTS[3], []),
            (b"\x82" + SEGMENTS[4], [b"\xa2\x02\x7f" + 5 * Z]),
            (b"\xc1" + 7 * Z, [b"\xa1" + 7 * Z]),
        ],
    ),
    "nothing": (
        {},
        b"",
        [
            (b"\xc6\x00\x20\x00" + 4 * Z, [b"\xa4\x00\x20\x00\x7f" + 3 * Z]),
            (b"\x81" + 7 * Z, [b"\xa2\x01\x7f" + 5 * Z]),
            (b"\xdd" + 7 * Z, [b"\xa1" + 7 * Z]),  # n = 7
        ],
    ),
    "a last segment without data": (
        {"crc": False},
        b"abcdefg",
        [
            (b"\xc0\x00\x20\x00" + 4 * Z, [b"\xa0\x00\x20\x00\x7f" + 3 * Z]),
            (b"\x01" + SEGMENTS[0], []),
            (b"\x82" + 7 * Z, [b"\xa2\x02\x7f" + 5 * Z]),
            (b"\xdd" + 7 * Z, [b"\xa1" + 7 * Z]),
        ],
    ),
}

UPLOADS = {
    "with check sum": (
        {},
        DIGITS,
        [
            (b"\xa4\x00\x20\x00\x7f" + 3 * Z, [b"\xc6\x00\x20\x00\x09" + 3 * Z]),
            (b"\xa3" + 7 * Z, [b"\x011234567", b"\x8289" + 5 * Z]),
            (b"\xa2\x02\x7f" + 5 * Z, [b"\xd5\xc3\x31" + 5 * Z]),
            (b"\xa1" + 7 * Z, []),
        ],
    ),
    "client without check sum": (
        {},
        DIGITS,
        [
            (b"\xa0\x00\x20\x00\x7f" + 3 * Z, [b"\xc2\x00\x20\x00\x09" + 3 * Z]),
            (b"\xa3" + 7 * Z, [b"\x011234567", b"\x8289" + 5 * Z]),
            (b"\xa2\x02\x7f" + 5 * Z, [b"\xd5" + 7 * Z]),
            (b"\xa1" + 7 * Z, []),
        ],
    ),
    "server without check sum": (
        {"crc": False},
        DIGITS,
        [
            (b"\xa4\x00\x20\x00\x7f" + 3 * Z, [b"\xc2\x00\x20\x00\x09" + 3 * Z]),
            (b"\xa3" + 7 * Z, [b"\x011234567", b"\x8289" + 5 * Z]),
            (b"\xa2\x02\x7f" + 5 * Z, [b"\xd5" + 7 * Z]),
            (b"\xa1" + 7 * Z, []),
        ],
    ),
    "with the client's block size changing, and segments lost": (
        {"crc": False},
        LETTERS,
        [
            (b"\xa0\x00\x20\x00\x02" + 3 * Z, [b"\xc2\x00\x20\x00\x23" + 3 * Z]),
            (b"\xa3" + 7 * Z, [b"\x01" + SEGMENTS[0], b"\x02" + SEGMENTS[1]]),
            (b"\xa2\x00\x01" + 5 * Z, [b"\x01" + SEGMENTS[0]]),
            (b"\xa2\x01\x03" + 5 * Z, [b"\x01" + SEGMENTS[1], b"\x02" + SEGMENTS[2], b"\x03" + SEGMENTS[3]]),
            (b"\xa2\x02\x7f" + 5 * Z, [b"\x01" + SEGMENTS[3], b"\x82" + SEGMENTS[4]]),
            (b"\xa2\x01\x7f" + 5 * Z, [b"\x81" + SEGMENTS[4]]),
            (b"\xa2\x01\x7f" + 5 * Z, [b"\xc1" + 7 * Z]),
            (b"\xa1" + 7 * Z, []),
        ],
    ),
    "nothing": (
        {},
        b"",
        [
            (b"\xa4\x00\x20\x00\x7f" + 3 * Z, [b"\xc6\x00\x20\x00" + 4 * Z]),
            (b"\xa3" + 7 * Z, [b"\x81" + 7 * Z]),
            (b"\xa2\x01\x7f" + 5 * Z, [b"\xdd" + 7 * Z]),
            (b"\xa1" + 7 * Z, []),
        ],
    ),
    "of few bytes, no change of protocol allowed": (
        {},
        b"\x37\x02",
        [
            (b"\xa4\x00\x20\x00\x7f" + 3 * Z, [b"\xc6\x00\x20\x00\x02" + 3 * Z]),
            (b"\xa3" + 7 * Z, [b"\x81\x37\x02" + 5 * Z]),
        ],
    ),
    "of few bytes, expedited below the threshold": (
        {},
        b"\x37\x02",
        [(b"\xa4\x00\x20\x00\x7f\x02\x00\x00", [b"\x4b\x00\x20\x00\x37\x02\x00\x00"])],
    ),
    "of more bytes, segmented at the threshold": (
        {},
        DIGITS,
        [
            (b"\xa4\x00\x20\x00\x7f\x09\x00\x00", [b"\x41\x00\x20\x00\x09" + 3 * Z]),
            (b"\x60" + 7 * Z, [b"\x001234567"]),
            (b"\x70" + 7 * Z, [b"\x1b89" + 5 * Z]),
        ],
    ),
    "of more bytes, in blocks above the threshold": (
        {},
        DIGITS,
        [(b"\xa4\x00\x20\x00\x7f\x08\x00\x00", [b"\xc6\x00\x20\x00\x09" + 3 * Z])],
    ),
}


@pytest.mark.parametrize("kind", DOWNLOADS)
def test_block_downloads_go_as_the_standard_says(shelf, kind):
    options, value, conversation = DOWNLOADS[kind]
    shelf.objects[0x2000, 0] = b"before"
    server = SdoServer(shelf, **options)
    converse(server, conversation)
    assert shelf.written == [value]
    assert server.handle(b"\xc1" + 7 * Z) == abort(0, 0, 0x05040001)  # all is over


@pytest.mark.parametrize("kind", UPLOADS)
def test_block_uploads_go_as_the_standard_says(shelf, kind):
    options, value, conversation = UPLOADS[kind]
    shelf.objects[0x2000, 0] = value
    converse(SdoServer(shelf, **options), conversation)


def test_the_servers_block_size_may_change_with_each_acknowledgement(shelf):
    shelf.objects[0x2000, 0] = b"before"
    server = SdoServer(shelf, block_size=1, crc=False)
    server.handle(b"\xc2\x00\x20\x00\x23" + 3 * Z)
    server.block_size = 3
    assert server.handle(b"\x01" + SEGMENTS[0]) == b"\xa2\x01\x03" + 5 * Z
    converse(server, [(b"\x01" + SEGMENTS[1], []), (b"\x02" + SEGMENTS[2], [])])
    assert server.handle(b"\x03" + SEGMENTS[3]) == b"\xa2\x03\x03" + 5 * Z


def test_a_whole_block_is_given_at_once_and_no_more(shelf):
    shelf.objects[0x2000, 0] = bytes(2000)
    server = SdoServer(shelf)
    server.handle(b"\xa4\x00\x20\x00\x7f" + 3 * Z)
    burst = answers(server, b"\xa3" + 7 * Z)
    assert [message[0] for message in burst] == list(range(1, 128))
    burst = answers(server, b"\xa2\x7f\x7f" + 5 * Z)
    assert [message[0] for message in burst] == list(range(1, 128))
    burst = answers(server, b"\xa2\x7f\x7f" + 5 * Z)
    assert [message[0] for message in burst] == [*range(1, 32), 0x80 | 32]  # 286 segments


def test_what_is_pending_ends_with_the_next_request(shelf):
    shelf.objects[0x2000, 0] = LETTERS
    server = SdoServer(shelf)
    server.handle(b"\xa4\x00\x20\x00\x7f" + 3 * Z)
    server.handle(b"\xa3" + 7 * Z)
    assert len(server.pending) == 4
    assert server.handle(b"\x80\x00\x20\x00\x00\x00\x04\x05") is None
    assert server.pending == ()


def test_segments_out_of_sequence_are_counted(shelf):
    shelf.objects[0x2000, 0] = b"before"
    options, _, conversation = DOWNLOADS["with the first lost, two swapped and one twice"]
    server = SdoServer(shelf, **options)
    converse(server, conversation)
    assert server.skipped == 4 + 2 + 1


@pytest.mark.parametrize("block_size", [0, 128, -1])
def test_an_impossible_block_size_is_refused_at_once(shelf, block_size):
    with pytest.raises(ValueError, match=f"not {block_size}"):
        SdoServer(shelf, block_size=block_size)
