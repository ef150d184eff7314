"""Simulated devices in real time: the same core that lockstep advances, on any bus between processes.

The devices' time is the bus clock less an origin. It never runs ahead of a frame that waits: after a stall the queued
frames are taken by the times at which they were complete, so that no watchdog trips for want of a frame that is there.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Final, Protocol

from torquerig.device_sim.arbitration import SendQueues, Waiting
from torquerig.device_sim.devices import Emission
from torquerig.driver.bus.batches import send_all_of
from torquerig.driver.bus.echoes import EchoFilter
from torquerig.driver.bus.interface import Bus
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Frame

WAKE_NS: Final = 200_000
"""A little more than a process takes to wake up. Events in the devices happen at their exact times however late they
are computed, so those of this span are computed together; a frame that is ready within it goes out at once."""


class Devices(Protocol):
    """Simulated devices under one time, as `SimulatedDevices` are."""

    def next_event_ns(self) -> int:
        """When something happens next without a frame."""
        ...

    def advance(self, to_ns: int) -> list[Emission]:
        """Let everything happen that is due at or before the time."""
        ...

    def intervene(self, node_id: int, at_ns: int, act: Callable[[int], None]) -> list[Emission]:
        """Do something to a node that no frame does."""
        ...

    def receive(self, frame: Frame, at_ns: int, sender: int | None = None) -> list[Emission]:
        """Let every node but the sender hear a frame."""
        ...


class RealTimeDevices:
    """Simulated devices as members of a bus.

    Attributes:
        lost: Frames that the bus did not take, as when the link is down for a while, or that found no room to wait.
    """

    def __init__(self, bus: Bus, devices: Devices, wake_ns: int = WAKE_NS) -> None:
        """Join the devices to a bus; their time 0 is now.

        Args:
            bus: The bus, which must be in real time.
            devices: The devices, not advanced yet.
            wake_ns: How long after an event in the devices it is computed at the latest, and how much sooner than
                ready a frame may go out [ns].
        """
        self._bus = bus
        self._send_all = send_all_of(bus)
        self._wake_ns = wake_ns
        self._devices = devices
        self._queues = SendQueues()
        self._echoes = EchoFilter()
        self._origin_ns = bus.now_ns()
        self._latest_ns = 0
        self.lost = 0

    @property
    def origin_ns(self) -> int:
        """What the devices' time 0 is on the bus clock."""
        return self._origin_ns

    @property
    def now_ns(self) -> int:
        """How far the devices' time has come [ns]."""
        return self._latest_ns

    def intervene(self, node_id: int, act: Callable[[int], None]) -> None:
        """Do something to a device now that no frame does; see `SimulatedDevices.intervene`."""
        self._queue(self._devices.intervene(node_id, self._latest_ns, act))
        self._send_ready()

    @contextmanager
    def standing_still(self) -> Iterator[None]:
        """Let the devices' time stand still while what is inside goes on.

        Yields:
            Nothing. Frames that come meanwhile are heard at the instant of standing still.
        """
        since_ns = self._bus.now_ns()
        try:
            yield
        finally:
            self._origin_ns += self._bus.now_ns() - since_ns

    def serve(self, until_ns: int) -> None:
        """Let the devices live until a time.

        Args:
            until_ns: The devices' time to return at.

        Raises:
            BusError: The bus is gone.
        """
        while self._latest_ns < until_ns:
            self.step(until_ns)

    def step(self, until_ns: int) -> None:
        """Take the next frame, or let happen and send what is due next.

        Args:
            until_ns: The devices' time to wait until at most.

        Raises:
            BusError: The bus is gone.
        """
        due_ns = min(until_ns, self._devices.next_event_ns() + self._wake_ns, self._queues.ready_ns())
        if not self._heard(self._origin_ns + due_ns):
            # the frames that came before due_ns are all taken; what came since is next, so time goes no further
            self._latest_ns = max(self._latest_ns, due_ns)
            self._queue(self._devices.advance(self._latest_ns))
        if self._queues.ready_ns() <= self._latest_ns + self._wake_ns:
            self._send_ready()

    def _heard(self, until_ns: int) -> bool:
        """Take the next frame; False when none came until a time of the bus."""
        arrival = self._bus.receive(until_ns)
        if arrival is None:
            return False
        if not self._echoes.is_echo(arrival):
            # at its own time, or now if the devices are further already
            self._latest_ns = max(self._latest_ns, arrival.at_ns - self._origin_ns)
            self._queue(self._devices.receive(arrival.frame, self._latest_ns))
        return True

    def _queue(self, emissions: list[Emission]) -> None:
        """Put what the devices want to send into their send queues."""
        for emission in emissions:
            self.lost += not self._queues.put(emission.node_id, emission.frame, emission.ready_ns)

    def _send_ready(self) -> None:
        """Send what is ready, by arbitration; the siblings of a sender hear it too.

        All that is ready goes out before any sibling hears it, and what they answer waits until the bus has been looked
        at: drives that answer each other for ever must not keep the others from being heard.
        """
        queues, soon_ns = self._queues, self._latest_ns + self._wake_ns
        ready: list[Waiting] = []
        while queues and queues.ready_ns() <= soon_ns:
            ready.append(queues.take(soon_ns))
        while ready:
            try:
                ready = ready[self._send(ready) :]
            except BusError:
                self.lost += 1  # as a real drive's frame is when nobody acknowledges it
                del ready[0]

    def _send(self, ready: Sequence[Waiting]) -> int:
        """Send frames, or the first few of them; how many a bus took.

        Raises:
            BusError: It took none.
        """
        return self._send_batch(ready, self._echoes)

    def _send_batch(self, batch: Sequence[Waiting], echoes: EchoFilter) -> int:
        """Send frames to a bus, and to the siblings of their senders; how many the bus took, from the first on."""
        count = self._send_all([waiting.frame for waiting in batch])
        for waiting in batch[:count]:
            echoes.sent(waiting.frame, self._origin_ns + self._latest_ns)
            self._queue(self._devices.receive(waiting.frame, self._latest_ns, waiting.node_id))
        return count
