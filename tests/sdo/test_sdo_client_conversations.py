"""The client's side, as conversations typed from CiA 301: (what the client must send, what it hears)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.master.sdo_client import SdoDownload, SdoUpload
from torquerig.driver.wire.sdo import AbortCode, SdoAbort

Z = b"\0"


def converse(transfer, conversation):
    """Plays the server's part; the client's requests must be the expected ones."""
    request = transfer.request
    for expected, response in conversation:
        assert request == expected
        request = transfer.step(response)
    assert request is None


def feed(transfer, responses):
    for response in responses:
        transfer.step(response)


@pytest.mark.parametrize(
    ("conversation", "value", "sized"),
    [
        ([(b"\x40\x00\x60\x01" + 4 * Z, b"\x4f\x00\x60\x01\x05" + 3 * Z)], b"\x05", True),
        ([(b"\x40\x00\x60\x01" + 4 * Z, b"\x4b\x00\x60\x01\x37\x02\x00\x00")], b"\x37\x02", True),
        ([(b"\x40\x00\x60\x01" + 4 * Z, b"\x47\x00\x60\x01\x01\x02\x03\x00")], b"\x01\x02\x03", True),
        ([(b"\x40\x00\x60\x01" + 4 * Z, b"\x43\x00\x60\x01\x01\x02\x03\x04")], b"\x01\x02\x03\x04", True),
        ([(b"\x40\x00\x60\x01" + 4 * Z, b"\x42\x00\x60\x01\x05\x00\x00\x00")], b"\x05\x00\x00\x00", False),
        (
            [
                (b"\x40\x00\x60\x01" + 4 * Z, b"\x41\x00\x60\x01\x0a\x00\x00\x00"),
                (b"\x60" + 7 * Z, b"\x000123456"),
                (b"\x70" + 7 * Z, b"\x19789" + 4 * Z),
            ],
            b"0123456789",
            True,
        ),
        (
            [  # size not indicated, and a short segment that is not the last
                (b"\x40\x00\x60\x01" + 4 * Z, b"\x40\x00\x60\x01" + 4 * Z),
                (b"\x60" + 7 * Z, b"\x0a01" + 5 * Z),
                (b"\x70" + 7 * Z, b"\x112345678"),
            ],
            b"012345678",
            True,
        ),
        (
            [
                (b"\x40\x00\x60\x01" + 4 * Z, b"\x41\x00\x60\x01\x00\x00\x00\x00"),
                (b"\x60" + 7 * Z, b"\x0f" + 7 * Z),
            ],
            b"",
            True,
        ),
    ],
)
def test_uploads_go_as_the_standard_says(conversation, value, sized):
    upload = SdoUpload(0x6000, 1)
    converse(upload, conversation)
    assert upload.done
    assert upload.result == value
    assert upload.size_indicated is sized
    assert upload.farewell is None


@pytest.mark.parametrize(
    ("value", "conversation"),
    [
        (b"\x0a", [(b"\x2f\x00\x60\x01\x0a\x00\x00\x00", b"\x60\x00\x60\x01" + 4 * Z)]),
        (b"\x64\x00", [(b"\x2b\x00\x60\x01\x64\x00\x00\x00", b"\x60\x00\x60\x01" + 4 * Z)]),
        (b"\x01\x02\x03", [(b"\x27\x00\x60\x01\x01\x02\x03\x00", b"\x60\x00\x60\x01" + 4 * Z)]),
        (b"\x01\x02\x03\x04", [(b"\x23\x00\x60\x01\x01\x02\x03\x04", b"\x60\x00\x60\x01" + 4 * Z)]),
        (
            b"0123456789",
            [
                (b"\x21\x00\x60\x01\x0a\x00\x00\x00", b"\x60\x00\x60\x01" + 4 * Z),
                (b"\x000123456", b"\x20" + 7 * Z),
                (b"\x19789" + 4 * Z, b"\x30" + 7 * Z),
            ],
        ),
        (
            b"0123456",
            [
                (b"\x21\x00\x60\x01\x07\x00\x00\x00", b"\x60\x00\x60\x01" + 4 * Z),
                (b"\x010123456", b"\x20" + 7 * Z),
            ],
        ),
        (
            b"",
            [
                (b"\x21\x00\x60\x01\x00\x00\x00\x00", b"\x60\x00\x60\x01" + 4 * Z),
                (b"\x0f" + 7 * Z, b"\x20" + 7 * Z),
            ],
        ),
    ],
)
def test_downloads_go_as_the_standard_says(value, conversation):
    download = SdoDownload(0x6000, 1, value)
    converse(download, conversation)
    assert download.done
    assert download.farewell is None


SEGMENTED_UPLOAD = [b"\x41\x00\x60\x01\x0a\x00\x00\x00"]


@pytest.mark.parametrize(
    ("responses", "code"),
    [
        ([*SEGMENTED_UPLOAD, b"\x100123456"], 0x05030000),  # the first segment has t = 0
        ([*SEGMENTED_UPLOAD, b"\x000123456", b"\x000123456"], 0x05030000),
        ([*SEGMENTED_UPLOAD, b"\x000123456", b"\x100123456"], 0x06070012),  # 14 bytes of 10
        ([*SEGMENTED_UPLOAD, b"\x010123456"], 0x06070013),  # 7 bytes of 10
        ([*SEGMENTED_UPLOAD, b"\x0e" + 7 * Z], 0x08000000),  # an empty segment that is not the last
        ([b"\xe0" + 7 * Z], 0x05040001),  # specifier 7
        ([b"\xc2\x00\x60\x01\x0a\x00\x00\x00"], 0x05040001),  # block upload, which nobody asked for
        ([b"\x41\x00\x60\x01\x65\x00\x00\x00"], 0x05040005),  # 101 bytes
        ([b"\x40\x00\x60\x01" + 4 * Z, *[b"\x000123456", b"\x100123456"] * 8], 0x05040005),
    ],
)
def test_a_server_that_breaks_an_upload_is_told_why(responses, code):
    upload = SdoUpload(0x6000, 1, max_bytes=100)
    with pytest.raises(SdoAbort) as caught:
        feed(upload, responses)
    assert caught.value.code == code
    assert (caught.value.index, caught.value.subindex) == (0x6000, 1)
    assert upload.farewell == b"\x80\x00\x60\x01" + code.to_bytes(4, "little")
    assert not upload.done


@pytest.mark.parametrize(
    ("responses", "code"),
    [
        ([b"\x60\x00\x60\x01" + 4 * Z, b"\x30" + 7 * Z], 0x05030000),
        ([b"\x60\x00\x60\x01" + 4 * Z, b"\x20" + 7 * Z, b"\x20" + 7 * Z], 0x05030000),
        ([b"\xe0" + 7 * Z], 0x05040001),
    ],
)
def test_a_server_that_breaks_a_download_is_told_why(responses, code):
    download = SdoDownload(0x6000, 1, b"0123456789")
    with pytest.raises(SdoAbort) as caught:
        feed(download, responses)
    assert caught.value.code == code
    assert download.farewell == b"\x80\x00\x60\x01" + code.to_bytes(4, "little")


@pytest.mark.parametrize("transfer", [SdoUpload(0x6000, 1), SdoDownload(0x6000, 1, b"x")])
def test_a_server_that_aborts_is_heard_and_not_answered(transfer):
    with pytest.raises(SdoAbort, match="object does not exist") as caught:
        transfer.step(b"\x80\x00\x60\x01\x00\x00\x02\x06")
    assert caught.value.code == AbortCode.NO_OBJECT
    assert transfer.farewell is None


def test_an_abort_that_names_nobody_is_for_the_transfer_under_way():
    with pytest.raises(SdoAbort, match="command specifier"):
        SdoUpload(0x6000, 1).step(b"\x80\x00\x00\x00\x01\x00\x04\x05")


@pytest.mark.parametrize(
    "stale",
    [
        b"\x4b\x41\x60\x00\x37\x02\x00\x00",  # a late answer to an upload of 6041
        b"\x60\x17\x10\x00" + 4 * Z,  # a late answer to a download
        b"\x60\x00\x60\x01" + 4 * Z,  # of the same object even
        b"\x000123456",  # a late segment
        b"\x20" + 7 * Z,
        b"\x80\x41\x60\x00\x00\x00\x02\x06",  # another transfer's abort
        b"\x4b\x41\x60",  # malformed
    ],
)
def test_an_answer_to_something_else_is_counted_and_changes_nothing(stale):
    upload = SdoUpload(0x6000, 1)
    assert upload.step(stale) is None
    assert upload.ignored == 1
    assert not upload.done
    assert upload.step(b"\x4f\x00\x60\x01\x05\x00\x00\x00") is None
    assert upload.done
    assert upload.result == b"\x05"


def test_an_answer_after_the_end_is_counted():
    upload = SdoUpload(0x6000, 1)
    for _ in range(2):
        upload.step(b"\x4f\x00\x60\x01\x05\x00\x00\x00")
    assert (upload.done, upload.result, upload.ignored) == (True, b"\x05", 1)


def test_a_caller_out_of_patience_gets_the_message_to_send():
    upload = SdoUpload(0x1008, 0)
    assert upload.abort() == b"\x80\x08\x10\x00\x00\x00\x04\x05" == upload.farewell
    assert upload.step(b"\x4f\x08\x10\x00\x05\x00\x00\x00") is None
    assert not upload.done


def test_request_is_the_message_sent_last():
    download = SdoDownload(0x6000, 1, b"0123456789")
    download.step(b"\x60\x00\x60\x01" + 4 * Z)
    assert download.request == b"\x000123456"


def test_an_impossible_object_is_refused_at_once():
    with pytest.raises(ValueError, match="0x10000"):
        SdoUpload(0x10000, 0)
    with pytest.raises(ValueError, match="0x100"):
        SdoDownload(0x1000, 256, b"x")


@pytest.mark.parametrize("make", [lambda: SdoUpload(0x6000, 1), lambda: SdoDownload(0x6000, 1, b"0123456789")])
@given(responses=st.lists(st.binary(max_size=12) | st.binary(min_size=8, max_size=8), max_size=20))
def test_any_responses_end_well_or_in_an_abort(make, responses):
    transfer = make()
    try:
        feed(transfer, responses)
    except SdoAbort:
        assert not transfer.done
