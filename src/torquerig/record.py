"""A record: a folder with run.json, tables of columns with units, and bus.log in candump's format.

Everything is collected in memory while the loop runs and written after it. Each file is written under another name and
renamed: what is there is whole. run.json comes last, so that no record says it is done without its cycles.
"""

import json
import math
import os
import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from operator import itemgetter
from pathlib import Path
from struct import Struct
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from torquerig.driver.bus.interface import Tap
from torquerig.driver.wire.frame import Frame, worst_case_bits
from torquerig.errors import RecordError

RUN_FILE: Final = "run.json"
CYCLES_FILE: Final = "cycles.parquet"
TRUTH_FILE: Final = "truth.parquet"
BUS_FILE: Final = "bus.log"
PICTURE_FILE: Final = "run.png"
FORMAT: Final = 1
"""Of run.json and the tables beside it; raised when a program that reads the one would not understand the other."""
DONE: Final = "done"
"""How a run that nothing stopped has ended."""
RUN: Final = "run"
"""The kind of record that `torquerig run` writes."""
SIM: Final = "sim"
"""The kind of record that simulated drives write."""
_FRAME: Final = Struct("<qIBB8s")  # time [ns], identifier, flags, length, data
_REMOTE: Final = 1
_EXTENDED: Final = 2
_PLACE_SHIFT: Final = 2  # the flags' upper bits tell which bus
_PLACES: Final = 1 << 6
_VERSIONED: Final = ("torquerig", "canopen", "numba", "numpy", "pyarrow", "python-can")


class Column(Protocol):
    """One number a row, with its unit."""

    @property
    def name(self) -> str:
        """Its name."""
        ...

    @property
    def unit(self) -> str:
        """Its unit, "1" for flags and ratios."""
        ...

    @property
    def values(self) -> NDArray[Any]:
        """Its values, shape (rows,)."""
        ...


class BusLog:
    """Every frame of a run in the order of the wire.

    Frames are kept packed: a list of objects would make the garbage collector's work grow with every frame.
    """

    def __init__(self) -> None:
        """Begin empty."""
        self._packed = bytearray()

    def __iter__(self) -> Iterator[tuple[int, Frame]]:
        """Iterate over the frames: when each was complete on the bus clock [ns], and the frame."""
        for at_ns, _, frame in self.placed():
            yield at_ns, frame

    def placed(self) -> Iterator[tuple[int, int, Frame]]:
        """Iterate over the frames with the place of their bus: when each was complete [ns], where, and the frame."""
        for at_ns, can_id, flags, length, data in _FRAME.iter_unpack(self._packed):
            frame = Frame(can_id, data[:length], bool(flags & _REMOTE), bool(flags & _EXTENDED))
            yield at_ns, flags >> _PLACE_SHIFT, frame

    def tap(self, at_ns: int, frame: Frame) -> None:
        """Keep one frame."""
        flags = frame.remote * _REMOTE | frame.extended * _EXTENDED
        self._packed += _FRAME.pack(at_ns, frame.can_id, flags, len(frame.data), frame.data)

    def tap_of(self, place: int) -> Tap:
        """What keeps the frames of one of several buses.

        Args:
            place: Which of them, from 0.

        Raises:
            ValueError: There are not so many.
        """
        if not 0 <= place < _PLACES:
            raise ValueError(f"a log has room for {_PLACES} buses, not for number {place + 1}")
        where = place << _PLACE_SHIFT

        def tap(at_ns: int, frame: Frame) -> None:
            flags = frame.remote * _REMOTE | frame.extended * _EXTENDED | where
            self._packed += _FRAME.pack(at_ns, frame.can_id, flags, len(frame.data), frame.data)

        return tap if place else self.tap

    def load(self, begin_ns: int, end_ns: int, bitrate: int, place: int = 0) -> float:
        """Share of a time span in which a bus was busy, if bit stuffing was at its worst.

        Args:
            begin_ns: Begin of the span on the bus clock.
            end_ns: Its end.
            bitrate: Bits per second of the bus.
            place: Which of several buses.

        Returns:
            The share, 1.0 for a full bus; NaN for an empty span.
        """
        if end_ns <= begin_ns:
            return math.nan
        bits = sum(
            worst_case_bits(0 if frame.remote else len(frame.data), extended=frame.extended)
            for at_ns, where, frame in self.placed()
            if where == place and begin_ns < at_ns <= end_ns
        )
        return bits * 1e9 / (bitrate * (end_ns - begin_ns))

    def write(self, path: Path, channel: str, epoch_ns: int = 0, others: Sequence[str] = ()) -> None:
        """Write the frames as `candump -L` does, in the order of time.

        In real time a frame may be handed out, and so kept, after one that was sent later.

        Args:
            path: The file.
            channel: Name of the bus, without blanks.
            epoch_ns: What the bus clock's zero is on the clock of the stamps.
            others: Names of the other buses, in the order of their places.

        Raises:
            RecordError: If it cannot be written; then there is no file.
        """
        with _whole(path) as part, part.open("w", encoding="ascii", newline="\n") as file:
            names, frames = (channel, *others), sorted(self.placed(), key=itemgetter(0))
            file.writelines(candump_line(at_ns + epoch_ns, names[place], frame) for at_ns, place, frame in frames)


