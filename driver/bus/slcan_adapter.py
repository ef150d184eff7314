"""A serial CAN adapter without its serial line and its bus: bytes from the host in, replies and frames out.

It keeps to Lawicel's CANUSB (whose CAN controller is a SJA1000 at 16 MHz): every line is answered by a carriage return,
after a `z` or `Z` when it was a frame, or by a BELL when it means nothing or cannot be done now. Frames pass while the
channel is open and has the bit rate that the bus has; a channel without a bit rate cannot be opened.

    S0..S8  s xxyy       bit rate, by number or by bus timing registers; closed
    O  L  C              open, open to listen only, close
    t  r  T  R           send a frame; open
    F                    status flags, which are cleared by it; open or listening
    Z0  Z1               time stamps off, on; closed
    M xxxxxxxx  m xxxxxxxx   acceptance code and mask; closed, with a bit rate
    V  v  N              versions, serial number
"""

import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from enum import Enum
from typing import Final, NamedTuple

from torquerig.driver.bus.slcan_codec import (
    BELL,
    CR,
    LONGEST,
    SPEEDS,
    STAMP_PERIOD_MS,
    AcceptanceFilter,
    bit_rate_of,
    decode_frame,
    encode_frame,
)
from torquerig.driver.wire.frame import Frame

VERSION: Final = b"1010"
"""Hardware 1.0, firmware 1.0."""
SERIAL_NUMBER: Final = b"TRIG"

RECEIVE_QUEUE_FULL: Final = 1 << 0  # the status flags that can come about here
DATA_OVERRUN: Final = 1 << 3
ERROR_PASSIVE: Final = 1 << 5
BUS_ERROR: Final = 1 << 7


class Channel(Enum):
    """What the adapter does on the bus."""

    CLOSED = "closed"
    OPEN = "open"
    LISTENING = "listening"


class Heard(NamedTuple):
    """What bytes from the host lead to.

    Attributes:
        replies: Bytes to the host.
        frames: Frames to the bus, in the order of the host.
    """

    replies: bytes
    frames: list[Frame]


