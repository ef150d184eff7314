"""SYNC with and without counter (CiA 301, 7.2.5)."""

import pytest

from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sync import SYNC_FRAME, Sync, decode_sync, encode_sync


def test_sync_is_identifier_80_without_data():
    assert encode_sync() == Frame(0x080, b"") == SYNC_FRAME
    assert decode_sync(Frame(0x080, b"")) == Sync(None)


@pytest.mark.parametrize(("counter", "data"), [(1, b"\x01"), (240, b"\xf0")])
def test_a_counter_is_one_byte(counter, data):
    assert encode_sync(counter) == Frame(0x080, data)
    assert decode_sync(Frame(0x080, data)) == Sync(counter)


def test_sync_follows_its_cob_id():
    assert encode_sync(cob_id=0x90) == Frame(0x90)
    assert decode_sync(Frame(0x90), cob_id=0x90) == Sync(None)
    assert decode_sync(Frame(0x80), cob_id=0x90) is None


@pytest.mark.parametrize(
    "frame", [Frame(0x81), Frame(0x80, b"\x01\x02"), Frame(0x80, remote=True), Frame(0x80, extended=True)]
)
def test_what_is_no_sync_decodes_to_none(frame):
    assert decode_sync(frame) is None


@pytest.mark.parametrize("counter", [0, 241])
def test_a_counter_out_of_range_is_refused(counter):
    with pytest.raises(ValueError, match=str(counter)):
        encode_sync(counter)
