"""Whatever the wire brings, decoders answer with a value or None."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.wire import cia402, emcy, nmt, pdo, sdo, sync
from torquerig.driver.wire.frame import Frame

frames = st.builds(
    Frame,
    can_id=st.one_of(st.integers(0, 0x7FF), st.integers(-(2**31), 2**32), st.integers(0x700, 0x780)),
    data=st.binary(max_size=64),
    remote=st.booleans(),
    extended=st.booleans(),
)


@pytest.mark.parametrize(
    "decode", [nmt.decode_command, nmt.decode_heartbeat, nmt.decode_guard_request, sync.decode_sync, emcy.decode]
)
@given(frame=frames)
def test_frame_decoders_never_raise(decode, frame):
    decode(frame)


@pytest.mark.parametrize("decode", [sdo.decode_request, sdo.decode_response])
@given(data=st.one_of(st.binary(max_size=64), st.binary(min_size=8, max_size=8)))
def test_sdo_decoders_never_raise_and_know_all_of_8_bytes(decode, data):
    assert (decode(data) is None) == (len(data) != 8)


@given(st.integers())
def test_any_statusword_decodes(statusword):
    assert cia402.decode_state(statusword) in {*cia402.DriveState, None}


@given(st.integers(0, 2**32 - 1))
def test_any_mapping_entry_splits(entry):
    index, subindex, bits = pdo.split_mapping_entry(entry)
    assert index << 16 | subindex << 8 | bits == entry


@given(st.binary(max_size=64))
def test_any_data_unpack(data):
    layout = pdo.PdoLayout([pdo.PdoField(0x6041, 0, "H"), pdo.PdoField(0x6064, 0, "i")])
    assert (layout.unpack(data) is None) == (len(data) < 6)


@given(st.integers())
def test_any_transmission_type_is_judged(transmission_type):
    for judge in (pdo.is_cyclic, pdo.is_synchronous, pdo.allowed_for_rpdo, pdo.allowed_for_tpdo):
        assert judge(transmission_type) in {True, False}
