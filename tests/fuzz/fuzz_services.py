"""Conversations over SDO for a hostile wire: each would be some master's honest one, were its values not arbitrary."""

import struct
from functools import cache
from types import MappingProxyType
from typing import Final, NamedTuple

from fuzz_frames import MASTER, NODE_IDS, Burst, a_node
from fuzz_source import Source, choose, in_one_of

from torquerig.driver.wire import cob
from torquerig.driver.wire.dictionary import DRIVE_EDS, load_dictionary, struct_code
from torquerig.driver.wire.frame import Frame

_FIRST_BYTES: Final = MappingProxyType({1: 0x2F, 2: 0x2B, 3: 0x27, 4: 0x23})  # expedited download of so many bytes
_SPECIFIERS: Final = (0x40, 0x23, 0x27, 0x2B, 0x2F, 0x22, 0x20, 0x21, 0x60, 0x70, 0x00, 0x01, 0x0D, 0x80, 0xE0)
_BLOCK_SPECIFIERS: Final = (0xC0, 0xC2, 0xC4, 0xC6, 0xA0, 0xA4, 0xA1, 0xA2, 0xA3, 0xC1, 0xD5)
_EDGES: Final = (0, 1, 2, 3, 4, 5, 6, 8, 10, 35, 37, 127, 128, 239, 240, 241, 252, 253, 254, 255, 3072, 0x7FFF, 0xFFFF)
_MAPPABLE: Final = (
    *(0x60400010, 0x20710010, 0x60410010, 0x60640020, 0x20770010, 0x60710010, 0x60600008, 0x60720010, 0x00030010),
    *(0x00050008, 0x00070020, 0x60FF0020, 0x60400008, 0x21300040, 0x606C0020, 0x603F0010, 0x60B20010),
)
_TYPES: Final = (0, 1, 1, 10, 240, 241, 252, 253, 254, 255, 255)
_SIGNATURES: Final = (0x65766173, 0x64616F6C)  # "save", "load"


class Address(NamedTuple):
    """An object, and its length [byte]; 0 for a text."""

    entry: int
    subindex: int
    length: int


@cache
def addresses() -> tuple[Address, ...]:
    """All objects of the drive's EDS, and the injection of faults, of which no EDS tells."""
    found = [Address(0x2F00, 0, 4)] * 4
    for item in load_dictionary(DRIVE_EDS, 1).indices.values():
        for variable in [item] if hasattr(item, "data_type") else item.subindices.values():
            length = 0 if isinstance(variable.default, str) else struct.calcsize("<" + struct_code(variable))
            found.append(Address(variable.index, variable.subindex, length))
    return tuple(address for address in found if address.entry >= 0x1000)


def write(node_id: int, index: int, subindex: int, data: bytes) -> Frame:
    """An expedited download of 1 to 4 bytes."""
    head = struct.pack("<BHB", _FIRST_BYTES[len(data)], index, subindex)
    return Frame(cob.SDO_REQUEST + node_id, head + data.ljust(4, b"\0"))


def a_value(source: Source, length: int) -> bytes:
    """A number of 1 to 4 bytes that may mean something."""
    if in_one_of(source, 4):
        return source.octets(length)
    cob_id = choose(source, (0x000, 0x080, 0x180, 0x200, 0x300, 0x580, 0x700)) + choose(source, (0, *NODE_IDS))
    consumer = choose(source, (0, *NODE_IDS, MASTER)) << 16 | choose(source, (0, 1, 20, 100))
    special = (cob_id, cob_id | cob.INVALID, consumer, choose(source, _MAPPABLE), choose(source, _SIGNATURES))
    value = choose(source, (*special, 0xFFFF_FFFF)) if in_one_of(source, 2) else choose(source, _EDGES)
    return struct.pack("<I", value)[:length]


def sdo_write(source: Source) -> Burst:
    """A download to some object, mostly of the right length."""
    address = choose(source, addresses())
    length = source.integer(1, 4) if in_one_of(source, 8) else min(4, address.length or 4)
    return [write(a_node(source), address.entry, address.subindex, a_value(source, length))]


def sdo_read(source: Source) -> Burst:
    """An upload of some object, with requests for segments whether or not it has any."""
    address, node_id = choose(source, addresses()), a_node(source)
    first = struct.pack("<BHB4x", 0x40, address.entry, address.subindex)
    segments = [bytes((0x60 | (number & 1) << 4,)).ljust(8, b"\0") for number in range(source.integer(0, 5))]
    return [Frame(cob.SDO_REQUEST + node_id, data) for data in (first, *segments)]


