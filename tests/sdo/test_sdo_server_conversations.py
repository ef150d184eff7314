"""The server's side, as conversations typed from CiA 301: (what the client sends, what it must hear)."""

import pytest

from torquerig.device_sim.canopen.sdo_server import SdoServer
from torquerig.driver.wire.sdo import AbortCode, SdoAbort

Z = b"\0"
NAME = b"torquerig simulated torque drive"  # 32 bytes: five segments

UPLOADS = {
    "1 byte": ((0x1001, 0), b"\x11", [(b"\x40\x01\x10\x00" + 4 * Z, b"\x4f\x01\x10\x00\x11\x00\x00\x00")]),
    "2 bytes": ((0x6041, 0), b"\x37\x02", [(b"\x40\x41\x60\x00" + 4 * Z, b"\x4b\x41\x60\x00\x37\x02\x00\x00")]),
    "3 bytes": ((0x2345, 1), b"\x01\x02\x03", [(b"\x40\x45\x23\x01" + 4 * Z, b"\x47\x45\x23\x01\x01\x02\x03\x00")]),
    "4 bytes": (
        (0x1000, 0),
        b"\x92\x01\x02\x00",
        [(b"\x40\x00\x10\x00" + 4 * Z, b"\x43\x00\x10\x00\x92\x01\x02\x00")],
    ),
    "8 bytes": (
        (0x2130, 0),
        b"\x01\x02\x03\x04\x05\x06\x07\x08",
        [
            (b"\x40\x30\x21\x00" + 4 * Z, b"\x41\x30\x21\x00\x08\x00\x00\x00"),
            (b"\x60" + 7 * Z, b"\x00\x01\x02\x03\x04\x05\x06\x07"),
            (b"\x70" + 7 * Z, b"\x1d\x08" + 6 * Z),  # t = 1, n = 6, c = 1
        ],
    ),
    "32 bytes": (
        (0x1008, 0),
        NAME,
        [
            (b"\x40\x08\x10\x00" + 4 * Z, b"\x41\x08\x10\x00\x20\x00\x00\x00"),
            (b"\x60" + 7 * Z, b"\x00torquer"),
            (b"\x70" + 7 * Z, b"\x10ig simu"),
            (b"\x60" + 7 * Z, b"\x00lated t"),
            (b"\x70" + 7 * Z, b"\x10orque d"),
            (b"\x60" + 7 * Z, b"\x07rive" + 3 * Z),  # t = 0, n = 3, c = 1
        ],
    ),
    "nothing": (
        (0x2000, 0),
        b"",
        [
            (b"\x40\x00\x20\x00" + 4 * Z, b"\x41\x00\x20\x00\x00\x00\x00\x00"),
            (b"\x60" + 7 * Z, b"\x0f" + 7 * Z),  # n = 7, c = 1
        ],
    ),
}

