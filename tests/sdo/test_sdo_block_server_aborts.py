"""How block transfers end early at the server: abort codes in every phase, silence, and arbitrary bytes."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from torquerig.device_sim.canopen.sdo_server import SdoServer
from torquerig.driver.wire.sdo import AbortCode, SdoAbort

Z = b"\0"
DIGITS = b"123456789"
LETTERS = b"abcdefghijklmnopqrstuvwxyzABCDEFGHI"  # five segments

DOWNLOAD = b"\xc6\x00\x20\x00\x09" + 3 * Z
UPLOAD = b"\xa4\x00\x20\x00\x7f" + 3 * Z
START = b"\xa3" + 7 * Z
ENDED = b"\xa1" + 7 * Z
ABORT = b"\x80\x00\x20\x00\x00\x00\x04\x05"

# what a client has sent before: every phase of both transfers
IN_DOWNLOAD = [[DOWNLOAD], [DOWNLOAD, b"\x011234567"], [DOWNLOAD, b"\x011234567", b"\x8289" + 5 * Z]]
IN_UPLOAD = [
    [UPLOAD],
    [UPLOAD, START],
    [UPLOAD, START, b"\xa2\x01\x7f" + 5 * Z],
    [UPLOAD, START, b"\xa2\x02\x7f\0\0\0\0\0"],
]


def abort(index, subindex, code):
    return b"\x80" + index.to_bytes(2, "little") + bytes((subindex,)) + code.to_bytes(4, "little")


@pytest.fixture
def server(shelf):
    shelf.objects |= {(0x2000, 0): DIGITS, (0x1008, 0): LETTERS}
    return SdoServer(shelf)


def say(server, requests):
    for request in requests:
        response = server.handle(request)
        assert response is None or response[0] != 0x80
    return server


WRONG = [
    # block size
    ([], b"\xa4\x00\x20\x00\x00" + 3 * Z, 0x05040002),
    ([], b"\xa4\x00\x20\x00\x80" + 3 * Z, 0x05040002),
    ([], b"\xa4\x00\x20\x00\xff" + 3 * Z, 0x05040002),
    ([UPLOAD, START], b"\xa2\x01\x00" + 5 * Z, 0x05040002),
    ([UPLOAD, START], b"\xa2\x01\x80" + 5 * Z, 0x05040002),
    # sequence number
    ([UPLOAD, START], b"\xa2\x03\x7f" + 5 * Z, 0x05040003),
    ([UPLOAD, START], b"\xa2\xff\x7f" + 5 * Z, 0x05040003),
    ([DOWNLOAD], 8 * Z, 0x05040003),
    # check sum
    ([DOWNLOAD, b"\x011234567", b"\x8289" + 5 * Z], b"\xd5\xc2\x31" + 5 * Z, 0x05040004),
    ([DOWNLOAD, b"\x011234567", b"\x8288" + 5 * Z], b"\xd5\xc3\x31" + 5 * Z, 0x05040004),
    ([DOWNLOAD, b"\x011234567", b"\x8289" + 5 * Z], b"\xd1\xc3\x31" + 5 * Z, 0x05040004),  # n = 4
    # length, without check sum
    ([b"\xc2\x00\x20\x00\x06" + 3 * Z, b"\x011234567"], b"\x8289" + 5 * Z, 0x06070012),
    ([b"\xc2\x00\x20\x00\x08" + 3 * Z, b"\x011234567", b"\x8289" + 5 * Z], b"\xd5" + 7 * Z, 0x06070012),
    ([b"\xc2\x00\x20\x00\x0a" + 3 * Z, b"\x011234567", b"\x8289" + 5 * Z], b"\xd5" + 7 * Z, 0x06070013),
    # memory
    ([], b"\xc6\x00\x20\x00\x01\x10\x00\x00", 0x05040005),  # 4097 bytes
    # what is not due
    *[([UPLOAD], request, 0x05040001) for request in (ENDED, b"\xa2\x01\x7f" + 5 * Z, b"\xc1" + 7 * Z)],
    *[([UPLOAD, START], request, 0x05040001) for request in (START, ENDED, b"\x60" + 7 * Z, b"\x01" + 7 * Z)],
    *[(IN_UPLOAD[3], request, 0x05040001) for request in (START, b"\xa2\x02\x7f" + 5 * Z, b"\xc1" + 7 * Z)],
    *[(IN_DOWNLOAD[2], request, 0x05040001) for request in (START, ENDED, b"\xa2\x02\x7f" + 5 * Z)],
]


@pytest.mark.parametrize(("before", "request_bytes", "code"), WRONG)
def test_what_a_client_does_wrong_is_aborted_with_its_code(server, shelf, before, request_bytes, code):
    say(server, before)
    assert server.handle(request_bytes) == abort(0x2000, 0, code)
    assert server.pending == ()
    assert not server.receiving
    assert shelf.written == []
    assert server.handle(b"\x40\x00\x20\x00" + 4 * Z) == b"\x41\x00\x20\x00\x09" + 3 * Z  # and all is well again


@pytest.mark.parametrize("request_bytes", [START, ENDED, b"\xa2\x01\x7f" + 5 * Z, b"\xc1" + 7 * Z])
def test_what_needs_a_transfer_is_an_unknown_command_without_one(server, request_bytes):
    assert server.handle(request_bytes) == abort(0, 0, 0x05040001)


def test_a_number_beyond_the_block_is_a_wrong_sequence_number(shelf):
    shelf.objects[0x2000, 0] = b"before"
    server = say(SdoServer(shelf, block_size=4), [DOWNLOAD])
    assert server.handle(b"\x05abcdefg") == abort(0x2000, 0, 0x05040003)


def test_a_download_that_grows_beyond_the_bound_is_refused(shelf):
    shelf.objects[0x2000, 0] = b"before"
    server = say(SdoServer(shelf, max_bytes=10), [b"\xc0\x00\x20\x00" + 4 * Z, b"\x011234567"])
    assert server.handle(b"\x021234567") is None
    assert server.handle(b"\x831234567") == abort(0x2000, 0, 0x05040005)
    say(server, [b"\xc0\x00\x20\x00" + 4 * Z, b"\x011234567", b"\x821234" + 3 * Z])
    assert server.handle(b"\xcd" + 7 * Z) == abort(0x2000, 0, 0x05040005)  # 11 bytes
    say(server, [b"\xc0\x00\x20\x00" + 4 * Z, b"\x011234567", b"\x82123" + 4 * Z, b"\xd1" + 7 * Z])
    assert shelf.written == [b"1234567123"]


@pytest.mark.parametrize("code", [AbortCode.NO_OBJECT, AbortCode.WRITE_ONLY, AbortCode.NO_SUBINDEX, AbortCode.NO_DATA])
def test_the_dictionarys_reason_reaches_who_reads_in_blocks(server, shelf, code):
    def refuse(*_args):
        raise SdoAbort(code)

    shelf.read = refuse
    assert server.handle(UPLOAD) == abort(0x2000, 0, code)
    assert server.handle(START) == abort(0, 0, 0x05040001)


@pytest.mark.parametrize(
    "code", [AbortCode.READ_ONLY, AbortCode.TOO_LONG, AbortCode.CANNOT_STORE, AbortCode.DEVICE_STATE]
)
def test_the_dictionarys_reason_reaches_who_writes_in_blocks(server, shelf, code):
    def refuse(*_args):
        raise SdoAbort(code)

    shelf.write = refuse
    say(server, IN_DOWNLOAD[2])
    assert server.handle(b"\xd5\xc3\x31" + 5 * Z) == abort(0x2000, 0, code)  # known at the end only
    assert server.handle(b"\xd5\xc3\x31" + 5 * Z) == abort(0, 0, 0x05040001)


@pytest.mark.parametrize("before", IN_DOWNLOAD + IN_UPLOAD)
def test_a_client_that_aborts_ends_the_transfer_and_hears_nothing(server, shelf, before):
    say(server, before)
    assert server.handle(ABORT) is None
    assert server.pending == ()
    assert server.aborted == 1
    assert server.handle(b"\xc1" + 7 * Z) == abort(0, 0, 0x05040001)
    assert server.handle(b"\xa2\x00\x7f" + 5 * Z) == abort(0, 0, 0x05040001)
    assert shelf.written == []


@pytest.mark.parametrize("before", [*IN_UPLOAD, IN_DOWNLOAD[2]])
@pytest.mark.parametrize("initiate", [UPLOAD, DOWNLOAD, b"\x40\x00\x20\x00" + 4 * Z, b"\x2f\x00\x20\x00\x01" + 3 * Z])
def test_a_new_initiate_replaces_the_transfer_under_way(server, shelf, before, initiate):
    say(server, before)
    assert server.handle(initiate) == SdoServer(shelf).handle(initiate)
    assert server.pending == ()


def test_in_the_midst_of_a_block_everything_is_a_segment(server):
    say(server, [DOWNLOAD])
    assert server.receiving
    assert server.handle(b"\x40\x00\x20\x00" + 4 * Z) is None  # not an upload, but the 64th segment
    assert server.skipped == 1
    assert server.receiving


@pytest.mark.parametrize("before", IN_DOWNLOAD + IN_UPLOAD)
def test_a_reset_forgets_the_transfer(server, before):
    say(server, before)
    server.reset()
    assert server.pending == ()
    assert not server.receiving
    assert server.handle(b"\xc1" + 7 * Z) == abort(0, 0, 0x05040001)


def test_data_that_are_too_long_are_refused_when_the_block_is_over(server, shelf):
    # the 35th segment, 23 hex, would be an expedited download of its last 4 bytes to 2000:0 if it came after the abort
    say(server, [b"\xc2\x00\x20\x00\x3c" + 3 * Z])
    for number in range(1, 127):
        assert server.handle(bytes((number,)) + b"\x00\x20\x00evil") is None
    assert server.handle(b"\xff\x00\x20\x00evil") == abort(0x2000, 0, 0x06070012)
    assert shelf.written == []
    assert server.handle(b"\x23\x00\x20\x00good") == b"\x60\x00\x20\x00" + 4 * Z


def test_segments_after_an_impossible_one_are_not_taken_for_requests(shelf):
    shelf.objects[0x2000, 0] = b"before"
    server = say(SdoServer(shelf, block_size=4), [b"\xc0\x00\x20\x00" + 4 * Z])
    say(server, [bytes((number,)) + b"\x00\x20\x00evil" for number in range(1, 5)])
    assert server.handle(b"\x05\x00\x20\x00evil") == abort(0x2000, 0, 0x05040003)
    for number in range(6, 128):  # by a client that takes no notice of the block size
        assert server.handle(bytes((number,)) + b"\x00\x20\x00evil") is None
    assert server.skipped == 122
    assert shelf.written == []
    assert server.handle(b"\x23\x00\x20\x00good") == b"\x60\x00\x20\x00" + 4 * Z


@pytest.mark.parametrize(
    ("wrong", "request_bytes"),
    [  # at most 33 segments, 21 hex
        (b"\x00ooooooo", b"\x23\x00\x20\x00good"),
        (b"\x22ooooooo", b"\x2f\x00\x20\x00" + 4 * Z),
        (b"\xa2ooooooo", b"\x23\x00\x20\x00good"),  # goes on, but after the last one nothing does
    ],
)
def test_after_an_impossible_segment_a_request_that_does_not_go_on_is_one(shelf, wrong, request_bytes):
    shelf.objects[0x2000, 0] = b"before"
    server = say(SdoServer(shelf, block_size=0x21), [b"\xc0\x00\x20\x00" + 4 * Z, b"\x011234567"])
    assert server.handle(wrong) == abort(0x2000, 0, 0x05040003)
    assert server.handle(request_bytes) == b"\x60\x00\x20\x00" + 4 * Z
    assert len(shelf.written) == 1


# silence


def test_a_client_that_falls_silent_is_asked_for_the_rest(server):
    say(server, [DOWNLOAD, b"\x011234567"])
    assert server.overdue() == b"\xa2\x01\x7f" + 5 * Z
    assert server.handle(b"\x8189" + 5 * Z) == b"\xa2\x01\x7f" + 5 * Z
    assert not server.receiving
    assert server.handle(b"\xd5\xc3\x31" + 5 * Z) == ENDED


def test_a_client_that_stays_silent_is_given_up_in_the_end(server):
    say(server, [DOWNLOAD, b"\x011234567"])
    asked = [server.overdue() for _ in range(18)]
    assert asked[0] == b"\xa2\x01\x7f" + 5 * Z
    assert set(asked[1:17]) == {b"\xa2\x00\x7f" + 5 * Z}
    assert asked[17] == abort(0x2000, 0, 0x05040000)
    assert server.overdue() is None
    assert server.handle(b"\x40\x00\x20\x00" + 4 * Z) == b"\x41\x00\x20\x00\x09" + 3 * Z


def test_without_sum_and_size_a_block_that_got_lost_whole_is_not_asked_for(shelf):
    # the acknowledgement of the block before may be what was lost, and nothing would show that it came twice
    shelf.objects[0x2000, 0] = b"before"
    server = say(SdoServer(shelf, block_size=1), [b"\xc0\x00\x20\x00" + 4 * Z])
    assert server.overdue() == b"\xa2\x00\x01" + 5 * Z  # before the first block there is no doubt
    say(server, [b"\x011234567"])
    assert server.overdue() == abort(0x2000, 0, 0x05040000)


@pytest.mark.parametrize("before", [[], IN_DOWNLOAD[2], *IN_UPLOAD])
def test_outside_of_a_block_nothing_is_overdue(server, before):
    say(server, before)
    assert server.overdue() is None


def test_a_client_that_never_gets_a_segment_is_given_up(server):
    say(server, [UPLOAD, START, *[b"\xa2\x00\x7f" + 5 * Z] * 16])
    assert server.handle(b"\xa2\x00\x7f" + 5 * Z) == abort(0x2000, 0, 0x05040003)


def test_a_client_that_never_sends_the_first_segment_is_given_up(server):
    say(server, [DOWNLOAD, *[b"\x8289" + 5 * Z] * 16])
    assert server.handle(b"\x8289" + 5 * Z) == abort(0x2000, 0, 0x05040003)


# arbitrary bytes

heads = st.sampled_from([0xA0, 0xA1, 0xA2, 0xA3, 0xA4, 0xC0, 0xC1, 0xC2, 0xC4, 0xC6, 0x80, 1, 2, 3, 0x81, 0x82, 0x83])
likely = st.tuples(heads, st.integers(0, 4), st.integers(0, 4), st.just(0), st.integers(0, 9)).map(
    lambda numbers: bytes(numbers).ljust(8, Z)
)


@given(st.lists(likely | st.binary(min_size=8, max_size=8) | st.binary(max_size=9) | st.none(), max_size=60))
@example([b"\xc0" + 7 * Z, *[bytes((n % 4 + 1,)) + 7 * Z for n in range(60)]])
@example(
    [b"\xc0" + 7 * Z, *[bytes((n % 4 + 1,)) + 7 * Z for n in range(7)], b"\x84" + 7 * Z, b"\xd9" + 7 * Z]
)  # 50 bytes
def test_any_requests_get_8_bytes_each_or_silence(requests):
    class Nothing:
        def read(self, _index, _subindex):
            return bytes(20)

        def write(self, _index, _subindex, data):
            assert len(data) <= 50

    server = SdoServer(Nothing(), max_bytes=50, block_size=4)
    for request in requests:
        response = server.overdue() if request is None else server.handle(request)
        assert response is None or len(response) == 8
        assert len(server.pending) <= 126
        assert all(len(message) == 8 for message in server.pending)
