"""The cycle's own way through the kernel's CAN: a second socket that the kernel hands process data only.

The first socket, python-can's, is handed all the rest, and everything is sent from there: no socket hears itself, so
none hears our SYNC. If somebody wants the log, a third one is handed all frames, ours included, with the kernel's times
and in its order, and is read when there is time.
"""

import contextlib
import os
import socket
import struct
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from torquerig.driver.bus import can_kernels
from torquerig.driver.bus.compiled import bind
from torquerig.driver.bus.cyclic import Cycle
from torquerig.driver.bus.cyclic_kernels import BATCH
from torquerig.driver.bus.cyclic_memory import (
    CAN_FRAME,
    HEADER,
    NOW,
    POLLED,
    STAMP,
    VECTOR,
    address,
    point,
    poll_for,
    stamped,
)
from torquerig.driver.bus.interface import Tap
from torquerig.driver.bus.kernel_frame import frame_from
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Arrival

SOL_CAN_RAW: Final = 101  # linux/can/raw.h
CAN_RAW_FILTER: Final = 1
CAN_RAW_JOIN_FILTERS: Final = 6
INVERTED: Final = 0x2000_0000  # CAN_INV_FILTER, linux/can.h
EXACT: Final = 0xC000_07FF  # the identifier's 11 bits, not extended, not remote
SO_TIMESTAMPNS: Final = 35  # asm-generic/socket.h
SO_RCVBUFFORCE: Final = 33
ROOM: Final = 1 << 20
"""Of a socket's queue [byte]: what is usual, 212992, holds 278 frames, and what does not fit is lost."""
_FILTER: Final = struct.Struct("=II")
_OUT: Final = 128  # commands at most; the SYNC stands behind them

CAN_WIRE: Final = np.dtype(
    [
        *NOW,
        ("polled", POLLED, (2,)),
        *((name, "i8") for name in ("other", "process", "offset_ns", "offset_until_ns", "latest_ns", "pending")),
        *((name, "u8") for name in ("headers_in_at", "headers_out_at", "sync_at")),
        ("at_ns", "i8", (BATCH,)),
        ("frame_in", CAN_FRAME, (BATCH,)),
        ("stamp", STAMP, (BATCH,)),
        ("vector_in", VECTOR, (BATCH,)),
        ("header_in", HEADER, (BATCH,)),
        ("frame_out", CAN_FRAME, (_OUT + 1,)),
        ("vector_out", VECTOR, (_OUT + 1,)),
        ("header_out", HEADER, (_OUT + 1,)),
    ],
    align=True,
)
assert CAN_FRAME.itemsize == can_kernels.FRAME_SIZE  # noqa: S101  (what the kernels were told)

Fail = Callable[[str, OSError], BusError]
"""Makes the bus's error of what failed, as in "cannot send", and why."""


def make_room(opened: socket.socket) -> None:
    """Let a socket's queue hold as many frames as the kernel allows."""
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, ROOM)
    with contextlib.suppress(PermissionError):  # beyond net.core.rmem_max only with CAP_NET_ADMIN
        opened.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, ROOM)


def open_filtered(interface: str, can_ids: Sequence[int] | None) -> socket.socket:
    """Return a raw CAN socket with timestamps that is handed data frames of these identifiers only; None: all frames.

    Raises:
        OSError: The interface is gone.
    """
    opened = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    try:
        if can_ids is not None:
            filters = b"".join(_FILTER.pack(can_id, EXACT) for can_id in can_ids)
            opened.setsockopt(SOL_CAN_RAW, CAN_RAW_FILTER, filters)
        opened.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        make_room(opened)
        opened.bind((interface,))
    except BaseException:
        opened.close()
        raise
    return opened


def leave_out(opened: socket.socket, can_ids: Sequence[int]) -> None:
    """Have a raw CAN socket handed everything but data frames of these identifiers.

    Raises:
        OSError: The kernel has no joined filters (Linux before 4.1).
    """
    opened.setsockopt(SOL_CAN_RAW, CAN_RAW_JOIN_FILTERS, 1)
    filters = b"".join(_FILTER.pack(can_id | INVERTED, EXACT) for can_id in can_ids)
    opened.setsockopt(SOL_CAN_RAW, CAN_RAW_FILTER, filters)


