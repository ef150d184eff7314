"""The unix bus behind our bus protocol."""

from collections import deque
from functools import partial
from typing import Final

from torquerig.driver.bus.cyclic import Cycle, CyclicPort
from torquerig.driver.bus.cyclic_memory import SUPPORTED
from torquerig.driver.bus.interface import Clock, Tap
from torquerig.driver.bus.python_can import PythonCanBus
from torquerig.driver.bus.unix import UnixBus
from torquerig.driver.bus.unix_port import MOST_PEERS, UnixPort
from torquerig.driver.wire.frame import Arrival, Frame

_LONG_AGO_NS: Final = 0


class UnixMemberBus(PythonCanBus):
    """A member of the unix bus, which offers a cycle a port (`CyclicBus`).

    While that is open the tap is told of process data when somebody waits for frames, and at the end.
    """

    def __init__(self, bus: UnixBus, clock: Clock, tap: Tap | None = None, *, spin_ns: int = 0) -> None:
        """Take over a member; `close` has it leave."""
        super().__init__(bus, clock, tap, spin_ns=spin_ns)
        self._member = bus
        self._early: deque[Arrival] = deque()  # taken from the connections by the port
        self._port: UnixPort | None = None

    def send(self, frame: Frame) -> None:
        """Hand a frame to all members; see `PythonCanBus`."""
        if self._port is not None:
            self._port.tell()
        super().send(frame)

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame, or None once `until_ns` has come; see `PythonCanBus`."""
        if self._port is not None:
            self._port.tell()
        if self._early:
            self._check_open()
            return self._early.popleft()
        return super().receive(until_ns)

    def open_cyclic(self, cycle: Cycle) -> CyclicPort | None:
        """Return a port for a cycle: see `CyclicBus`."""
        self.close_cyclic()
        self._check_open()
        if not SUPPORTED or self._member.members > MOST_PEERS or self._member.filters is not None:
            return None
        self._port = UnixPort(
            self._member,
            cycle,
            tap=self._tap,
            take_inbox=partial(super().receive, _LONG_AGO_NS),
            early=self._early,
        )
        return self._port

    def close_cyclic(self) -> None:
        """Have all frames come through `receive` again."""
        if self._port is not None:
            self._port.close()
            self._port = None

    def close(self) -> None:
        """Tell the tap the rest, and leave the bus; may be called again."""
        self.close_cyclic()
        super().close()
