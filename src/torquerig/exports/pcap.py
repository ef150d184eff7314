"""A record's bus log as a pcap file, for Wireshark.

The packets are those of LINKTYPE_CAN_SOCKETCAN: identifier and flags in network byte order, the length of the data,
three bytes of no meaning here, the data (https://www.tcpdump.org/linktypes/LINKTYPE_CAN_SOCKETCAN.html).
"""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from struct import Struct
from typing import BinaryIO, Final, NamedTuple

from torquerig.errors import RecordError

LINKTYPE_CAN_SOCKETCAN: Final = 227

# flags beside the identifier, as in linux/can.h
_EXTENDED: Final = 1 << 31
_REMOTE: Final = 1 << 30
_ERROR: Final = 1 << 29
_ELEVEN_BITS: Final = 3  # digits of such an identifier in a log; others have 8
_LATEST: Final = 0xFFFF_FFFF  # seconds that a pcap file can hold: until 2106

# magic number of stamps in microseconds, version 2.4, zone and accuracy 0, longest packet, link type
_FILE_HEAD: Final = Struct("<IHHiIII").pack(0xA1B2C3D4, 2, 4, 0, 0, 0xFFFF, LINKTYPE_CAN_SOCKETCAN)
_PACKET_HEAD: Final = Struct("<IIII")
_CAN_HEAD: Final = Struct(">IBxxx")
_LINE: Final = re.compile(
    r"\((\d+)\.(\d{6})\) \S+ ([0-9A-F]{3}|[0-9A-F]{8})#(?:(R)([0-8]?)|((?:[0-9A-F]{2}){0,8}))(?:_[9A-F])?(?: [RT])?\s*",
    re.ASCII | re.IGNORECASE,
)


class LoggedFrame(NamedTuple):
    """A frame out of a log.

    Attributes:
        seconds: When it was complete, whole seconds.
        microseconds: The rest.
        identifier: Its identifier with the flags of linux/can.h: extended, remote, error.
        length: Length of the data, or of what a remote frame asks for.
        data: The data.
    """

    seconds: int
    microseconds: int
    identifier: int
    length: int
    data: bytes


def parse_line(line: str) -> LoggedFrame:
    """The frame in a line as `candump -L` writes it.

    Args:
        line: As `(0000000000.004000) vcan0 080#`; a direction (R or T) may follow.

    Returns:
        The frame.

    Raises:
        ValueError: The line is none, or its frame is none of classic CAN.
    """
    match = _LINE.fullmatch(line)
    if match is None or int(match[1]) > _LATEST:
        raise ValueError(f"{line.strip()!r} is no classic CAN frame as candump -L writes them")
    seconds, microseconds, digits, remote, asked, data = match.groups()
    identifier = int(digits, 16)
    if len(digits) != _ELEVEN_BITS and not identifier & _ERROR:
        identifier |= _EXTENDED
    if remote:
        return LoggedFrame(int(seconds), int(microseconds), identifier | _REMOTE, int(asked or 0), b"")
    content = bytes.fromhex(data)
    return LoggedFrame(int(seconds), int(microseconds), identifier, len(content), content)


def packet(frame: LoggedFrame) -> bytes:
    """A frame as a packet of a pcap file, its head included."""
    content = _CAN_HEAD.pack(frame.identifier, frame.length) + frame.data
    return _PACKET_HEAD.pack(frame.seconds, frame.microseconds, len(content), len(content)) + content


def read_log(log: Path) -> Iterator[LoggedFrame]:
    """The frames of a log in the format of `candump -L`, one after the other; empty lines are left out.

    Raises:
        RecordError: The log cannot be read, or a line of it is no frame; the line is named.
    """
    try:
        with log.open(encoding="ascii", errors="replace") as lines:
            for number, line in enumerate(lines, start=1):
                if line.strip():
                    yield _parsed(line, f"{log}:{number}")
    except OSError as error:
        if isinstance(error, RecordError):
            raise
        raise RecordError(f"the log {log} cannot be read: {error.strerror}") from error


def write_pcap(frames: Iterable[LoggedFrame], file: BinaryIO) -> int:
    """Write frames as a pcap file.

    Args:
        frames: The frames.
        file: Where to; it stays open.

    Returns:
        How many there were.
    """
    file.write(_FILE_HEAD)
    count = 0
    for frame in frames:
        file.write(packet(frame))
        count += 1
    return count


def _parsed(line: str, place: str) -> LoggedFrame:
    try:
        return parse_line(line)
    except ValueError as error:
        raise RecordError(f"{place}: {error}") from error
