"""The kernel's CAN, opened by python-can and then spoken to through its socket: a frame costs one system call.

python-can's own `recv` and `send` make a message object, read clocks and build each frame anew, which costs a loop at
250 Hz most of its time on a slow processor. A cycle has a socket of its own besides, see `kernel_can_port`.
"""

import contextlib
import select
import socket
import struct
import time
from typing import Final

import can

from torquerig.driver.bus.cyclic import Cycle, CyclicPort
from torquerig.driver.bus.cyclic_memory import SUPPORTED
from torquerig.driver.bus.interface import Clock, Tap
from torquerig.driver.bus.kernel_can_port import (
    SO_TIMESTAMPNS,
    KernelCanLog,
    KernelCanPort,
    leave_out,
    let_all_in,
    make_room,
    open_filtered,
)
from torquerig.driver.bus.kernel_frame import ERROR, FRAME, frame_from, pack_frame
from torquerig.driver.bus.python_can import PythonCanBus
from torquerig.driver.wire.frame import MAX_DATA_LENGTH, Arrival, Frame

STAMP: Final = struct.Struct("@qq")  # struct timespec: seconds, nanoseconds of the epoch
LOST: Final = struct.Struct("@I")  # frames that found no room, ever (SO_RXQ_OVFL)
SO_RXQ_OVFL: Final = 40  # asm-generic/socket.h
NS_PER_S: Final = 10**9
OFFSET_AGE_NS: Final = NS_PER_S
"""How long the difference between the epoch and the monotonic clock is believed: NTP moves it by ppm, or steps it."""


class KernelCanBus(PythonCanBus):
    """A SocketCAN interface behind our bus protocol; errors, counts and closing are those of any python-can bus.

    It offers a cycle a port (`CyclicBus`). While that is open the tap is told what the kernel says was on the wire,
    own frames included, when somebody waits for frames and at the end.
    """

    def __init__(
        self, bus: can.interfaces.socketcan.SocketcanBus, clock: Clock, tap: Tap | None = None, *, spin_ns: int = 0
    ) -> None:
        """Take over an open SocketCAN bus of python-can; `close` shuts it down."""
        super().__init__(bus, clock, tap, spin_ns=spin_ns)
        self._interface: str = bus.channel
        self._socket: socket.socket = bus.socket
        self._port: KernelCanPort | None = None
        self._log: KernelCanLog | None = None
        self._sockets: tuple[socket.socket, ...] = (self._socket,)  # that frames come from, process data last
        self._out = bytearray(FRAME.size)
        self._in = bytearray(FRAME.size)
        self._extras_room = socket.CMSG_SPACE(STAMP.size) + socket.CMSG_SPACE(LOST.size)
        self._offset_ns = 0
        self._offset_until_ns = 0
        self._believe_offset(clock.now_ns())
        make_room(self._socket)
        self._socket.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame, or None once `until_ns` has come; what waits already comes first.

        Raises:
            BusError: The link is gone, or the bus is closed.
        """
        self._check_open()
        if self._log is not None:
            self._log.tell(self._offset_ns)
        left_ns = 0
        while True:
            try:
                for each in select.select(self._sockets, (), (), left_ns / NS_PER_S)[0]:
                    arrival = self._take(each)
                    if arrival is not None:
                        return arrival
                now_ns = self._clock.now_ns()
                if now_ns >= until_ns:
                    return None
                if now_ns > self._offset_until_ns:
                    self._believe_offset(now_ns)
                left_ns = max(until_ns - self._spin_ns - now_ns, 0)
            except OSError as error:
                raise self._failure("receive", error) from error

    def open_cyclic(self, cycle: Cycle) -> CyclicPort | None:
        """Return a port for a cycle: see `CyclicBus`."""
        self.close_cyclic()
        self._check_open()
        if not SUPPORTED:
            return None
        try:
            process = self._open_socket(cycle.answer_ids)
            self._port = KernelCanPort(self._socket, process, cycle, self._take_other, self._failure)
            self._leave_out(cycle.answer_ids)
            if self._tap is not None:
                self._log = KernelCanLog(self._open_socket(None), self._tap)
                self._tap = None
        except OSError as error:
            raise self._failure("receive", error) from error
        self._sockets = (process, self._socket)
        return self._port

    def close_cyclic(self) -> None:
        """Have all frames come through `receive` again."""
        if self._port is None:
            return
        self._sockets = (self._socket,)
        self._port.close()
        self._port = None
        with contextlib.suppress(OSError):  # the interface may be gone
            self._let_all_in()
        if self._log is not None:
            self._log.tell(self._offset_ns)
            self._log.close()
            self._tap, self._log = self._log.tap, None

    def close(self) -> None:
        """Tell the tap the rest, and shut the python-can bus down; may be called again."""
        self.close_cyclic()
        super().close()

    def _open_socket(self, can_ids: tuple[int, ...] | None) -> socket.socket:
        return open_filtered(self._interface, can_ids)

    def _leave_out(self, can_ids: tuple[int, ...]) -> None:
        leave_out(self._socket, can_ids)

    def _let_all_in(self) -> None:
        let_all_in(self._socket)

    def _take_other(self) -> Arrival | None:
        """Return the next frame that waits and is no process data."""
        try:
            return self._take(self._socket)
        except OSError as error:
            raise self._failure("receive", error) from error

    def _put(self, frame: Frame) -> None:
        pack_frame(self._out, frame)
        self._socket.send(self._out)

    def _take(self, source: socket.socket) -> Arrival | None:
        """Return the next frame that waits in a socket; None when there is none. What is no frame is counted."""
        while True:
            try:
                size, extras, _, _ = source.recvmsg_into([self._in], self._extras_room, socket.MSG_DONTWAIT)
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
        for _, kind, content in extras:
            if kind == SO_TIMESTAMPNS:
                seconds, nanoseconds = STAMP.unpack(content)
                at_ns = max(at_ns, seconds * NS_PER_S + nanoseconds - self._offset_ns)
            elif kind == SO_RXQ_OVFL:
                (self._ignored["missed"],) = LOST.unpack(content)
        self._latest_ns = at_ns
        frame = frame_from(can_id, data)
        if self._tap is not None:
            self._tap(at_ns, frame)
        return Arrival(at_ns, frame)

    def _believe_offset(self, now_ns: int) -> None:
        self._offset_ns = time.time_ns() - self._clock.now_ns()
        self._offset_until_ns = now_ns + OFFSET_AGE_NS
