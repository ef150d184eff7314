"""The kernel's CAN, opened by python-can and then spoken to through its socket: a frame costs one system call.

python-can's own `recv` and `send` make a message object, read clocks and build each frame anew, which costs a loop at
250 Hz most of its time on a slow processor. Frames are `struct can_frame` of linux/can.h in the machine's byte order.
"""

import select
import socket
import struct
import time
from typing import Final

import can

from torquerig.driver.bus.interface import Clock, Tap
from torquerig.driver.bus.python_can import PythonCanBus
from torquerig.driver.wire.frame import MAX_DATA_LENGTH, Arrival, Frame

FRAME: Final = struct.Struct("=IB3x8s")  # can_id and flags, length, data
EXTENDED: Final = 0x8000_0000
REMOTE: Final = 0x4000_0000
ERROR: Final = 0x2000_0000
BASE_ID: Final = 0x7FF
EXTENDED_ID: Final = 0x1FFF_FFFF
STAMP: Final = struct.Struct("@qq")  # struct timespec: seconds, nanoseconds of the epoch
NS_PER_S: Final = 10**9
OFFSET_AGE_NS: Final = NS_PER_S
"""How long the difference between the epoch and the monotonic clock is believed: NTP moves it by ppm, or steps it."""


class KernelCanBus(PythonCanBus):
    """A SocketCAN interface behind our bus protocol; errors, counts and closing are those of any python-can bus."""

    def __init__(
        self, bus: can.interfaces.socketcan.SocketcanBus, clock: Clock, tap: Tap | None = None, *, spin_ns: int = 0
    ) -> None:
        """Take over an open SocketCAN bus of python-can; `close` shuts it down."""
        super().__init__(bus, clock, tap, spin_ns=spin_ns)
        self._socket: socket.socket = bus.socket
        self._out = bytearray(FRAME.size)
        self._in = bytearray(FRAME.size)
        self._stamp_room = socket.CMSG_SPACE(STAMP.size)
        self._offset_ns = 0
        self._offset_until_ns = 0
        self._believe_offset(clock.now_ns())

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame, or None once `until_ns` has come; what waits already comes first.

        Raises:
            BusError: The link is gone, or the bus is closed.
        """
        self._check_open()
        while True:
            try:
                arrival = self._take()
                if arrival is not None:
                    return arrival
                now_ns = self._clock.now_ns()
                if now_ns >= until_ns:
                    return None
                if now_ns > self._offset_until_ns:
                    self._believe_offset(now_ns)
                left_ns = until_ns - self._spin_ns - now_ns
                if left_ns > 0:
                    select.select((self._socket,), (), (), left_ns / NS_PER_S)
            except OSError as error:
                raise self._failure("receive", error) from error

    def _put(self, frame: Frame) -> None:
        can_id = frame.can_id | (EXTENDED if frame.extended else 0) | (REMOTE if frame.remote else 0)
        FRAME.pack_into(self._out, 0, can_id, len(frame.data), frame.data)
        self._socket.send(self._out)

    def _take(self) -> Arrival | None:
        """Return the next frame that waits in the socket; None when there is none. What is no frame is counted."""
        while True:
            try:
                size, extras, _, _ = self._socket.recvmsg_into([self._in], self._stamp_room, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return None
            can_id, length, data = FRAME.unpack_from(self._in)
            if can_id & ERROR:
                self._ignored["error"] += 1
            elif size != FRAME.size or length > MAX_DATA_LENGTH:
                self._ignored["malformed"] += 1
            else:
                return self._arrived(can_id, data[:length], extras)

    def _arrived(self, can_id: int, data: bytes, extras: list[tuple[int, int, bytes]]) -> Arrival:
        """Return the frame with the kernel's time of it on the monotonic clock; times never run backwards."""
        at_ns = self._latest_ns
        for _, _, stamp in extras:
            seconds, nanoseconds = STAMP.unpack(stamp)
            at_ns = max(at_ns, seconds * NS_PER_S + nanoseconds - self._offset_ns)
        self._latest_ns = at_ns
        extended, remote = bool(can_id & EXTENDED), bool(can_id & REMOTE)
        identifier = can_id & (EXTENDED_ID if extended else BASE_ID)
        frame = Frame(identifier, bytes(len(data)) if remote else data, remote, extended)
        if self._tap is not None:
            self._tap(at_ns, frame)
        return Arrival(at_ns, frame)

    def _believe_offset(self, now_ns: int) -> None:
        self._offset_ns = time.time_ns() - self._clock.now_ns()
        self._offset_until_ns = now_ns + OFFSET_AGE_NS
