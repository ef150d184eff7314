"""A bus whose SYNC is answered on the spot, by a peer in the same thread."""

from torquerig.benchmarks.wire_places import Peer
from torquerig.driver.bus.cyclic import Cycle, CyclicBus, CyclicPort
from torquerig.driver.bus.interface import Bus
from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Arrival, Frame


class AnsweredPort:
    """A cycle's port whose SYNC is answered; all else costs what it costs there. Satisfies `CyclicPort`."""

    def __init__(self, port: CyclicPort, peer: Peer) -> None:
        """Stand before a port."""
        self._sync = port.sync
        self._answer = peer.answer
        self.take = port.take
        self.command = port.command
        self.others = port.others
        self.error = port.error

    def sync(self, due_ns: int, look: bool, /) -> int:  # noqa: FBT001  (the protocol's)
        """Send the SYNC, and have it answered."""
        flags = self._sync(due_ns, look)
        if not flags:
            self._answer()
        return flags


class AnsweredBus:
    """A bus whose SYNC is answered; satisfies `Bus` and `CyclicBus`."""

    def __init__(self, bus: Bus, peer: Peer) -> None:
        """Stand before a bus."""
        self._bus = bus
        self._peer = peer
        self.now_ns = bus.now_ns
        self.wait_until = bus.wait_until
        self.close = bus.close

    def send(self, frame: Frame) -> None:
        """Send a frame, and have a SYNC answered."""
        self._bus.send(frame)
        if frame.can_id == cob.SYNC:
            self._peer.answer()

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame."""
        return self._bus.receive(until_ns)

    def open_cyclic(self, cycle: Cycle) -> CyclicPort | None:
        """Return the bus's port, if it has one."""
        port = self._bus.open_cyclic(cycle) if isinstance(self._bus, CyclicBus) else None
        return None if port is None else AnsweredPort(port, self._peer)

    def close_cyclic(self) -> None:
        """Close the port."""
        if isinstance(self._bus, CyclicBus):
            self._bus.close_cyclic()