DOWNLOADS = {
    "1 byte": ((0x1019, 0), b"\x0a", [(b"\x2f\x19\x10\x00\x0a\x00\x00\x00", b"\x60\x19\x10\x00" + 4 * Z)]),
    "2 bytes": ((0x1017, 0), b"\x64\x00", [(b"\x2b\x17\x10\x00\x64\x00\x00\x00", b"\x60\x17\x10\x00" + 4 * Z)]),
    "3 bytes": ((0x2345, 1), b"\x01\x02\x03", [(b"\x27\x45\x23\x01\x01\x02\x03\x00", b"\x60\x45\x23\x01" + 4 * Z)]),
    "4 bytes": ((0x1006, 0), b"\xa0\x0f\x00\x00", [(b"\x23\x06\x10\x00\xa0\x0f\x00\x00", b"\x60\x06\x10\x00" + 4 * Z)]),
    "4 bytes of size unsaid": (
        (0x1006, 0),
        b"\xa0\x0f\x00\x00",
        [(b"\x22\x06\x10\x00\xa0\x0f\x00\x00", b"\x60\x06\x10\x00" + 4 * Z)],
    ),
    "10 bytes": (
        (0x2000, 0),
        b"0123456789",
        [
            (b"\x21\x00\x20\x00\x0a\x00\x00\x00", b"\x60\x00\x20\x00" + 4 * Z),
            (b"\x000123456", b"\x20" + 7 * Z),
            (b"\x19789" + 4 * Z, b"\x30" + 7 * Z),  # t = 1, n = 4, c = 1
        ],
    ),
    "10 bytes of size unsaid": (
        (0x2000, 0),
        b"0123456789",
        [
            (b"\x20\x00\x20\x00" + 4 * Z, b"\x60\x00\x20\x00" + 4 * Z),
            (b"\x000123456", b"\x20" + 7 * Z),
            (b"\x19789" + 4 * Z, b"\x30" + 7 * Z),
        ],
    ),
    "2 bytes in a segment": (
        (0x2000, 0),
        b"ab",
        [
            (b"\x21\x00\x20\x00\x02\x00\x00\x00", b"\x60\x00\x20\x00" + 4 * Z),
            (b"\x0bab" + 5 * Z, b"\x20" + 7 * Z),
        ],
    ),
    "nothing": (
        (0x2000, 0),
        b"",
        [
            (b"\x21\x00\x20\x00" + 4 * Z, b"\x60\x00\x20\x00" + 4 * Z),
            (b"\x0f" + 7 * Z, b"\x20" + 7 * Z),
        ],
    ),
}


def abort(index, subindex, code):
    """Protocol abort SDO transfer: 0x80, the multiplexer, the code, numbers with their low byte first."""
    return b"\x80" + index.to_bytes(2, "little") + bytes((subindex,)) + code.to_bytes(4, "little")


@pytest.mark.parametrize("kind", UPLOADS)
def test_uploads_go_as_the_standard_says(shelf, kind):
    where, value, conversation = UPLOADS[kind]
    shelf.objects[where] = value
    server = SdoServer(shelf)
    assert [(request, server.handle(request)) for request, _ in conversation] == conversation


@pytest.mark.parametrize("kind", DOWNLOADS)
def test_downloads_go_as_the_standard_says(shelf, kind):
    where, value, conversation = DOWNLOADS[kind]
    shelf.objects[where] = b"before"
    server = SdoServer(shelf)
    assert [(request, server.handle(request)) for request, _ in conversation] == conversation
    assert shelf.objects[where] == value
    assert shelf.written == [value]


@pytest.mark.parametrize(
    ("request_bytes", "code"),
    [
        (b"\x40\xff\x5f\x00" + 4 * Z, 0x06020000),  # read what is not there
        (b"\x2f\xff\x5f\x00\x01" + 3 * Z, 0x06020000),  # write what is not there
        (b"\x40\x00\x20\x01" + 4 * Z, 0x06010001),  # read what is write-only
        (b"\x2f\x00\x20\x02\x01" + 3 * Z, 0x06010002),  # write what is read-only
        (b"\xe0\x00\x20\x01" + 4 * Z, 0x05040001),  # specifier 7
    ],
)
def test_what_cannot_be_done_is_aborted_with_its_code(shelf, request_bytes, code):
    shelf.objects |= {(0x2000, 1): b"x", (0x2000, 2): b"y"}
    shelf.write_only.add((0x2000, 1))
    shelf.read_only.add((0x2000, 2))
    index, subindex = int.from_bytes(request_bytes[1:3], "little"), request_bytes[3]
    assert SdoServer(shelf).handle(request_bytes) == abort(index, subindex, code)