def sdo_anything(source: Source) -> Burst:
    """A request that may be none, with the name of an object."""
    specifier = choose(source, (*_SPECIFIERS, *_BLOCK_SPECIFIERS, source.integer(0, 255)))
    address = choose(source, addresses())
    data = struct.pack("<BHB", specifier, address.entry, address.subindex) + source.octets(4)
    return [Frame(cob.SDO_REQUEST + a_node(source), data)]


def segmented_download(source: Source) -> Burst:
    """A segmented download, also to the controlword, with any announced length."""
    node_id = a_node(source)
    address = choose(source, (choose(source, addresses()), Address(0x6040, 0, 2)))
    size = choose(source, (address.length, choose(source, _EDGES), 1 << 31))
    parts = [struct.pack("<BHBI", choose(source, (0x20, 0x21)), address.entry, address.subindex, size)]
    length = source.integer(1, 6)
    for number in range(length):
        unused = max(0, 7 - address.length) if length == 1 and address.length else source.integer(0, 7)
        first = (number & 1) << 4 | unused << 1 | (number == length - 1)
        parts.append(bytes((first,)) + source.octets(7))
    return [Frame(cob.SDO_REQUEST + node_id, data) for data in parts]


def block(source: Source) -> Burst:
    """The beginning of a block transfer, and whatever may follow it."""
    node_id = a_node(source)
    address = choose(source, (choose(source, addresses()), Address(0x1008, 0, 0), Address(0x6040, 0, 2)))
    sizes = bytes((choose(source, (0, 1, 2, 8, 127, 128, 255)), choose(source, (0, 4, 255)), 0, 0))
    first = choose(source, _BLOCK_SPECIFIERS)
    parts = [struct.pack("<BHB", first, address.entry, address.subindex) + sizes]
    for number in range(1, source.integer(1, 10)):
        following = choose(source, (number, number, number, number | 0x80, *_BLOCK_SPECIFIERS))
        parts.append(bytes((following,)) + source.octets(7))
    return [Frame(cob.SDO_REQUEST + node_id, data) for data in parts]


def remapping(source: Source) -> Burst:
    """A PDO changed by the standard's procedure (CiA 301, 7.5.2.36), to any mapping, type and identifier."""
    node_id, number, inward = a_node(source), source.integer(0, 3), in_one_of(source, 2)
    parameters, mapping = (0x1400 + number, 0x1600 + number) if inward else (0x1800 + number, 0x1A00 + number)
    can_id = (cob.RPDO if inward else cob.TPDO)[number + 1] + node_id
    if in_one_of(source, 4):
        can_id = choose(source, (0x080, 0x180, 0x200, 0x201, 0x281, 0x702, 0x07F))
    entries = [choose(source, _MAPPABLE) for _ in range(source.integer(0, 4))]
    steps = [(parameters, 1, can_id | cob.INVALID, 4), (mapping, 0, 0, 1), (parameters, 2, choose(source, _TYPES), 1)]
    steps += [(mapping, place, entry, 4) for place, entry in enumerate(entries, start=1)]
    steps += [(mapping, 0, len(entries), 1), (parameters, 3, choose(source, (0, 0, 1, 100, 65535)), 2)]
    steps += [(parameters, 5, choose(source, (0, 0, 1, 12, 65535)), 2), (parameters, 1, can_id, 4)]
    return [write(node_id, index, subindex, value.to_bytes(size, "little")) for index, subindex, value, size in steps]


def supervision(source: Source) -> Burst:
    """Watchdogs armed or disarmed, each with some time."""
    node_id = a_node(source)
    other = choose(source, (*NODE_IDS, MASTER))
    steps = (
        (0x1016, source.integer(1, 3), other << 16 | choose(source, (0, 1, 20, 100)), 4),
        (0x1028, source.integer(1, 8), cob.EMCY + choose(source, NODE_IDS), 4),
        (0x1017, 0, choose(source, (0, 1, 50, 65535)), 2),
        (0x100C, 0, choose(source, (0, 1, 100, 65535)), 2),
        (0x100D, 0, choose(source, (0, 1, 3, 255)), 1),
        (0x1029, 1, source.integer(0, 2), 1),
        (0x6007, 0, source.integer(0, 3), 2),
        (0x1006, 0, choose(source, (0, 1, 1000, 4000, 0xFFFF_FFFF)), 4),
        (0x1015, 0, choose(source, (0, 1, 1000, 65535)), 2),
        (0x605A, 0, choose(source, (0, 1, 2, 5, 6)), 2),
    )
    chosen = [step for step in steps if in_one_of(source, 3)]
    return [write(node_id, index, subindex, value.to_bytes(size, "little")) for index, subindex, value, size in chosen]


def injected_fault(source: Source) -> Burst:
    """A fault of the drive's hardware, or its end."""
    return [write(a_node(source), 0x2F00, 0, struct.pack("<I", source.integer(0, 7)))]
