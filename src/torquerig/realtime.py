"""Simulated devices in real time: the same core that lockstep advances, on any bus between processes.

The devices' time is the bus clock less an origin. It never runs ahead of a frame that waits: after a stall the queued
frames are taken by the times at which they were complete, so that no watchdog trips for want of a frame that is there.
"""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from torquerig.device_sim.arbitration import SendQueues
from torquerig.device_sim.devices import Emission, SimulatedDevices
from torquerig.driver.bus.interface import Bus
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Arrival, Frame

ECHO_PATIENCE_NS: Final = 100_000_000
"""A bus that gives own frames back does so within this time of the first one."""

WAKE_NS: Final = 200_000
"""A little more than a process takes to wake up. Events in the devices happen at their exact times however late they
are computed, so those of this span are computed together; a frame that is ready within it goes out at once."""

OUTSTANDING: Final = 512
"""So many own frames at most are waited for: a bus that loses some must not make the memory grow."""


class EchoFilter:
    """Tells own frames that a bus gives back from frames of others.

    Whether a bus does is learnt from the first frame sent; until then both are possible.
    """

    def __init__(self) -> None:
        """Know nothing yet."""
        self._outstanding: deque[Frame] = deque(maxlen=OUTSTANDING)
        self._decide_by_ns: int | None = None
        self._decided = False
        self._echoes = False

    @property
    def outstanding(self) -> int:
        """How many own frames may still come back."""
        return len(self._outstanding)

    def sent(self, frame: Frame, now_ns: int) -> None:
        """Take note of an own frame."""
        if self._decide_by_ns is None:
            self._decide_by_ns = now_ns + ECHO_PATIENCE_NS
        if self._echoes or not self._decided:
            self._outstanding.append(frame)

    def is_echo(self, arrival: Arrival) -> bool:
        """Whether a frame that arrived is an own one that comes back."""
        if not self._decided and self._decide_by_ns is not None and arrival.at_ns > self._decide_by_ns:
            self._decided = True
            self._outstanding.clear()
        try:
            self._outstanding.remove(arrival.frame)
        except ValueError:
            return False
        self._echoes = self._decided = True
        return True


class RealTimeDevices:
    """Simulated devices as members of a bus.

    Attributes:
        lost: Frames that the bus did not take, as when the link is down for a while, or that found no room to wait.
    """

    def __init__(self, bus: Bus, devices: SimulatedDevices, wake_ns: int = WAKE_NS) -> None:
        """Join the devices to a bus; their time 0 is now.

        Args:
            bus: The bus, which must be in real time.
            devices: The devices, not advanced yet.
            wake_ns: How long after an event in the devices it is computed at the latest, and how much sooner than
                ready a frame may go out [ns].
        """
        self._bus = bus
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
        arrival = self._bus.receive(self._origin_ns + due_ns)
        if arrival is None:
            # the frames that came before due_ns are all taken; what came since is next, so time goes no further
            self._latest_ns = max(self._latest_ns, due_ns)
            self._queue(self._devices.advance(self._latest_ns))
        elif not self._echoes.is_echo(arrival):
            self._hear(arrival)
        self._send_ready()

    def _hear(self, arrival: Arrival) -> None:
        """Give a frame to the devices at its own time, or now if they are further already."""
        self._latest_ns = max(self._latest_ns, arrival.at_ns - self._origin_ns)
        self._queue(self._devices.receive(arrival.frame, self._latest_ns))

    def _queue(self, emissions: list[Emission]) -> None:
        """Put what the devices want to send into their send queues."""
        for emission in emissions:
            self.lost += not self._queues.put(emission.node_id, emission.frame, emission.ready_ns)

    def _send_ready(self) -> None:
        """Send what is ready, by arbitration; the siblings of a sender hear it too.

        What they answer waits until the bus has been looked at: drives that answer each other for ever must not keep
        the others from being heard.
        """
        soon_ns = self._latest_ns + self._wake_ns
        for _ in range(len(self._queues)):
            if self._queues.ready_ns() > soon_ns:
                break
            waiting = self._queues.take(soon_ns)
            try:
                self._bus.send(waiting.frame)
            except BusError:
                self.lost += 1  # as a real drive's frame is when nobody acknowledges it
                continue
            self._echoes.sent(waiting.frame, self._origin_ns + self._latest_ns)
            self._queue(self._devices.receive(waiting.frame, self._latest_ns, waiting.node_id))
