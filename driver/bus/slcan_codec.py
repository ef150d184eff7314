"""The ASCII lines of serial CAN adapters, as Lawicel's CAN232 and CANUSB have them: pure functions, no state.

    t iii l dd...        a data frame with an 11-bit identifier
    T iiiiiiii l dd...   a data frame with a 29-bit identifier
    r iii l              a remote frame; R iiiiiiii l is one with a 29-bit identifier

Without the blanks, and ended by a carriage return. i and d are hexadecimal, l is the number of bytes, 0 to 8. Towards
the host a time stamp of four digits may follow. Source: Lawicel AB, CAN232 Manual 3.0 and CANUSB Manual.
"""

import re
from dataclasses import dataclass
from typing import Final

from torquerig.driver.wire.frame import Frame

CR: Final = b"\r"
BELL: Final = b"\a"

SPEEDS: Final = (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)
"""What the commands S0 to S8 set [bit/s]."""

STAMP_PERIOD_MS: Final = 60_000
"""Time stamps run from 0 to 59 999 ms (0xEA5F) and begin again."""

LONGEST: Final = len("T1FFFFFFF8") + 2 * 8
"""No line from the host that means something is longer [character]."""

_CONTROLLER_CLOCK: Final = 8_000_000  # what the SJA1000 makes of its 16 MHz, before its prescaler [Hz]
_DATA_BYTES: Final = rb"([0-8])((?:[0-9A-Fa-f]{2})*)"
_BASE: Final = re.compile(rb"([tr])([0-7][0-9A-Fa-f]{2})" + _DATA_BYTES)
_EXTENDED: Final = re.compile(rb"([TR])([01][0-9A-Fa-f]{7})" + _DATA_BYTES)


def encode_frame(frame: Frame, stamp_ms: int | None = None) -> bytes:
    """Return a frame's line, its carriage return included.

    Args:
        frame: A classic CAN frame.
        stamp_ms: The time stamp to go with it, 0 to 59 999 [ms]; None for none.
    """
    letter, digits = ("R" if frame.remote else "T", 8) if frame.extended else ("r" if frame.remote else "t", 3)
    data = "" if frame.remote else frame.data.hex().upper()
    stamp = "" if stamp_ms is None else f"{stamp_ms:04X}"
    return f"{letter}{frame.can_id:0{digits}X}{len(frame.data)}{data}{stamp}\r".encode("ascii")


def decode_frame(line: bytes) -> Frame | None:
    """Return the frame that a line from the host, its carriage return taken off, is to send; None if it is none."""
    match = _BASE.fullmatch(line) or _EXTENDED.fullmatch(line)
    if match is None:
        return None
    letter, digits, length, data = match.groups()
    remote = letter in b"rR"
    if len(data) != (0 if remote else 2 * int(length)):
        return None
    payload = bytes(int(length)) if remote else bytes.fromhex(data.decode("ascii"))
    return Frame(int(digits, 16), payload, remote, letter in b"TR")


def bit_rate_of(timing: int) -> int:
    """Return the bit rate that a SJA1000's bus timing registers set [bit/s].

    A bit has one quantum to synchronise and TSEG1 + 1 and TSEG2 + 1 of them before and after the sample point
    (SJA1000 data sheet, 6.5.1 and 6.5.2).

    Args:
        timing: Register 0 in the high byte, register 1 in the low one, as the command `s` has them.
    """
    prescaler = (timing >> 8 & 0x3F) + 1
    quanta = 1 + (timing & 0xF) + 1 + (timing >> 4 & 0x7) + 1
    return round(_CONTROLLER_CLOCK / (prescaler * quanta))


@dataclass(frozen=True, slots=True)
class AcceptanceFilter:
    """A SJA1000's acceptance registers as two filters, of which a frame has to pass one (its data sheet, 6.4.15.2).

    Attributes:
        code: What the bits have to be, register AC0 in the highest byte.
        mask: Which bits may be anything (1), register AM0 in the highest byte.
    """

    code: int = 0
    mask: int = 0xFFFF_FFFF

    def accepts(self, frame: Frame) -> bool:
        """Whether a frame passes."""
        if frame.extended:  # both filters look at the identifier's first 16 bits
            bits = frame.can_id >> 13
            return _passes(bits, self.code >> 16, self.mask >> 16, 16) or _passes(bits, self.code, self.mask, 16)
        bits = frame.can_id << 1 | frame.remote
        if _passes(bits, self.code >> 4, self.mask >> 4, 12):
            return True
        # the first filter looks at the first byte too, where there is one
        anything, byte = (0, frame.data[0]) if frame.data and not frame.remote else (0xFF, 0)
        return _passes(bits << 8 | byte, _first_filter(self.code), _first_filter(self.mask) | anything, 20)


def _first_filter(register: int) -> int:
    """Return the 20 bits of four registers that the first filter has for base frames: its last four are AC3's last."""
    return register >> 12 & 0xFFFF0 | register & 0xF


def _passes(bits: int, code: int, mask: int, width: int) -> bool:
    """Whether the last `width` bits are as the code wants them, wherever the mask is 0."""
    return not (bits ^ code) & ~mask & ((1 << width) - 1)
