"""The shipped EDS against the servo protocol's table of objects: type, access and default, one by one."""

import pytest
from canopen.objectdictionary import ODVariable, datatypes

from torquerig.driver.wire.dictionary import DRIVE_EDS, find_variable, load_dictionary

NODE = 5
TYPES = {
    "I8": datatypes.INTEGER8,
    "I16": datatypes.INTEGER16,
    "I32": datatypes.INTEGER32,
    "U8": datatypes.UNSIGNED8,
    "U16": datatypes.UNSIGNED16,
    "U32": datatypes.UNSIGNED32,
    "U64": datatypes.UNSIGNED64,
    "STR": datatypes.VISIBLE_STRING,
}

COUNTED = "counted since power-on"  # no default: what a counter holds when it is first read is no property of a drive

# index, sub-index, type, access, default; None where the table leaves the default open
TABLE = [
    (0x1000, 0, "U32", "ro", 0x00020192),
    (0x1001, 0, "U8", "ro", 0),
    (0x1003, 0, "U8", "rw", 0),
    *((0x1003, sub, "U32", "ro", 0) for sub in range(1, 9)),
    (0x1005, 0, "U32", "rw", 0x80),
    (0x1006, 0, "U32", "rw", 4000),
    (0x1007, 0, "U32", "rw", 0),
    (0x1008, 0, "STR", "const", "torquerig simulated torque drive"),
    (0x1009, 0, "STR", "const", None),
    (0x100A, 0, "STR", "const", None),
    (0x100C, 0, "U16", "rw", 0),
    (0x100D, 0, "U8", "rw", 0),
    (0x1010, 0, "U8", "const", 1),
    (0x1010, 1, "U32", "rw", 1),
    (0x1011, 0, "U8", "const", 1),
    (0x1011, 1, "U32", "rw", 1),
    (0x1014, 0, "U32", "rw", 0x80 + NODE),
    (0x1015, 0, "U16", "rw", 0),
    (0x1016, 0, "U8", "const", 3),
    *((0x1016, sub, "U32", "rw", 0) for sub in (1, 2, 3)),
    (0x1017, 0, "U16", "rw", 50),
    (0x1018, 0, "U8", "const", 4),
    (0x1018, 1, "U32", "ro", 0),
    (0x1018, 2, "U32", "ro", 1),
    (0x1018, 3, "U32", "ro", 0x00010000),
    (0x1018, 4, "U32", "ro", NODE),
    (0x1019, 0, "U8", "rw", 0),
    (0x1028, 0, "U8", "const", 8),
    *((0x1028, sub, "U32", "rw", 0x80000000) for sub in range(1, 9)),
    (0x1029, 0, "U8", "const", 1),
    (0x1029, 1, "U8", "rw", 0),
    (0x1200, 0, "U8", "const", 2),
    (0x1200, 1, "U32", "ro", 0x600 + NODE),
    (0x1200, 2, "U32", "ro", 0x580 + NODE),
    (0x1400, 1, "U32", "rw", 0x200 + NODE),
    (0x1401, 1, "U32", "rw", 0x80000300 + NODE),
    (0x1402, 1, "U32", "rw", 0x80000400 + NODE),
    (0x1403, 1, "U32", "rw", 0x80000500 + NODE),
    (0x1800, 1, "U32", "rw", 0x180 + NODE),
    (0x1801, 1, "U32", "rw", 0x280 + NODE),
    (0x1802, 1, "U32", "rw", 0x80000380 + NODE),
    (0x1803, 1, "U32", "rw", 0x80000480 + NODE),
    (0x1800, 2, "U8", "rw", 1),
    (0x1801, 2, "U8", "rw", 10),
    *((index, 2, "U8", "rw", 255) for index in (0x1400, 0x1401, 0x1402, 0x1403, 0x1802, 0x1803)),
    *((base + n, 0, "U8", "const", 5) for base in (0x1400, 0x1800) for n in range(4)),
    *((base + n, sub, "U16", "rw", 0) for base in (0x1400, 0x1800) for n in range(4) for sub in (3, 5)),
    (0x1600, 0, "U8", "rw", 2),
    (0x1600, 1, "U32", "rw", 0x60400010),
    (0x1600, 2, "U32", "rw", 0x20710010),
    (0x1A00, 0, "U8", "rw", 3),
    (0x1A00, 1, "U32", "rw", 0x60410010),
    (0x1A00, 2, "U32", "rw", 0x60640020),
    (0x1A00, 3, "U32", "rw", 0x20770010),
    (0x1A01, 0, "U8", "rw", 3),
    (0x1A01, 1, "U32", "rw", 0x606C0020),
    (0x1A01, 2, "U32", "rw", 0x21000110),
    (0x1A01, 3, "U32", "rw", 0x603F0010),
    *((index, 0, "U8", "rw", 0) for index in (0x1601, 0x1602, 0x1603, 0x1A02, 0x1A03)),
    *((index, sub, "U32", "rw", 0) for index in (0x1601, 0x1602, 0x1603, 0x1A02, 0x1A03) for sub in range(1, 9)),
    *((0x1600, sub, "U32", "rw", 0) for sub in range(3, 9)),
    *((index, sub, "U32", "rw", 0) for index in (0x1A00, 0x1A01) for sub in range(4, 9)),
    (0x6007, 0, "I16", "rw", 1),
    (0x605A, 0, "I16", "rw", 2),
    (0x605B, 0, "I16", "rw", 0),
    (0x605C, 0, "I16", "rw", 1),
    (0x605D, 0, "I16", "rw", 1),
    (0x605E, 0, "I16", "rw", 0),
    (0x603F, 0, "U16", "ro", 0),
    (0x6040, 0, "U16", "rw", 0),
    (0x6041, 0, "U16", "ro", 0),
    (0x6060, 0, "I8", "rw", 10),
    (0x6061, 0, "I8", "ro", 10),
    (0x6502, 0, "U32", "ro", 0x228),
    (0x6063, 0, "I32", "ro", 0),
    (0x6064, 0, "I32", "ro", 0),
    (0x606C, 0, "I32", "ro", 0),
    (0x6071, 0, "I16", "rw", 0),
    (0x6074, 0, "I16", "ro", 0),
    (0x6077, 0, "I16", "ro", 0),
    (0x60B2, 0, "I16", "rw", 0),
    (0x6072, 0, "U16", "rw", 3072),
    (0x60E0, 0, "U16", "rw", 3072),
    (0x60E1, 0, "U16", "rw", 3072),
    (0x6087, 0, "U32", "rw", 300000),
    (0x6075, 0, "U32", "rw", None),
    (0x6076, 0, "U32", "rw", 319),
    (0x6080, 0, "U32", "rw", 4500),
    (0x6078, 0, "I16", "ro", 0),
    (0x6079, 0, "U32", "ro", None),
    (0x607C, 0, "I32", "rw", 0),
    (0x6098, 0, "I8", "rw", 37),
    (0x6099, 0, "U8", "const", 2),
    (0x6099, 1, "U32", "rw", None),
    (0x6099, 2, "U32", "rw", None),
    (0x609A, 0, "U32", "rw", None),
    (0x608F, 0, "U8", "const", 2),
    (0x608F, 1, "U32", "rw", 8000),
    (0x608F, 2, "U32", "rw", 1),
    (0x6091, 0, "U8", "const", 2),
    (0x6091, 1, "U32", "rw", 25),
    (0x6091, 2, "U32", "rw", 1),
    (0x6092, 0, "U8", "const", 2),
    (0x6092, 1, "U32", "rw", 200000),
    (0x6092, 2, "U32", "rw", 1),
    (0x60C2, 0, "U8", "const", 2),
    (0x60C2, 1, "U8", "rw", 4),
    (0x60C2, 2, "I8", "rw", -3),
    (0x2070, 0, "U8", "rw", 1),
    (0x2071, 0, "I16", "rw", 0),
    (0x2077, 0, "I16", "ro", 0),
    (0x2100, 0, "U8", "const", 4),
    *((0x2100, sub, "U16", "ro", None) for sub in range(1, 5)),
    (0x2110, 0, "U8", "const", 4),
    *((0x2110, sub, "U32", "rw", None) for sub in range(1, 5)),
    (0x2120, 0, "U8", "const", 3),
    (0x2120, 1, "U8", "rw", 3),
    (0x2120, 2, "U8", "rw", 1),
    (0x2120, 3, "U32", "ro", 0),
    (0x2130, 0, "U64", "ro", 0),
    (0x2140, 0, "U8", "const", 14),
    *((0x2140, sub, "U32", "ro", COUNTED) for sub in range(1, 15)),
]

