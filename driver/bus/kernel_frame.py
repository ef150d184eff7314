"""`struct can_frame` of linux/can.h, in the machine's byte order."""

import struct
from typing import Final

from torquerig.driver.wire.frame import Frame

FRAME: Final = struct.Struct("=IB3x8s")  # can_id and flags, length, data
EXTENDED: Final = 0x8000_0000
REMOTE: Final = 0x4000_0000
BASE_ID: Final = 0x7FF
EXTENDED_ID: Final = 0x1FFF_FFFF


def identifier_of(frame: Frame) -> int:
    """Return the identifier of a checked frame, with its flags."""
    return frame.can_id | (EXTENDED if frame.extended else 0) | (REMOTE if frame.remote else 0)


def frame_from(can_id: int, data: bytes) -> Frame:
    """Return the frame of an identifier with its flags, and data of its length."""
    extended, remote = bool(can_id & EXTENDED), bool(can_id & REMOTE)
    identifier = can_id & (EXTENDED_ID if extended else BASE_ID)
    return Frame(identifier, bytes(len(data)) if remote else data, remote, extended)
