"""One CAN frame as one packet of the unix bus: pure functions between python-can messages and bytes.

A packet is a header of 24 bytes (little-endian) and the frame's data:

    magic      4 bytes  b"CAN" and the format's version, 1
    flags      u8       1 extended identifier, 2 remote frame, 4 error frame
    length     u8       data length code, 0 to 8; a remote frame carries no data
    reserved   2 bytes
    can_id     u32
    sequence   u32      counts all frames its sender sent: a gap is what the receiver missed
    sent_ns    u64      CLOCK_MONOTONIC of the sender, which every process of a machine shares
"""

import struct
from typing import Final, NamedTuple

import can

MAGIC: Final = b"CAN\x01"
HEADER: Final = struct.Struct("<4sBB2xIIQ")
SEQUENCE_MASK: Final = 0xFFFF_FFFF
LONGEST: Final = HEADER.size + 8

_EXTENDED: Final = 1
_REMOTE: Final = 2
_ERROR: Final = 4
_KNOWN_FLAGS: Final = frozenset({0, _EXTENDED, _REMOTE, _ERROR, _EXTENDED | _REMOTE, _EXTENDED | _ERROR})


class Packet(NamedTuple):
    """What one packet says: the message (its timestamp still 0), its sender's count and time [ns]."""

    message: can.Message
    sequence: int
    sent_ns: int


def encode(message: can.Message, sequence: int, sent_ns: int) -> bytes:
    """Return the packet of one frame.

    Args:
        message: A classic CAN frame.
        sequence: How many frames the sender sent before, modulo 2**32.
        sent_ns: The sender's CLOCK_MONOTONIC [ns].

    Raises:
        can.CanOperationError: The frame is not a classic CAN frame.
    """
    data = b"" if message.is_remote_frame else message.data
    length = message.dlc if message.is_remote_frame else len(data)
    highest = 0x1FFF_FFFF if message.is_extended_id else 0x7FF
    if message.is_fd or not 0 <= length <= 8 or not 0 <= message.arbitration_id <= highest:
        raise can.CanOperationError(
            f"the unix bus carries classic CAN frames only, and this one has identifier {message.arbitration_id:#x} "
            f"(highest {highest:#x}) and {length} bytes{', FD format' if message.is_fd else ''}"
        )
    flags = message.is_extended_id * _EXTENDED | message.is_remote_frame * _REMOTE | message.is_error_frame * _ERROR
    return HEADER.pack(MAGIC, flags, length, message.arbitration_id, sequence, sent_ns) + data


def decode(packet: bytes) -> Packet | None:
    """Return what the packet says, or None for bytes that no member of this format wrote."""
    if not HEADER.size <= len(packet) <= LONGEST:
        return None
    magic, flags, length, can_id, sequence, sent_ns = HEADER.unpack_from(packet)
    extended = bool(flags & _EXTENDED)
    remote = bool(flags & _REMOTE)
    carried = 0 if remote else length
    if magic != MAGIC or flags not in _KNOWN_FLAGS or length > 8 or len(packet) != HEADER.size + carried:
        return None
    if can_id > (0x1FFF_FFFF if extended else 0x7FF):
        return None
    message = can.Message(
        arbitration_id=can_id,
        is_extended_id=extended,
        is_remote_frame=remote,
        is_error_frame=bool(flags & _ERROR),
        dlc=length,
        data=bytearray(packet[HEADER.size :]),
    )
    return Packet(message, sequence, sent_ns)