# what process data are made of, besides the objects of the default mappings
MAPPABLE = [
    *(0x1001, 0x2071, 0x2077, 0x2130, 0x603F, 0x6040, 0x6041, 0x6060, 0x6061, 0x6063, 0x6064, 0x606C, 0x6071),
    *(0x6072, 0x6074, 0x6077, 0x6078, 0x6079, 0x60B2, 0x60E0, 0x60E1),
]


@pytest.fixture(scope="module")
def dictionary():
    return load_dictionary(DRIVE_EDS, NODE)


def variables(dictionary):
    for index in dictionary:
        entry = dictionary[index]
        yield from [entry] if isinstance(entry, ODVariable) else entry.subindices.values()


@pytest.mark.parametrize(
    ("index", "subindex", "kind", "access", "default"), TABLE, ids=lambda v: f"{v:X}" if isinstance(v, int) else v
)
def test_an_object_is_as_the_table_says(dictionary, index, subindex, kind, access, default):
    variable = find_variable(dictionary, index, subindex)
    assert variable is not None
    assert variable.data_type == TYPES[kind]
    assert variable.access_type == access
    assert (variable.default is None) == (default is COUNTED)
    assert default in {None, COUNTED} or variable.default == default


def test_the_table_is_the_whole_dictionary(dictionary):
    dummies = {(index, 0) for index in range(1, 8)}
    held = {(v.index, v.subindex) for v in variables(dictionary)}
    assert held - dummies == {(index, subindex) for index, subindex, *_ in TABLE}
    assert 0x2F00 not in dictionary