def candump_line(at_ns: int, channel: str, frame: Frame) -> str:
    """A frame as a line of `candump -L`, stamped in microseconds.

    Args:
        at_ns: When the frame was complete.
        channel: Name of the bus, without blanks.
        frame: The frame.

    Returns:
        As `(0000000000.004000) vcan0 080#`, with the line's end.
    """
    seconds, microseconds = divmod(at_ns // 1000, 1_000_000)
    identifier = f"{frame.can_id:08X}" if frame.extended else f"{frame.can_id:03X}"
    data = f"R{len(frame.data) or ''}" if frame.remote else frame.data.hex().upper()
    return f"({seconds:010d}.{microseconds:06d}) {channel} {identifier}#{data}\n"


def channel_name(url: str) -> str:
    """What a bus is called in its log.

    Args:
        url: The bus URL, as `socketcan:vcan0` or `unix:/run/rig`.

    Returns:
        The interface's channel where that is a name, else the scheme.
    """
    scheme, _, channel = url.partition(":")
    return channel if channel.isalnum() else scheme


def claim(place: Path) -> Path:
    """Make the folder of a new record.

    Args:
        place: Where it is to be.

    Returns:
        The folder, empty.

    Raises:
        RecordError: If something is there already, or the folder cannot be made or written to.
    """
    try:
        place.mkdir(parents=True, exist_ok=True)
        if any(place.iterdir()):
            raise RecordError(f"{place} is not empty, and a record is never overwritten: name another folder")
        if not os.access(place, os.W_OK | os.X_OK):
            raise RecordError(f"cannot write a record into {place}: there is no permission")
    except OSError as error:
        if isinstance(error, RecordError):
            raise
        raise RecordError(f"cannot make the record's folder {place}: {error.strerror}") from error
    return place


@contextmanager
def _whole(path: Path) -> Iterator[Path]:
    """A name to write under; what is there in the end gets the file's name."""
    part = path.with_name(f"{path.name}.part")
    try:
        yield part
        os.replace(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise RecordError(f"cannot write the record's file {path}: {error.strerror or error}") from error


def write_table(path: Path, columns: Iterable[Column]) -> None:
    """Write columns as a Parquet file, each with its unit in its field's metadata.

    Args:
        path: The file.
        columns: The columns, all of one length.

    Raises:
        RecordError: If it cannot be written; then there is no file.
    """
    import pyarrow as pa  # noqa: PLC0415  (takes half a second, and only records need it)
    import pyarrow.parquet as pq  # noqa: PLC0415

    kept = list(columns)
    arrays = [pa.array(np.ascontiguousarray(column.values)) for column in kept]
    schema = pa.schema(
        [
            pa.field(column.name, array.type, metadata={"unit": column.unit})
            for column, array in zip(kept, arrays, strict=True)
        ]
    )
    with _whole(path) as part:
        pq.write_table(pa.Table.from_arrays(arrays, schema=schema), part)


def write_run(path: Path, facts: Mapping[str, Any]) -> None:
    """Write what a run was: its configuration, the versions, its outcome; to be called when all else is written.

    Args:
        path: The file.
        facts: Anything that JSON can hold; a number that is none becomes null.

    Raises:
        RecordError: If it cannot be written; then there is no file.
    """
    whole = {"format": FORMAT, **facts, "versions": versions()}
    text = json.dumps(whole, indent=2, ensure_ascii=False, default=str, allow_nan=False)
    with _whole(path) as part:
        part.write_text(text + "\n", encoding="utf-8")


def versions() -> dict[str, str]:
    """Versions of what takes part in a run."""
    return {
        "python": platform.python_version(),
        "platform": platform.platform(),
        **{name: version(name) for name in _VERSIONED},
    }