def let_all_in(opened: socket.socket) -> None:
    """Undo `leave_out`."""
    opened.setsockopt(SOL_CAN_RAW, CAN_RAW_JOIN_FILTERS, 0)
    opened.setsockopt(SOL_CAN_RAW, CAN_RAW_FILTER, _FILTER.pack(0, 0))


class KernelCanPort:
    """A cycle's port on two sockets; satisfies `CyclicPort`."""

    def __init__(
        self,
        other: socket.socket,
        process: socket.socket,
        cycle: Cycle,
        take_others: Callable[[], Sequence[Arrival]],
        fail: Fail,
    ) -> None:
        """Lay the frames out; nothing is sent.

        Args:
            other: Is handed what is no process data, and sends everything.
            process: Is handed process data; `close` closes it.
            cycle: The cycle.
            take_others: Takes frames from the one.
            fail: Makes errors.
        """
        self.process = process
        self._take_others = take_others
        self._fail = fail
        self._wire = _wire_of(process)
        record = self._wire[0]
        record["other"] = other.fileno()
        poll_for(self._wire, (other.fileno(), process.fileno()))
        point(self._wire, "header_out", "vector_out", "frame_out", CAN_FRAME.itemsize)
        record["headers_out_at"] = address(self._wire, "header_out")
        record["sync_at"] = address(self._wire, "frame_out", _OUT)
        record["frame_out"][_OUT]["can_id"] = cycle.sync.can_id
        for frame, command in zip(record["frame_out"], cycle.field("command")[0], strict=False):
            frame["can_id"], frame["length"] = command["can_id"], command["length"]
        records = cycle.block, self._wire
        self.sync = bind(can_kernels.can_sync, *records, scalars=("int64", "boolean"))
        self.take = bind(can_kernels.can_take, *records, scalars=("int64",))
        self.command = bind(can_kernels.can_command, *records, scalars=("int64", "boolean"))

    def remind(self) -> None:
        """Have frames that wait elsewhere than in the sockets handed out by `others`."""
        self._wire["pending"] = 1

    def others(self) -> Sequence[Arrival]:
        """Return the next frames that are no process data."""
        self._wire["pending"] = 0
        return self._take_others()

    def error(self, flags: int) -> BusError:
        """What an error among the flags means."""
        return self._fail("exchange process data", OSError(-flags, os.strerror(-flags)))

    def close(self) -> None:
        """Close the socket of process data."""
        self.process.close()


class KernelCanLog:
    """Tells a tap all frames of an interface, when there is time.

    Attributes:
        tap: Who is told.
    """

    def __init__(self, opened: socket.socket, tap: Tap) -> None:
        """Take an open socket over; `close` closes it."""
        self._socket = opened
        self.tap = tap
        self._wire = _wire_of(opened)
        self._receive = bind(can_kernels.can_receive, self._wire, scalars=("int64",))

    def tell(self, offset_ns: int) -> None:
        """Tell the tap what has come.

        Args:
            offset_ns: What the clock of the stamps, the epoch's, is ahead of the monotonic one.
        """
        record = self._wire[0]
        record["offset_ns"] = offset_ns
        got = BATCH
        while got == BATCH:
            got = self._receive(BATCH)
            for k in range(got):
                can_id, length, _, data = record["frame_in"][k].item()
                self.tap(int(record["at_ns"][k]), frame_from(can_id, bytes(data[:length])))

    def close(self) -> None:
        """Leave the interface."""
        self._socket.close()


def _wire_of(process: socket.socket) -> "np.ndarray[tuple[int], np.dtype[np.void]]":
    """A wire's record for what comes from a socket."""
    wire = np.zeros(1, dtype=CAN_WIRE)
    record = wire[0]
    record["process"] = process.fileno()
    point(wire, "header_in", "vector_in", "frame_in", CAN_FRAME.itemsize)
    stamped(wire)
    record["headers_in_at"] = address(wire, "header_in")
    return wire