@pytest.mark.parametrize("index", MAPPABLE, ids=hex)
def test_process_data_can_be_mapped(dictionary, index):
    assert find_variable(dictionary, index).pdo_mappable


def test_configuration_cannot_be_mapped(dictionary):
    for variable in variables(dictionary):
        if 0x1002 <= variable.index < 0x2000 or variable.index in {0x605A, 0x6087, 0x6076, 0x608F, 0x2110}:
            assert not variable.pdo_mappable


def test_every_default_is_of_its_type_and_within_its_limits(dictionary):
    for variable in variables(dictionary):
        if variable.data_type == datatypes.VISIBLE_STRING or variable.index < 0x1000 or variable.default is None:
            continue
        where = f"{variable.index:04X}:{variable.subindex}"
        assert len(variable.encode_raw(variable.default)) * 8 == len(variable), where
        assert variable.min is None or variable.min <= variable.default, where
        assert variable.max is None or variable.default <= variable.max, where


@pytest.mark.parametrize(
    ("index", "low", "high"),
    [
        (0x1019, 0, 240),
        (0x2070, 0, 1),
        (0x6007, 0, 3),
        (0x605A, 0, 8),
        (0x605B, 0, 1),
        (0x605C, 0, 1),
        (0x605D, 1, 4),
        (0x605E, 0, 4),
        (0x6072, 0, 3072),
        (0x60E0, 0, 3072),
        (0x60E1, 0, 3072),
        (0x6087, 1, None),
        (0x6076, 1, None),
    ],
    ids=lambda v: f"{v:X}" if isinstance(v, int) else v,
)
def test_limits_are_those_the_drive_keeps(dictionary, index, low, high):
    variable = find_variable(dictionary, index)
    assert (variable.min, variable.max) == (low, high)


def test_default_mappings_fit_a_frame_and_name_mappable_objects(dictionary):
    for mapping in (*range(0x1600, 0x1604), *range(0x1A00, 0x1A04)):
        bits = 0
        for n in range(1, find_variable(dictionary, mapping, 0).default + 1):
            entry = find_variable(dictionary, mapping, n).default
            variable = find_variable(dictionary, entry >> 16, entry >> 8 & 0xFF)
            assert variable.pdo_mappable
            assert len(variable) == entry & 0xFF
            bits += entry & 0xFF
        assert bits <= 64


def test_dummies_of_whole_bytes_can_be_mapped(dictionary):
    assert {index for index in dictionary if index < 0x1000} == {2, 3, 4, 5, 6, 7}
    assert dictionary[3].data_type == datatypes.INTEGER16


def test_device_information_agrees_with_the_identity(dictionary):
    info = dictionary.device_information
    identity = [find_variable(dictionary, 0x1018, sub).default for sub in (1, 2, 3)]
    assert [info.vendor_number, info.product_number, info.revision_number] == identity
    assert info.product_name == find_variable(dictionary, 0x1008).default
    assert 1_000_000 in info.allowed_baudrates
    assert (info.nr_of_RXPDO, info.nr_of_TXPDO, info.simple_boot_up_slave, info.LSS_supported) == (4, 4, True, False)


def test_names_are_unique_where_canopen_looks_them_up(dictionary):
    assert len(dictionary.names) == len(dictionary.indices)
    for index in dictionary:
        entry = dictionary[index]
        if not isinstance(entry, ODVariable):
            assert len(entry.names) == len(entry.subindices)
