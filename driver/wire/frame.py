"""A classic CAN 2.0 frame and its length on the wire."""

from typing import NamedTuple

MAX_DATA_LENGTH = 8


class Frame(NamedTuple):
    """A classic CAN data or remote frame.

    Attributes:
        can_id: Identifier, 11 bits, or 29 when extended.
        data: Up to 8 bytes; in a remote frame only their number means something (the DLC), and they are zero.
        remote: A remote transmission request.
        extended: A 29-bit identifier. CANopen's connection set has 11 bits, so no decoder here accepts one.
    """

    can_id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False


class Arrival(NamedTuple):
    """A frame and when it was complete.

    Attributes:
        at_ns: Bus clock (monotonic) at the end of the frame.
        frame: The frame.
    """

    at_ns: int
    frame: Frame


def worst_case_bits(length: int, *, extended: bool = False) -> int:
    """Bits that a frame takes on the wire when bit stuffing is at its worst, interframe space included.

    Fixed bits are 44 (extended: 64) and 3 of interframe space; of these 34 (54) and the data are subject to
    stuffing, at most one stuff bit after the first five and then after every four (ISO 11898-1; Tindell & Burns 1994).

    Args:
        length: Data bytes, 0 to 8; a remote frame has 0 whatever its DLC says.
        extended: The frame has a 29-bit identifier.

    Raises:
        ValueError: The length is not 0 to 8.
    """
    if not 0 <= length <= MAX_DATA_LENGTH:
        raise ValueError(f"a classic CAN frame holds 0 to 8 bytes, not {length}")
    data_bits = 8 * length
    if extended:
        return 67 + data_bits + (53 + data_bits) // 4
    return 47 + data_bits + (33 + data_bits) // 4
