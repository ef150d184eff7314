"""PDO layouts, mapping entries and transmission types."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.wire import pdo
from torquerig.driver.wire.pdo import PdoField, PdoLayout

STATUS = PdoField(0x6041, 0, "H")
POSITION = PdoField(0x6064, 0, "i")
RAW_ACTUAL = PdoField(0x2077, 0, "h")
CONTROL = PdoField(0x6040, 0, "H")
RAW_TARGET = PdoField(0x2071, 0, "h")

# CiA 301, 7.1.4: numbers little-endian, negative ones in two's complement, objects one after another without gaps
GOLDEN = [
    ([STATUS, POSITION, RAW_ACTUAL], (0x1637, -200_000, -1), b"\x37\x16\xc0\xf2\xfc\xff\xff\xff"),
    ([STATUS, POSITION, RAW_ACTUAL], (0x0627, 2**31 - 1, -(2**15)), b"\x27\x06\xff\xff\xff\x7f\x00\x80"),
    ([CONTROL, RAW_TARGET], (0x000F, -19_698), b"\x0f\x00\x0e\xb3"),
    ([CONTROL, RAW_TARGET], (0x000F, 19_698), b"\x0f\x00\xf2\x4c"),
    ([PdoField(0x606C, 0, "i"), PdoField(0x2100, 1, "H")], (-600_000, 300), b"\x40\xd8\xf6\xff\x2c\x01"),
    ([PdoField(0x6060, 0, "b"), PdoField(0x2070, 0, "B")], (-1, 255), b"\xff\xff"),
    ([], (), b""),
]


@pytest.mark.parametrize(("fields", "values", "data"), GOLDEN)
def test_values_are_packed_little_endian_both_ways(fields, values, data):
    layout = PdoLayout(fields)
    assert layout.pack(values) == data
    assert layout.unpack(data) == values
    assert layout.size == len(data)


def test_mapping_entries_are_index_subindex_bits():
    # CiA 301, structure of PDO mapping: bits 31 to 16 index, 15 to 8 sub-index, 7 to 0 length in bits
    assert pdo.mapping_entry(0x6041, 0, 16) == 0x60410010
    assert pdo.mapping_entry(0x2100, 1, 16) == 0x21000110
    assert pdo.split_mapping_entry(0x60640020) == (0x6064, 0, 32)
    assert PdoLayout([STATUS, POSITION, RAW_ACTUAL]).mapping == (0x60410010, 0x60640020, 0x20770010)


def test_surplus_data_are_ignored_and_missing_data_are_told():
    layout = PdoLayout([CONTROL, RAW_TARGET])
    assert layout.unpack(b"\x0f\x00\x01\x00\xff\xff") == (15, 1)
    assert layout.unpack(b"\x0f\x00\x01") is None


@pytest.mark.parametrize("entry", [(0x10000, 0, 8), (-1, 0, 8), (0x6041, 256, 8), (0x6041, 0, 0), (0x6041, 0, 256)])
def test_an_impossible_mapping_entry_is_refused(entry):
    with pytest.raises(ValueError, match="no mapping entry"):
        pdo.mapping_entry(*entry)


def test_a_layout_beyond_8_bytes_is_refused():
    with pytest.raises(ValueError, match="have 12"):
        PdoLayout([POSITION, POSITION, POSITION])


@pytest.mark.parametrize("code", ["x", "2h", "s", "", "<h", "n"])
def test_a_code_that_is_no_plain_number_is_refused(code):
    with pytest.raises(ValueError, match="6041:0"):
        PdoLayout([PdoField(0x6041, 0, code)])


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ((0x0F, 40_000), "40000 does not fit object 2071:0"),
        ((-1, 0), "-1 does not fit object 6040:0"),
        ((0x0F, 0.5), "0.5 does not fit object 2071:0"),
        ((0x0F,), "has 2 values, not 1"),
    ],
)
def test_a_value_that_does_not_fit_is_named(values, words):
    with pytest.raises(ValueError, match=words):
        PdoLayout([CONTROL, RAW_TARGET]).pack(values)


def test_a_float_that_does_not_fit_is_named():
    with pytest.raises(ValueError, match="2111:0"):
        PdoLayout([PdoField(0x2111, 0, "f")]).pack((1e300,))


@given(st.integers(0, 0xFFFF), st.integers(-(2**31), 2**31 - 1), st.integers(-(2**15), 2**15 - 1))
def test_process_data_survive_the_round_trip(status, position, torque):
    layout = PdoLayout([STATUS, POSITION, RAW_ACTUAL])
    assert layout.unpack(layout.pack((status, position, torque))) == (status, position, torque)


@given(st.integers(0, 0xFFFF), st.integers(0, 0xFF), st.integers(1, 0xFF))
def test_mapping_entries_survive_the_round_trip(index, subindex, bits):
    assert pdo.split_mapping_entry(pdo.mapping_entry(index, subindex, bits)) == (index, subindex, bits)


def test_transmission_types_are_sorted_as_in_the_standard():
    everything = range(256)
    assert [t for t in everything if pdo.is_cyclic(t)] == list(range(1, 241))
    assert [t for t in everything if pdo.is_synchronous(t)] == [*range(241), 252]
    assert [t for t in everything if pdo.allowed_for_rpdo(t)] == [*range(241), 254, 255]
    assert [t for t in everything if pdo.allowed_for_tpdo(t)] == [*range(241), 252, 253, 254, 255]
