"""A socket of the kernel's CAN as compiled code sees it: memory laid out once, that frames go through in batches."""

import socket
import struct
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Final

import numpy as np

from torquerig.driver.bus import can_frame_kernels
from torquerig.driver.bus.compiled import bind
from torquerig.driver.bus.cyclic_kernels import BATCH
from torquerig.driver.bus.cyclic_memory import CAN_FRAME, HEADER, NOW, POLLED, STAMP, VECTOR, address, point, poll_for
from torquerig.driver.bus.kernel_frame import BASE_ID, FRAME, identifier_of
from torquerig.driver.bus.messages import check_frame
from torquerig.driver.wire.frame import MAX_DATA_LENGTH, Frame

MOST_SENT: Final = 64
"""Frames handed to the kernel with one call; more take several."""
_LOST: Final = np.dtype([("size", "u8"), ("level", "i4"), ("kind", "i4"), ("count", "u4")], align=True)
EXTRAS: Final = np.dtype([("stamp", STAMP), ("lost", _LOST)], align=True)
"""What the kernel says beside a frame: its time, and how many frames found no room, ever (SO_RXQ_OVFL)."""
assert EXTRAS.itemsize == can_frame_kernels.EXTRAS_SIZE  # noqa: S101  (what the kernels were told)
ENTRY: Final = np.dtype([("at_ns", "i8"), ("can_id", "u4"), ("length", "u1"), ("data", "u1", (8,))], align=True)
FRAMES_WIRE: Final = np.dtype(
    [
        *NOW,
        ("polled", POLLED, (2,)),
        *((name, "i8") for name in ("sender", "most", "first", "spin_ns", "seen_ns", "latest_ns", "offset_ns")),
        *((name, "i8") for name in ("offset_until_ns", "error", "errors", "malformed", "missed", "logged")),
        *((name, "u8") for name in ("headers_in_at", "headers_out_at")),
        ("log", ENTRY, (BATCH,)),
        ("frame_in", CAN_FRAME, (BATCH,)),
        ("extras", EXTRAS, (BATCH,)),
        ("vector_in", VECTOR, (BATCH,)),
        ("header_in", HEADER, (BATCH,)),
        ("frame_out", CAN_FRAME, (MOST_SENT,)),
        ("vector_out", VECTOR, (MOST_SENT,)),
        ("header_out", HEADER, (MOST_SENT,)),
    ],
    align=True,
)
_ENTRY: Final = struct.Struct("=qIB8s3x")
assert _ENTRY.size == ENTRY.itemsize  # noqa: S101  (the same memory)
_FRAME_SIZE: Final = FRAME.size
_lay_out: Final = FRAME.pack_into

Entry = tuple[int, int, int, bytes]
"""Of a frame: its time [ns], identifier with its flags, length, eight bytes."""


class KernelCanFrames:
    """A socket's frames, for one thread at a time.

    Attributes:
        take: Takes what waits, and if there is nothing, waits for it until a time [ns]; returns how many `entries`
            there are, 0 once the time has come, or less than 0: an error, -EINTR when a signal ended the wait.
    """

    def __init__(self, opened: socket.socket, *, now_ns: int, spin_ns: int) -> None:
        """Lay the frames out; nothing is sent.

        Args:
            opened: The socket; it has timestamps.
            now_ns: No frame is said to have come before [ns].
            spin_ns: The last stretch of a wait, spent looking instead of sleeping [ns].
        """
        self._wire = np.zeros(1, dtype=FRAMES_WIRE)
        record = self._wire[0]
        record["sender"], record["spin_ns"], record["latest_ns"] = opened.fileno(), spin_ns, now_ns
        self._most, self._first = self._wire["most"], self._wire["first"]
        self.read_from((opened,))
        self.take_at_once(BATCH)
        for side in ("in", "out"):
            point(self._wire, f"header_{side}", f"vector_{side}", f"frame_{side}", CAN_FRAME.itemsize)
            record[f"headers_{side}_at"] = address(self._wire, f"header_{side}")
        for k, header in enumerate(record["header_in"]):
            header["control"] = address(self._wire, "extras", k)
        self._log = record["log"].view(np.uint8).data
        self._out = record["frame_out"].view(np.uint8).data
        self.take = bind(can_frame_kernels.can_frames_take, self._wire, scalars=("int64",))
        self._send = bind(can_frame_kernels.can_frames_send, self._wire, scalars=("int64",))

    def read_from(self, sockets: Iterable[socket.socket]) -> None:
        """Have frames come from one or two sockets, from the first one first."""
        poll_for(self._wire, (each.fileno() for each in sockets))

    def take_at_once(self, most: int, first: int = 0) -> None:
        """Take so many frames with one call at most, up to 16: what is not taken waits where others see it.

        Args:
            most: How many.
            first: Which of the sockets is the first that they are taken from.
        """
        self._most[0], self._first[0] = most, first

    @property
    def offset_ns(self) -> int:
        """What the epoch's clock, that of the kernel's times, is ahead of the monotonic one [ns]."""
        return int(self._wire["offset_ns"][0])

    @property
    def ignored(self) -> dict[str, int]:
        """How many frames were not handed on, by kind, and how many found no room (`missed`), ever."""
        record = self._wire[0]
        counts = {"error": record["errors"], "malformed": record["malformed"], "missed": record["missed"]}
        return {kind: int(count) for kind, count in counts.items() if count}

    def entries(self, count: int) -> Iterator[Entry]:
        """Return what was taken, in the order in which it came."""
        return _ENTRY.iter_unpack(self._log[: count * _ENTRY.size])

    def send(self, frames: Sequence[Frame]) -> int:
        """Send frames, 64 at most, without waiting.

        Returns:
            How many were sent, from the first on; less than 0: an error, and none was.

        Raises:
            ValueError: One is no classic CAN frame; none was sent.
        """
        count = 0
        for frame in islice(frames, MOST_SENT):
            can_id, data, remote, extended = frame
            if remote or extended or not 0 <= can_id <= BASE_ID or len(data) > MAX_DATA_LENGTH:
                check_frame(frame)
                can_id = identifier_of(frame)
            _lay_out(self._out, count * _FRAME_SIZE, can_id, len(data), data)
            count += 1
        return self._send(count)
