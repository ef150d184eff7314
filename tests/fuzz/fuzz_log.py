"""Failing inputs as candump logs: frames with their times, to be replayed by us, by canplayer, or read by a person."""

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from torquerig.driver.wire.frame import Frame

MICROSECOND: Final = 1_000  # [ns], the resolution of the log, and so of all times that fuzzing chooses
CHANNEL: Final = "fuzz"
_LINE: Final = re.compile(r"\((\d+)\.(\d{6})\) \S+ ([0-9A-F]{3}|[0-9A-F]{8})#(?:(R)(\d?)|([0-9A-F]*))( [RT])?")


class Timed(NamedTuple):
    """A frame, and when it was handed to the wire [ns]."""

    at_ns: int
    frame: Frame


def to_candump(frames: Iterable[Timed]) -> str:
    """The frames as `candump -L` writes them."""
    return "".join(f"{_line(at_ns, frame)}\n" for at_ns, frame in frames)


def from_candump(text: str) -> list[Timed]:
    """The frames in a log that `candump -L` wrote.

    Raises:
        ValueError: A line is none of candump's.
    """
    return [_parsed(line) for line in text.splitlines() if line.strip()]


def load(path: Path) -> list[Timed]:
    """The frames in a log file."""
    return from_candump(path.read_text("ascii"))


def shortest(frames: Sequence[Timed], fails: Callable[[Sequence[Timed]], bool], patience: int = 200) -> list[Timed]:
    """As few of the frames as still fail, found by leaving out ever smaller pieces (ddmin, Zeller 2002).

    Args:
        frames: Frames that fail.
        fails: Whether some do.
        patience: How often to try.
    """
    kept = list(frames)
    pieces = 2
    while len(kept) > 1 and patience > 0:
        size = -(-len(kept) // pieces)
        for begin in range(0, len(kept), size):
            rest = kept[:begin] + kept[begin + size :]
            patience -= 1
            if rest and fails(rest):
                kept = rest
                pieces = max(2, pieces - 1)
                break
            if patience <= 0:
                break
        else:
            if size == 1:
                break
            pieces = min(len(kept), 2 * pieces)
    return kept


def _line(at_ns: int, frame: Frame) -> str:
    seconds, microseconds = divmod(at_ns // MICROSECOND, 1_000_000)
    identifier = f"{frame.can_id:08X}" if frame.extended else f"{frame.can_id:03X}"
    data = f"R{len(frame.data)}" if frame.remote else frame.data.hex().upper()
    return f"({seconds:010d}.{microseconds:06d}) {CHANNEL} {identifier}#{data}"


def _parsed(line: str) -> Timed:
    match = _LINE.fullmatch(line.strip())
    if match is None:
        raise ValueError(f"no line of candump -L: {line!r}")
    seconds, microseconds, identifier, remote, length, data, _ = match.groups()
    at_ns = (int(seconds) * 1_000_000 + int(microseconds)) * MICROSECOND
    octets = bytes(int(length or "0")) if remote else bytes.fromhex(data)
    return Timed(at_ns, Frame(int(identifier, 16), octets, remote is not None, len(identifier) == 8))
