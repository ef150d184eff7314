"""The unix bus behind our bus protocol: frames go in batches, through compiled code."""

import os
from collections import deque
from collections.abc import Sequence
from typing import Final

from torquerig.driver.bus.cyclic import Cycle, CyclicPort
from torquerig.driver.bus.interface import Clock, Tap
from torquerig.driver.bus.python_can import PythonCanBus
from torquerig.driver.bus.unix import UnixBus
from torquerig.driver.bus.unix_connections import UnixConnections
from torquerig.driver.bus.unix_kernels import ERROR, EXTENDED, FOREIGN, REMOTE
from torquerig.driver.bus.unix_port import UnixPort
from torquerig.driver.wire.frame import Arrival, Frame

_LONG_AGO_NS: Final = 0
_new: Final = tuple.__new__  # of frames, in half the time


class UnixMemberBus(PythonCanBus):
    """A member of the unix bus, for one thread at a time; it takes several frames at once (`BatchBus`).

    Filters that were set by python-can, and more members than compiled code knows, are served by python-can's way.
    It offers a cycle a port (`CyclicBus`). While that is open the tap is told of process data when somebody waits for
    frames, and at the end.
    """

    def __init__(self, bus: UnixBus, clock: Clock, tap: Tap | None = None, *, spin_ns: int = 0) -> None:
        """Take over a member; `close` has it leave."""
        super().__init__(bus, clock, tap, spin_ns=spin_ns)
        self._member = bus
        # on a single processor nobody could answer meanwhile
        self._connections = UnixConnections(bus, spin_ns if (os.cpu_count() or 1) > 1 else 0)
        self._inbox: deque[Arrival] = deque()
        self._watched = False  # whether somebody waits by `fileno`
        self._port: UnixPort | None = None

    @property
    def counts(self) -> dict[str, int]:
        """Everything that went wrong without an error; see `PythonCanBus`."""
        self._connections.settle()
        return super().counts

    def send(self, frame: Frame) -> None:
        """Hand a frame to all members; see `PythonCanBus`."""
        self.send_all((frame,))

    def send_all(self, frames: Sequence[Frame]) -> int:
        """Hand frames to all members; see `BatchBus`."""
        self._check_open()
        if self._port is not None:
            self._fetch()
        sent = self._connections.send(frames) if self._connections.usable() else 0
        if self._tap is not None:
            now_ns = self.now_ns()
            for frame in frames[:sent]:
                self._tap(now_ns, frame)
        for frame in frames[sent:]:
            super().send(frame)
        return len(frames)

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame, or None once `until_ns` has come; see `PythonCanBus`."""
        inbox = self._inbox
        if not inbox and not self._wait(until_ns):
            return None
        arrival = inbox.popleft()
        if self._watched:
            self._member._settle_flag()
        return arrival

    def fileno(self) -> int:
        """Return a descriptor that is readable whenever a frame waits."""
        if not self._watched:
            self._watched = True
            self._member._kept = self._inbox
            self._member._settle_flag()
        return super().fileno()

    def open_cyclic(self, cycle: Cycle) -> CyclicPort | None:
        """Return a port for a cycle: see `CyclicBus`."""
        self.close_cyclic()
        self._check_open()
        self._connections.look_around()
        if not self._connections.usable():
            return None
        tapped = self._tap is not None
        self._port = UnixPort(self._connections, cycle, tapped=tapped, others=self._take_others)
        return self._port

    def close_cyclic(self) -> None:
        """Have all frames come through `receive` again."""
        if self._port is not None:
            self._port.close()
            self._port = None
            self._fetch()

    def close(self) -> None:
        """Tell the tap the rest, and leave the bus; may be called again."""
        self.close_cyclic()
        super().close()
        self._inbox.clear()

    def _wait(self, until_ns: int) -> bool:
        """Wait until the inbox has a frame; False if there is none once a time has come."""
        inbox, member, connections = self._inbox, self._member, self._connections
        while True:
            self._check_open()
            if member._inbox:
                self._take_over()
                if inbox:
                    return True
            if not connections.usable():
                arrival = super().receive(until_ns)
                if arrival is not None:
                    inbox.append(arrival)
                return arrival is not None
            if connections.take(until_ns - self._spin_ns):
                self._fetch()
                if inbox:
                    return True
            if self.now_ns() >= until_ns and not member._inbox and connections.usable():
                return False

    def _take_over(self) -> None:
        """Take what python-can's way has read from the connections."""
        while self._member._inbox and (arrival := super().receive(_LONG_AGO_NS)) is not None:
            self._inbox.append(arrival)

    def _fetch(self) -> None:
        """Take what compiled code has read from the connections, and tell the tap of it and of what a port sent."""
        latest_ns, tap, inbox = self._latest_ns, self._tap, self._inbox
        for at_ns, kind, can_id, flags, length, data in self._connections.entries():
            if flags & ERROR:
                self._ignored["error"] += 1
                continue
            latest_ns = max(latest_ns, at_ns)
            if flags:
                remote, extended = bool(flags & REMOTE), bool(flags & EXTENDED)
                frame = Frame(can_id, bytes(length) if remote else data[:length], remote, extended)
            else:
                frame = _new(Frame, (can_id, data[:length], False, False))
            if tap is not None:
                tap(latest_ns, frame)
            if kind == FOREIGN:
                inbox.append(_new(Arrival, (latest_ns, frame)))
        self._latest_ns = latest_ns
        if self._watched:
            self._member._settle_flag()

    def _take_others(self) -> tuple[Arrival, ...]:
        """Return what waits and is no process data; takes in newcomers, and lets go who left."""
        self._fetch()
        if self._connections.has_company():
            self._connections.look_around()
            self._take_over()
        arrivals = tuple(self._inbox)
        self._inbox.clear()
        if self._watched:
            self._member._settle_flag()
        return arrivals
