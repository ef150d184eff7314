"""How block transfers end early at the client, and what it takes no notice of."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.master.sdo_block_client import SdoBlockDownload, SdoBlockUpload
from torquerig.driver.wire.sdo import AbortCode, SdoAbort

Z = b"\0"
DIGITS = b"123456789"
LETTERS = b"abcdefghijklmnopqrstuvwxyzABCDEFGHI"  # five segments
SEGMENTS = [b"abcdefg", b"hijklmn", b"opqrstu", b"vwxyzAB", b"CDEFGHI"]
UNKNOWN = b"\x80\x00\x60\x01\x01\x00\x04\x05"  # 0504 0001


def feed(transfer, responses):
    for response in responses:
        transfer.step(response)


OFFER = b"\xc6\x00\x60\x01\x09" + 3 * Z
FIRST, SECOND = b"\x011234567", b"\x8289" + 5 * Z


@pytest.mark.parametrize(
    ("responses", "code"),
    [
        ([OFFER, b"\x00" + SEGMENTS[0]], 0x05040003),
        ([OFFER, b"\x05" + SEGMENTS[0]], 0x05040003),  # the block has 4
        ([OFFER, FIRST, SECOND, b"\xd5\xc4\x31" + 5 * Z], 0x05040004),
        ([OFFER, FIRST, b"\x8299" + 5 * Z, b"\xd5\xc3\x31" + 5 * Z], 0x05040004),
        ([b"\xc2\x00\x60\x01\x06" + 3 * Z, FIRST, SECOND], 0x06070012),
        ([b"\xc2\x00\x60\x01\x0a" + 3 * Z, FIRST, SECOND, b"\xd5" + 7 * Z], 0x06070013),
        ([b"\xc2\x00\x60\x01\x15" + 3 * Z], 0x05040005),  # 21 bytes of 20
        ([b"\xc0\x00\x60\x01" + 4 * Z, FIRST, b"\x021234567", b"\x031234567", b"\x041234567"], 0x05040005),
        ([b"\xe0\x00\x60\x01" + 4 * Z], 0x05040001),  # specifier 7
        ([b"\xa3\x00\x60\x01" + 4 * Z], 0x05040001),  # a request
        ([b"\xc0\x00\x60\x01" + 4 * Z, *[b"\x82" + 7 * Z] * 17], 0x05040003),  # never the first segment
    ],
)
def test_a_server_that_breaks_a_block_upload_is_told_why(responses, code):
    upload = SdoBlockUpload(0x6000, 1, block_size=4, max_bytes=20)
    with pytest.raises(SdoAbort) as caught:
        feed(upload, responses)
    assert caught.value.code == code
    assert (caught.value.index, caught.value.subindex) == (0x6000, 1)
    assert upload.farewell == b"\x80\x00\x60\x01" + code.to_bytes(4, "little")
    assert not upload.done
    assert not upload.receiving
    assert upload.overdue() is None


@pytest.mark.parametrize(
    ("responses", "code"),
    [
        ([b"\xa4\x00\x60\x01\x00" + 3 * Z], 0x05040002),
        ([b"\xa4\x00\x60\x01\x80" + 3 * Z], 0x05040002),
        ([b"\xa4\x00\x60\x01\x01" + 3 * Z, b"\xa2\x01\x00" + 5 * Z], 0x05040002),
        ([b"\xa4\x00\x60\x01\x01" + 3 * Z, b"\xa2\x02\x7f" + 5 * Z], 0x05040003),
        ([b"\xa4\x00\x60\x01\x7f" + 3 * Z, *[b"\xa2\x00\x7f" + 5 * Z] * 17], 0x05040003),
        ([b"\xe0\x00\x60\x01" + 4 * Z], 0x05040001),
    ],
)
def test_a_server_that_breaks_a_block_download_is_told_why(responses, code):
    download = SdoBlockDownload(0x6000, 1, DIGITS)
    with pytest.raises(SdoAbort) as caught:
        feed(download, responses)
    assert caught.value.code == code
    assert download.farewell == b"\x80\x00\x60\x01" + code.to_bytes(4, "little")
    assert download.pending == ()
    assert not download.done


@pytest.mark.parametrize("before", [[], [OFFER], [OFFER, FIRST], [OFFER, FIRST, SECOND]])
def test_a_server_that_aborts_a_block_upload_is_heard_and_not_answered(before):
    upload = SdoBlockUpload(0x6000, 1)
    feed(upload, before)
    with pytest.raises(SdoAbort, match="out of memory"):
        upload.step(b"\x80\x00\x60\x01\x05\x00\x04\x05")
    assert upload.farewell is None


@pytest.mark.parametrize("before", [[], [b"\xa4\x00\x60\x01\x01" + 3 * Z]])
def test_a_server_that_aborts_a_block_download_is_heard_and_not_answered(before):
    download = SdoBlockDownload(0x6000, 1, DIGITS)
    feed(download, before)
    with pytest.raises(SdoAbort, match="CRC"):
        download.step(b"\x80\x00\x60\x01\x04\x00\x04\x05")
    assert download.farewell is None


@pytest.mark.parametrize("transfer", [SdoBlockUpload(0x6000, 1), SdoBlockDownload(0x6000, 1, DIGITS)])
def test_without_leave_nobody_falls_back(transfer):
    with pytest.raises(SdoAbort, match="command specifier") as caught:
        transfer.step(UNKNOWN)
    assert caught.value.code == AbortCode.COMMAND_SPECIFIER


@pytest.mark.parametrize(
    "transfer", [SdoBlockUpload(0x6000, 1, fall_back=True), SdoBlockDownload(0x6000, 1, DIGITS, fall_back=True)]
)
def test_another_reason_is_no_cause_to_fall_back(transfer):
    with pytest.raises(SdoAbort, match="does not exist"):
        transfer.step(b"\x80\x00\x60\x01\x00\x00\x02\x06")


def test_a_change_of_protocol_that_was_not_allowed_is_not_for_this_transfer():
    upload = SdoBlockUpload(0x6000, 1)
    assert upload.step(b"\x4f\x00\x60\x01\x05" + 3 * Z) is None
    assert upload.ignored == 1


@pytest.mark.parametrize(
    "stale",
    [
        b"\x4b\x41\x60\x00\x37\x02\x00\x00",
        b"\xc6\x41\x60\x00\x09" + 3 * Z,  # another object's
        b"\x80\x41\x60\x00\x00\x00\x02\x06",
        b"\xd5\xc3\x31" + 5 * Z,  # of another step
        b"\xa2\x01\x7f" + 5 * Z,
        b"\x011234567",
        b"\xc6\x00\x60",
    ],
)
def test_an_answer_to_something_else_is_counted_and_changes_nothing(stale):
    upload = SdoBlockUpload(0x6000, 1)
    assert upload.step(stale) is None
    assert upload.ignored == 1
    feed(upload, [OFFER, FIRST, SECOND, b"\xd5\xc3\x31" + 5 * Z])
    assert upload.done
    assert upload.result == DIGITS


def test_a_caller_out_of_patience_gets_the_message_to_send():
    download = SdoBlockDownload(0x6000, 1, LETTERS)
    download.step(b"\xa4\x00\x60\x01\x7f" + 3 * Z)
    assert len(download.pending) == 4
    assert download.abort() == b"\x80\x00\x60\x01\x00\x00\x04\x05" == download.farewell
    assert download.pending == ()


def test_a_server_that_falls_silent_in_a_block_can_be_asked_for_the_rest():
    upload = SdoBlockUpload(0x6000, 1)
    assert upload.overdue() is None
    upload.step(OFFER)
    assert upload.receiving
    upload.step(FIRST)
    assert upload.overdue() == b"\xa2\x01\x7f" + 5 * Z
    assert upload.step(b"\x8189" + 5 * Z) == b"\xa2\x01\x7f" + 5 * Z
    assert not upload.receiving
    assert upload.overdue() is None


@pytest.mark.parametrize(
    "make",
    [
        lambda: SdoBlockUpload(0x10000, 0),
        lambda: SdoBlockUpload(0x1000, 0, block_size=0),
        lambda: SdoBlockUpload(0x1000, 0, block_size=128),
        lambda: SdoBlockUpload(0x1000, 0, switch_threshold=256),
        lambda: SdoBlockDownload(0x1000, 256, b"x"),
    ],
)
def test_an_impossible_transfer_is_refused_at_once(make):
    with pytest.raises(ValueError, match=r"0x10000|0x100|not 0|not 128|not 256"):
        make()


heads = st.sampled_from(
    [0xC0, 0xC2, 0xC4, 0xC6, 0xC1, 0xDD, 0xA0, 0xA4, 0xA1, 0xA2, 1, 2, 3, 4, 0x81, 0x82, 0x83, 0x84]
)
likely = st.tuples(heads, st.binary(min_size=7, max_size=7)).map(lambda pair: bytes((pair[0],)) + pair[1])
named = st.tuples(heads, st.integers(0, 9)).map(lambda pair: bytes((pair[0], 0, 0x60, 1, pair[1], 0, 0, 0)))
numbered = st.tuples(heads, st.integers(0, 4)).map(lambda pair: bytes((pair[0], pair[1], 4, 0, 0, 0, 0, 0)))


@pytest.mark.parametrize(
    "make",
    [
        lambda: SdoBlockUpload(0x6000, 1, block_size=4, switch_threshold=20, fall_back=True, max_bytes=50),
        lambda: SdoBlockDownload(0x6000, 1, LETTERS, fall_back=True),
    ],
)
@given(responses=st.lists(named | numbered | likely | st.binary(max_size=9), max_size=40))
def test_any_responses_end_well_or_in_an_abort(make, responses):
    transfer = make()
    try:
        for response in responses:
            transfer.step(response)
            assert len(transfer.pending) <= 126
    except SdoAbort:
        assert not transfer.done
