"""The kernel's CAN, opened by python-can and then spoken to through its socket by compiled code, frames in batches.

python-can's own `recv` and `send` make a message object, read clocks and build each frame anew, and even `recvmsg` of
Python's asks the kernel for the interface's name, at each frame: that costs a loop at 250 Hz most of its time where
system calls are slow. A cycle has a socket of its own besides, see `kernel_can_port`.
"""

import contextlib
import errno
import os
import socket
from collections import deque
from collections.abc import Sequence
from typing import Final

import can

from torquerig.driver.bus.cyclic import Cycle, CyclicPort
from torquerig.driver.bus.cyclic_kernels import BATCH
from torquerig.driver.bus.interface import Clock, Tap
from torquerig.driver.bus.kernel_can_frames import KernelCanFrames
from torquerig.driver.bus.kernel_can_port import (
    KernelCanLog,
    KernelCanPort,
    leave_out,
    let_all_in,
    make_room,
    open_filtered,
)
from torquerig.driver.bus.kernel_frame import BASE_ID, FRAME, frame_from, identifier_of
from torquerig.driver.bus.python_can import PythonCanBus
from torquerig.driver.wire.frame import Arrival, Frame

SO_RXQ_OVFL: Final = 40  # asm-generic/socket.h
_LONG_AGO_NS: Final = 0
_OTHER: Final = 1  # of the sockets beside a port, that of what is no process data
_new: Final = tuple.__new__  # of frames, in half the time


class KernelCanBus(PythonCanBus):
    """A SocketCAN interface behind our bus protocol, for one thread at a time; it takes several frames at once.

    Errors, counts and closing are those of any python-can bus. It offers a cycle a port (`CyclicBus`). While that is
    open the tap is told what the kernel says was on the wire, own frames included, when somebody waits for frames and
    at the end.
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
        self._inbox: deque[Arrival] = deque()
        self._watched = False  # whether somebody waits by `fileno`
        make_room(self._socket)
        self._socket.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
        self._frames = KernelCanFrames(self._socket, now_ns=clock.now_ns(), spin_ns=spin_ns)

    @property
    def ignored(self) -> dict[str, int]:
        """How many messages were not handed on, by kind: `error`, `malformed`; and `missed`: that found no room."""
        return self._frames.ignored

    @property
    def counts(self) -> dict[str, int]:
        """Everything that went wrong without an error."""
        return self._frames.ignored

    def send(self, frame: Frame) -> None:
        """Hand a frame to the interface; see `PythonCanBus`."""
        self.send_all((frame,))

    def send_all(self, frames: Sequence[Frame]) -> int:
        """Hand frames to the interface; see `BatchBus`."""
        self._check_open()
        count = 0
        while count < len(frames):
            try:
                count += self._send(frames[count:] if count else frames)
            except OSError as error:
                if not count:
                    raise self._failure("send", error) from error
                break
        if self._tap is not None and count:
            now_ns = self.now_ns()
            for frame in frames[:count]:
                self._tap(now_ns, frame)
        return count

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame, or None once `until_ns` has come; what waits already comes first.

        Raises:
            BusError: The link is gone, or the bus is closed.
        """
        inbox = self._inbox
        if not inbox and not self._wait(until_ns):
            return None
        return inbox.popleft()

    def fileno(self) -> int:
        """Return a descriptor that is readable whenever a frame waits, once those that were taken are received."""
        self._watched = True
        self._frames.take_at_once(1)
        return super().fileno()

    def open_cyclic(self, cycle: Cycle) -> CyclicPort | None:
        """Return a port for a cycle: see `CyclicBus`."""
        self.close_cyclic()
        self._check_open()
        try:
            process = self._open_socket(cycle.answer_ids)
            self._port = KernelCanPort(self._socket, process, cycle, self._take_others, self._failure)
            self._leave_out(cycle.answer_ids)
            if self._tap is not None:
                self._log = KernelCanLog(self._open_socket(None), self._tap)
                self._tap = None
        except OSError as error:
            raise self._failure("receive", error) from error
        if self._inbox:
            self._port.remind()
        self._frames.take_at_once(1)  # the port sees what waits in the sockets
        self._frames.read_from((process, self._socket))
        return self._port

    def close_cyclic(self) -> None:
        """Have all frames come through `receive` again."""
        if self._port is None:
            return
        self._frames.read_from((self._socket,))
        self._frames.take_at_once(1 if self._watched else BATCH)
        self._port.close()
        self._port = None
        with contextlib.suppress(OSError):  # the interface may be gone
            self._let_all_in()
        if self._log is not None:
            self._log.tell(self._frames.offset_ns)
            self._log.close()
            self._tap, self._log = self._log.tap, None

    def close(self) -> None:
        """Tell the tap the rest, and shut the python-can bus down; may be called again."""
        self.close_cyclic()
        super().close()
        self._inbox.clear()

    def _open_socket(self, can_ids: tuple[int, ...] | None) -> socket.socket:
        return open_filtered(self._interface, can_ids)

    def _leave_out(self, can_ids: tuple[int, ...]) -> None:
        leave_out(self._socket, can_ids)

    def _let_all_in(self) -> None:
        let_all_in(self._socket)

    def _take_others(self) -> Sequence[Arrival]:
        """Return what was taken before there was a port, and what waits and is no process data."""
        if not self._inbox:
            self._frames.take_at_once(BATCH, _OTHER)
            try:
                self._wait(_LONG_AGO_NS)
            finally:
                self._frames.take_at_once(1)
        arrivals = tuple(self._inbox)
        self._inbox.clear()
        return arrivals

    def _send(self, frames: Sequence[Frame]) -> int:
        """Send some frames, from the first on; how many.

        Raises:
            OSError: None could be sent.
        """
        sent = self._frames.send(frames)
        if sent == -errno.EAGAIN:  # its buffer is full: as any socket's `send`, with patience
            can_id, data = identifier_of(frames[0]), frames[0].data
            self._socket.send(FRAME.pack(can_id, len(data), data))
            return 1
        if sent < 0:
            raise OSError(-sent, os.strerror(-sent))
        return sent

    def _wait(self, until_ns: int) -> bool:
        """Wait until the inbox has a frame; False if there is none once a time has come."""
        self._check_open()
        if self._log is not None:
            self._log.tell(self._frames.offset_ns)
        while (found := self._frames.take(until_ns)) == -errno.EINTR:
            self._check_open()  # Python has done what the signal wanted
        if found < 0:
            raise self._failure("receive", OSError(-found, os.strerror(-found)))
        tap, put = self._tap, self._inbox.append
        for at_ns, can_id, length, data in self._frames.entries(found):
            frame = _new(Frame, (can_id, data[:length], False, False))
            if can_id > BASE_ID:
                frame = frame_from(can_id, frame.data)
            if tap is not None:
                tap(at_ns, frame)
            put(_new(Arrival, (at_ns, frame)))
        return found > 0
