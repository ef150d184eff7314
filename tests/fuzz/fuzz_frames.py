"""Single frames for a hostile wire, from quite arbitrary ones to such as a node obeys."""

import struct
from typing import Final

from fuzz_source import Source, choose, in_one_of

from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Frame

NODE_IDS: Final = (1, 2, 3)
MASTER: Final = 127
Burst = list[Frame]

_NMT_COMMANDS: Final = (1, 1, 2, 0x80, 0x81, 0x82)
_CONTROLWORDS: Final = (0x00, 0x02, 0x06, 0x07, 0x0F, 0x0F, 0x1F, 0x80, 0x8F, 0x0B, 0x10F, 0xFFFF)
_NODE_BASES: Final = (cob.EMCY, *cob.TPDO.values(), *cob.RPDO.values(), cob.SDO_REQUEST, cob.HEARTBEAT)
_PAUSES_US: Final = (0, 0, 0, 0, 0, 1, 50, 100, 250, 500, 1_000, 2_000, 4_000, 12_000, 13_000, 50_000, 101_000)
_SECOND_NS: Final = 1_000_000_000


def pause_ns(source: Source) -> int:
    """A pause before a burst: mostly none, rarely longer than any watchdog; whole microseconds [ns]."""
    if in_one_of(source, 200):
        return source.integer(0, 12) * _SECOND_NS
    if in_one_of(source, 4):
        return source.integer(0, 5_000) * 1_000
    return choose(source, _PAUSES_US) * 1_000


def a_node(source: Source) -> int:
    """The node-id of one of the drives."""
    return choose(source, NODE_IDS)


def some_octets(source: Source) -> bytes:
    """0 to 8 bytes."""
    return source.octets(source.integer(0, 8))


def anything(source: Source) -> Burst:
    """Any frame with 11 bits."""
    return [Frame(source.integer(0, 0x7FF), some_octets(source))]


def anything_extended(source: Source) -> Burst:
    """Any frame with 29 bits; some are those of a node, but for their format."""
    can_id = choose(source, (source.integer(0, 0x1FFF_FFFF), cob.SYNC, cob.RPDO[1] + 1 << 18, cob.SDO_REQUEST + 1))
    data = some_octets(source)
    if in_one_of(source, 3):
        return [Frame(can_id, bytes(len(data)), remote=True, extended=True)]
    return [Frame(can_id, data, extended=True)]


def remote(source: Source) -> Burst:
    """A remote frame on an identifier that a node knows."""
    can_id = choose(source, (*_NODE_BASES, cob.SYNC - 1)) + a_node(source)
    return [Frame(can_id, bytes(source.integer(0, 8)), remote=True)]


def known(source: Source) -> Burst:
    """Arbitrary data on an identifier that means something."""
    can_id = choose(source, (*_NODE_BASES, cob.NMT)) + choose(source, (0, *NODE_IDS, MASTER))
    return [Frame(can_id, some_octets(source))]


def sync(source: Source) -> Burst:
    """SYNCs, mostly right."""
    data = source.octets(1) if in_one_of(source, 6) else b""
    return [Frame(cob.SYNC, data)] * source.integer(1, 3)


def nmt(source: Source) -> Burst:
    """An NMT command."""
    return [Frame(cob.NMT, bytes((choose(source, _NMT_COMMANDS), choose(source, (0, *NODE_IDS, 9)))))]


def rpdo(source: Source) -> Burst:
    """A controlword and a torque."""
    torque = source.octets(2) if in_one_of(source, 2) else b"\x00\x10"
    can_id = choose(source, (cob.RPDO[1], cob.RPDO[1], cob.RPDO[1], cob.RPDO[2])) + a_node(source)
    return [Frame(can_id, struct.pack("<H", choose(source, _CONTROLWORDS)) + torque)]


def enabling(source: Source) -> Burst:
    """The way to operation enabled, of RPDOs that act at once or wait for SYNC, from a fault or not."""
    node_id, torque = a_node(source), source.octets(2)
    words = (0x80, 0x06, 0x07, 0x0F, 0x0F)[not in_one_of(source, 2) :]
    start = Frame(cob.NMT, bytes((1, choose(source, (0, node_id)))))
    burst = [start, *(Frame(cob.RPDO[1] + node_id, bytes((word, 0)) + torque) for word in words)]
    return [each for frame in burst for each in (frame, Frame(cob.SYNC))] if in_one_of(source, 3) else burst


def heartbeat(source: Source) -> Burst:
    """What drives and master say of themselves."""
    state = choose(source, (0x05, 0x05, 0x05, 0x00, 0x04, 0x7F, 0x85, 0x33))
    return [Frame(cob.HEARTBEAT + choose(source, (*NODE_IDS, MASTER)), bytes((state,)))]


def emergency(source: Source) -> Burst:
    """What drives say is wrong with them."""
    code = choose(source, (0x0000, 0x2310, 0x7310, 0x8250, 0xFF01, source.integer(0, 0xFFFF)))
    return [Frame(cob.EMCY + a_node(source), struct.pack("<HB5x", code, source.integer(0, 255)))]


def spoilt(source: Source, frame: Frame) -> Frame:
    """A frame with something wrong: a bit, its length, its format or its identifier."""
    kind = source.integer(0, 5)
    if kind == 0 and frame.data and not frame.remote:
        octets = bytearray(frame.data)
        octets[source.integer(0, len(octets) - 1)] ^= 1 << source.integer(0, 7)
        return frame._replace(data=bytes(octets))
    if kind == 1:
        return frame._replace(data=frame.data[: source.integer(0, len(frame.data))])
    if kind == 2:
        more = bytes(8) if frame.remote else source.octets(8)
        return frame._replace(data=(frame.data + more)[: source.integer(len(frame.data), 8)])
    if kind == 3:
        return frame._replace(data=bytes(len(frame.data)), remote=True)
    if kind == 4:
        return frame._replace(extended=True)
    return frame._replace(can_id=frame.can_id ^ 1 << source.integer(0, 10))