@pytest.mark.parametrize(
    "code",
    [
        *(AbortCode.UNSUPPORTED_ACCESS, AbortCode.TOO_LONG, AbortCode.TOO_SHORT, AbortCode.LENGTH),
        *(AbortCode.NO_SUBINDEX, AbortCode.INVALID_VALUE, AbortCode.VALUE_TOO_HIGH, AbortCode.VALUE_TOO_LOW),
        *(AbortCode.GENERAL, AbortCode.CANNOT_STORE, AbortCode.LOCAL_CONTROL, AbortCode.DEVICE_STATE),
    ],
)
def test_the_dictionarys_reason_reaches_the_client(shelf, code):
    def refuse(*_args):
        raise SdoAbort(code)

    shelf.read = shelf.write = refuse
    server = SdoServer(shelf)
    assert server.handle(b"\x40\x00\x20\x01" + 4 * Z) == abort(0x2000, 1, code)
    assert server.handle(b"\x2f\x00\x20\x01\x05" + 3 * Z) == abort(0x2000, 1, code)
    assert server.handle(b"\x21\x00\x20\x01\x01" + 3 * Z) == b"\x60\x00\x20\x01" + 4 * Z
    assert server.handle(b"\x0d\x05" + 6 * Z) == abort(0x2000, 1, code)  # known at the last segment only


@pytest.mark.parametrize("segment", [b"\x60" + 7 * Z, b"\x70" + 7 * Z, b"\x001234567", b"\x111234567"])
def test_a_segment_without_a_transfer_is_an_unknown_command(shelf, segment):
    assert SdoServer(shelf).handle(segment) == abort(0, 0, 0x05040001)


def test_a_toggle_bit_that_does_not_alternate_ends_an_upload(shelf):
    shelf.objects[0x1008, 0] = NAME
    server = SdoServer(shelf)
    server.handle(b"\x40\x08\x10\x00" + 4 * Z)
    assert server.handle(b"\x70" + 7 * Z) == abort(0x1008, 0, 0x05030000)
    assert server.handle(b"\x60" + 7 * Z) == abort(0, 0, 0x05040001)


def test_a_toggle_bit_that_does_not_alternate_ends_a_download(shelf):
    shelf.objects[0x2000, 0] = b"before"
    server = SdoServer(shelf)
    server.handle(b"\x21\x00\x20\x00\x0a\x00\x00\x00")
    server.handle(b"\x000123456")
    assert server.handle(b"\x09789" + 4 * Z) == abort(0x2000, 0, 0x05030000)
    assert shelf.objects[0x2000, 0] == b"before"


def test_a_segment_of_the_other_direction_ends_the_transfer(shelf):
    shelf.objects[0x1008, 0] = NAME
    server = SdoServer(shelf)
    server.handle(b"\x40\x08\x10\x00" + 4 * Z)
    assert server.handle(b"\x001234567") == abort(0x1008, 0, 0x05040001)
    server.handle(b"\x21\x08\x10\x00\x0a\x00\x00\x00")
    assert server.handle(b"\x60" + 7 * Z) == abort(0x1008, 0, 0x05040001)


def test_more_than_was_announced_is_too_long(shelf):
    shelf.objects[0x2000, 0] = b"before"
    server = SdoServer(shelf)
    server.handle(b"\x21\x00\x20\x00\x05\x00\x00\x00")
    assert server.handle(b"\x000123456") == abort(0x2000, 0, 0x06070012)
    assert shelf.written == []


def test_less_than_was_announced_is_too_short(shelf):
    shelf.objects[0x2000, 0] = b"before"
    server = SdoServer(shelf)
    server.handle(b"\x21\x00\x20\x00\x0a\x00\x00\x00")
    assert server.handle(b"\x09789" + 4 * Z) == abort(0x2000, 0, 0x06070013)
    assert shelf.written == []


def test_a_client_that_aborts_ends_the_transfer_and_hears_nothing(shelf):
    shelf.objects[0x2000, 0] = b"before"
    server = SdoServer(shelf)
    server.handle(b"\x21\x00\x20\x00\x0a\x00\x00\x00")
    assert server.handle(b"\x80\x00\x20\x00\x00\x00\x04\x05") is None
    assert server.aborted == 1
    assert server.handle(b"\x000123456") == abort(0, 0, 0x05040001)
    assert shelf.written == []