class SlcanAdapter:
    """An adapter on a bus of one bit rate, channel closed, no bit rate set."""

    def __init__(self, bitrate: int) -> None:
        """Join a bus.

        Args:
            bitrate: The bus's bit rate; frames pass only if the host sets the same [bit/s].
        """
        self._bus_bitrate = bitrate
        self._bitrate: int | None = None
        self._channel = Channel.CLOSED
        self._stamps = False
        self._filter = AcceptanceFilter()
        self._flags = 0
        self._rest = b""
        self._frames: list[Frame] = []
        self._counts: Counter[str] = Counter()

    @property
    def channel(self) -> Channel:
        """What the adapter does on the bus."""
        return self._channel

    @property
    def counts(self) -> dict[str, int]:
        """What did not go well, by kind.

        `garbage`: lines that mean nothing; `refused`: commands that cannot be done in the channel's state;
        `wrong_bit_rate`: frames, either way, that the bit rate set by the host keeps from passing; `unheard`: frames
        that came while there was no host, or its channel was closed; `overrun`: frames and replies for which the host
        left no room.
        """
        return dict(self._counts)

    def hear(self, data: bytes) -> Heard:
        """Take bytes from the host, in whatever pieces they come; any bytes."""
        *lines, rest = (self._rest + data).split(CR)
        self._rest = rest[: LONGEST + 1]  # too long remains too long, but costs no memory
        replies = b"".join([self._answer(line) for line in lines])
        frames, self._frames = self._frames, []
        return Heard(replies, frames)

    def tell(self, frame: Frame, at_ns: int) -> bytes:
        """Return the line that tells the host of a frame on the bus; empty when it does not hear of it.

        Args:
            frame: The frame.
            at_ns: Its time, for the time stamp [ns].
        """
        if self._channel is Channel.CLOSED:
            self.unheard()
            return b""
        if not self._passes() or not self._filter.accepts(frame):
            return b""
        return encode_frame(frame, at_ns // 1_000_000 % STAMP_PERIOD_MS if self._stamps else None)

    def unheard(self) -> None:
        """Take note that nobody was there for a frame."""
        self._counts["unheard"] += 1

    def overrun(self) -> None:
        """Take note that the host left no room for a frame or a reply."""
        self._counts["overrun"] += 1
        self._flags |= RECEIVE_QUEUE_FULL | DATA_OVERRUN

    def hang_up(self) -> None:
        """Forget the line that a host began and did not end before it went."""
        self._rest = b""

    def _answer(self, line: bytes) -> bytes:
        """Do what a line says, and return the reply."""
        if not line:  # hosts send some to end whatever was before
            return CR
        frame = decode_frame(line)
        command = _COMMANDS.get(line[:1])
        if frame is not None:
            reply = self._send(frame)
        elif command is not None and command.argument.fullmatch(line, 1):
            reply = command.do(self, line[1:]) if self._channel in command.channels else None
        else:
            self._counts["garbage"] += 1
            return BELL
        if reply is None:
            self._counts["refused"] += 1
            return BELL
        return reply + CR

    def _send(self, frame: Frame) -> bytes | None:
        if self._channel is not Channel.OPEN:
            return None
        if self._passes():
            self._frames.append(frame)
        return b"Z" if frame.extended else b"z"

    def _passes(self) -> bool:
        """Whether the bit rate is right; otherwise what comes of it is noted."""
        if self._bitrate == self._bus_bitrate:
            return True
        self._counts["wrong_bit_rate"] += 1
        self._flags |= BUS_ERROR | ERROR_PASSIVE
        return False

    def _set_speed(self, argument: bytes) -> bytes:
        self._bitrate = SPEEDS[int(argument)]
        return b""

    def _set_timing(self, argument: bytes) -> bytes:
        self._bitrate = bit_rate_of(int(argument, 16))
        return b""

    def _open(self, _: bytes) -> bytes | None:
        return self._join(Channel.OPEN)

    def _listen(self, _: bytes) -> bytes | None:
        return self._join(Channel.LISTENING)

    def _join(self, channel: Channel) -> bytes | None:
        if self._bitrate is None:
            return None
        self._channel = channel
        return b""

    def _close(self, _: bytes) -> bytes:
        self._channel = Channel.CLOSED
        return b""

    def _read_flags(self, _: bytes) -> bytes:
        flags, self._flags = self._flags, 0
        return b"F%02X" % flags

    def _set_stamps(self, argument: bytes) -> bytes:
        self._stamps = argument == b"1"
        return b""

    def _set_code(self, argument: bytes) -> bytes | None:
        return self._set_filter(replace(self._filter, code=int(argument, 16)))

    def _set_mask(self, argument: bytes) -> bytes | None:
        return self._set_filter(replace(self._filter, mask=int(argument, 16)))

    def _set_filter(self, accepted: AcceptanceFilter) -> bytes | None:
        if self._bitrate is None:
            return None
        self._filter = accepted
        return b""

    def _version(self, _: bytes) -> bytes:
        return b"V" + VERSION

    def _firmware_version(self, _: bytes) -> bytes:
        return b"v" + VERSION

    def _serial_number(self, _: bytes) -> bytes:
        return b"N" + SERIAL_NUMBER


class _Command(NamedTuple):
    """A command's argument, the channel states it is for, and what does it: the reply, or None when it cannot be."""

    argument: re.Pattern[bytes]
    channels: frozenset[Channel]
    do: Callable[[SlcanAdapter, bytes], bytes | None]


_NOTHING: Final = re.compile(rb"")
_REGISTERS: Final = re.compile(rb"[0-9A-Fa-f]{8}")
_ALWAYS: Final = frozenset(Channel)
_CLOSED: Final = frozenset({Channel.CLOSED})
_ON_THE_BUS: Final = _ALWAYS - _CLOSED
_COMMANDS: Final[Mapping[bytes, _Command]] = {
    b"S": _Command(re.compile(rb"[0-8]"), _CLOSED, SlcanAdapter._set_speed),
    b"s": _Command(re.compile(rb"[0-9A-Fa-f]{4}"), _CLOSED, SlcanAdapter._set_timing),
    b"O": _Command(_NOTHING, _CLOSED, SlcanAdapter._open),
    b"L": _Command(_NOTHING, _CLOSED, SlcanAdapter._listen),
    b"C": _Command(_NOTHING, _ON_THE_BUS, SlcanAdapter._close),
    b"F": _Command(_NOTHING, _ON_THE_BUS, SlcanAdapter._read_flags),
    b"Z": _Command(re.compile(rb"[01]"), _CLOSED, SlcanAdapter._set_stamps),
    b"M": _Command(_REGISTERS, _CLOSED, SlcanAdapter._set_code),
    b"m": _Command(_REGISTERS, _CLOSED, SlcanAdapter._set_mask),
    b"V": _Command(_NOTHING, _ALWAYS, SlcanAdapter._version),
    b"v": _Command(_NOTHING, _ALWAYS, SlcanAdapter._firmware_version),
    b"N": _Command(_NOTHING, _ALWAYS, SlcanAdapter._serial_number),
}
