"""Simulated devices in real time on several buses: groups that hear only their own bus, and turn one machine."""

from collections.abc import Callable, Mapping, Sequence
from itertools import takewhile

from torquerig.device_sim.arbitration import Waiting
from torquerig.device_sim.devices import Emission, SimulatedDevices
from torquerig.driver.bus.batches import send_all_of
from torquerig.driver.bus.echoes import EchoFilter
from torquerig.driver.bus.interface import Bus
from torquerig.driver.bus.merged import MergedReception, Wait
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.realtime import WAKE_NS, RealTimeDevices


class DeviceGroups:
    """The devices of several buses under one time, since the machine that they turn has one."""

    def __init__(self, groups: Sequence[SimulatedDevices]) -> None:
        """Take the devices on each bus, not advanced yet."""
        self._groups = tuple(groups)
        self.places: Mapping[int, int] = {node: place for place, group in enumerate(groups) for node in group.nodes}

    def next_event_ns(self) -> int:
        """When something happens next on any bus without a frame."""
        return min([group.next_event_ns() for group in self._groups])

    def advance(self, to_ns: int) -> list[Emission]:
        """Let everything happen that is due at or before the time, on all buses in the order of the events."""
        emissions: list[Emission] = []
        while (due_ns := self.next_event_ns()) <= to_ns:
            for group in self._groups:
                emissions += group.advance(due_ns)
        return emissions

    def intervene(self, node_id: int, at_ns: int, act: Callable[[int], None]) -> list[Emission]:
        """Do something to a node that no frame does; see `SimulatedDevices.intervene`."""
        emissions = self.advance(at_ns)
        if node_id not in self.places:
            raise KeyError(node_id)
        return emissions + self._groups[self.places[node_id]].intervene(node_id, at_ns, act)

    def hear(self, place: int, frame: Frame, at_ns: int) -> list[Emission]:
        """Let the nodes of one bus hear a frame from outside."""
        return self.advance(at_ns) + self._groups[place].receive(frame, at_ns)

    def receive(self, frame: Frame, at_ns: int, sender: int | None = None) -> list[Emission]:
        """Let the nodes on the bus of a node hear what it sends; without a sender, the nodes on every bus."""
        emissions = self.advance(at_ns)
        for group in self._groups if sender is None else (self._groups[self.places[sender]],):
            emissions += group.receive(frame, at_ns, sender)
        return emissions


class PlacedBuses:
    """Several buses as one to the devices on them, who say on which they send and are told on which they hear.

    It satisfies `Bus`.

    Attributes:
        heard_on: The place of the bus that the last frame came from.
        send_on: The place of the bus that the next frame goes to.
    """

    def __init__(self, members: Sequence[Bus], wait: Wait) -> None:
        """Join buses in real time; `close` closes them all.

        Args:
            members: The buses.
            wait: Waits for all of them at once.
        """
        self.heard_on = 0
        self.send_on = 0
        self._members = tuple(members)
        self._sends = tuple(send_all_of(member) for member in members)
        self._merged = MergedReception(members, wait)

    def now_ns(self) -> int:
        """Return the time of all the buses [ns]."""
        return self._members[0].now_ns()

    def wait_until(self, due_ns: int) -> None:
        """Wait without looking at the buses."""
        self._members[0].wait_until(due_ns)

    def send(self, frame: Frame) -> None:
        """Hand a frame over to the bus at `send_on`; see `Bus.send`."""
        self._members[self.send_on].send(frame)

    def send_all(self, frames: Sequence[Frame]) -> int:
        """Hand frames over to the bus at `send_on`; see `BatchBus`."""
        return self._sends[self.send_on](frames)

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame, which came from the bus at `heard_on`; see `Bus.receive`."""
        heard = self._merged.receive(until_ns)
        if heard is None:
            return None
        self.heard_on, arrival = heard
        return arrival

    def close(self) -> None:
        """Leave all buses; may be called again."""
        for member in self._members:
            member.close()


class SeveralRealTimeDevices(RealTimeDevices):
    """Simulated devices as members of several buses."""

    def __init__(
        self, bus: Bus, buses: PlacedBuses, groups: Sequence[SimulatedDevices], wake_ns: int = WAKE_NS
    ) -> None:
        """Join the devices to their buses; their time 0 is now.

        Args:
            bus: What frames are sent to and received from: `buses`, or what stands before them.
            buses: The buses.
            groups: The devices on each, not advanced yet.
            wake_ns: As for `RealTimeDevices` [ns].
        """
        self._groups = DeviceGroups(groups)
        super().__init__(bus, self._groups, wake_ns)
        self._placed = buses
        self._echoes_of = tuple(EchoFilter() for _ in groups)

    def _heard(self, until_ns: int) -> bool:
        arrival = self._bus.receive(until_ns)
        if arrival is None:
            return False
        place = self._placed.heard_on
        if not self._echoes_of[place].is_echo(arrival):
            self._latest_ns = max(self._latest_ns, arrival.at_ns - self._origin_ns)
            self._queue(self._groups.hear(place, arrival.frame, self._latest_ns))
        return True

    def _send(self, ready: Sequence[Waiting]) -> int:
        place = self._placed.send_on = self._groups.places[ready[0].node_id]
        batch = list(takewhile(lambda waiting: self._groups.places[waiting.node_id] == place, ready))
        return self._send_batch(batch, self._echoes_of[place])