def test_an_abort_without_a_transfer_changes_nothing(shelf):
    server = SdoServer(shelf)
    assert server.handle(b"\x80\x00\x20\x00\x00\x00\x04\x05") is None
    assert server.aborted == 0


def test_a_new_initiate_replaces_the_transfer_under_way(shelf):
    shelf.objects |= {(0x1008, 0): NAME, (0x1001, 0): b"\x00", (0x2000, 0): b"before"}
    server = SdoServer(shelf)
    server.handle(b"\x21\x00\x20\x00\x0a\x00\x00\x00")
    server.handle(b"\x000123456")
    assert server.handle(b"\x40\x08\x10\x00" + 4 * Z) == b"\x41\x08\x10\x00\x20\x00\x00\x00"
    assert server.handle(b"\x60" + 7 * Z) == b"\x00torquer"
    assert server.handle(b"\x40\x01\x10\x00" + 4 * Z) == b"\x4f\x01\x10\x00" + 4 * Z
    assert server.handle(b"\x70" + 7 * Z) == abort(0, 0, 0x05040001)
    assert shelf.written == []


def test_an_initiate_that_fails_also_ends_the_transfer_under_way(shelf):
    shelf.objects[0x1008, 0] = NAME
    server = SdoServer(shelf)
    server.handle(b"\x40\x08\x10\x00" + 4 * Z)
    assert server.handle(b"\x40\x99\x10\x00" + 4 * Z) == abort(0x1099, 0, 0x06020000)
    assert server.handle(b"\x60" + 7 * Z) == abort(0, 0, 0x05040001)


def test_a_download_beyond_the_bound_is_refused_when_announced(shelf):
    server = SdoServer(shelf, max_bytes=100)
    assert server.handle(b"\x21\x00\x20\x00\x65\x00\x00\x00") == abort(0x2000, 0, 0x05040005)
    assert server.handle(b"\x21\x00\x20\x00\x64\x00\x00\x00") == b"\x60\x00\x20\x00" + 4 * Z


def test_a_download_that_grows_beyond_the_bound_is_refused(shelf):
    server = SdoServer(shelf, max_bytes=10)
    server.handle(b"\x20\x00\x20\x00" + 4 * Z)
    assert server.handle(b"\x000123456") == b"\x20" + 7 * Z
    assert server.handle(b"\x100123456") == abort(0x2000, 0, 0x05040005)


def test_expedited_data_of_unsaid_size_take_the_objects_size_where_it_is_known(shelf):
    shelf.objects |= {(0x1017, 0): b"\x00\x00", (0x2000, 0): b"variable"}
    server = SdoServer(shelf, size_of=lambda index, _subindex: 2 if index == 0x1017 else None)
    assert server.handle(b"\x22\x17\x10\x00\x64\x00\xaa\xbb") == b"\x60\x17\x10\x00" + 4 * Z
    assert server.handle(b"\x22\x00\x20\x00\x64\x00\xaa\xbb") == b"\x60\x00\x20\x00" + 4 * Z
    assert shelf.written == [b"\x64\x00", b"\x64\x00\xaa\xbb"]


def test_a_reset_forgets_the_transfer(shelf):
    shelf.objects[0x1008, 0] = NAME
    server = SdoServer(shelf)
    server.handle(b"\x40\x08\x10\x00" + 4 * Z)
    server.reset()
    assert server.handle(b"\x60" + 7 * Z) == abort(0, 0, 0x05040001)


@pytest.mark.parametrize("data", [b"", 7 * Z, 9 * Z])
def test_what_is_not_8_bytes_is_counted_and_not_answered(shelf, data):
    server = SdoServer(shelf)
    assert server.handle(data) is None
    assert server.malformed == 1
