"""What is done to simulated devices from outside their bus, on a bus and with a node made for the purpose."""

from __future__ import annotations

from collections import deque

from torquerig.device_sim.devices import NEVER_NS, Emission, SimulatedDevices
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.realtime import RealTimeDevices

MS = 1_000_000
HELLO, FAREWELL = Frame(0x701, b"\x00"), Frame(0x081, bytes(8))


class Node:
    """A node that says farewell at its deadline."""

    node_id = 1

    def __init__(self, deadline_ns: int = NEVER_NS) -> None:
        self.deadline_ns = deadline_ns
        self.heard: list[tuple[int, Frame]] = []
        self._outbox: list[Emission] = []

    def say(self, frame: Frame, at_ns: int) -> None:
        self._outbox.append(Emission(at_ns, 1, frame))

    def next_event_ns(self) -> int:
        return self.deadline_ns

    def advance(self, to_ns: int) -> None:
        if self.deadline_ns <= to_ns:
            self.say(FAREWELL, self.deadline_ns)
            self.deadline_ns = NEVER_NS

    def receive(self, frame: Frame, at_ns: int) -> None:
        self.heard.append((at_ns, frame))

    def take(self) -> list[Emission]:
        taken, self._outbox = self._outbox, []
        return taken


class Bus:
    """A bus whose clock moves when somebody waits, or is set."""

    def __init__(self) -> None:
        self.now = 1000 * MS
        self.sent: list[Frame] = []
        self.queue: deque[Arrival] = deque()

    def now_ns(self) -> int:
        return self.now

    def wait_until(self, due_ns: int) -> None:
        self.now = max(self.now, due_ns)

    def send(self, frame: Frame) -> None:
        self.sent.append(frame)

    def receive(self, until_ns: int) -> Arrival | None:
        if self.queue:
            return self.queue.popleft()
        self.wait_until(until_ns)
        return None

    def close(self) -> None:
        """Nothing is open."""


def test_an_intervention_comes_after_all_that_was_due_before_it():
    node = Node(deadline_ns=3 * MS)
    said = SimulatedDevices([node]).intervene(1, 5 * MS, lambda at_ns: node.say(HELLO, at_ns))
    assert said == [Emission(3 * MS, 1, FAREWELL), Emission(5 * MS, 1, HELLO)]


def test_what_an_intervention_makes_a_node_say_is_on_the_real_bus_at_once():
    node, bus = Node(), Bus()
    devices = RealTimeDevices(bus, SimulatedDevices([node]))
    devices.serve(2 * MS)
    devices.intervene(1, lambda at_ns: node.say(HELLO, at_ns))
    assert (devices.now_ns, bus.sent) == (2 * MS, [HELLO])


def test_what_an_intervention_makes_a_node_say_takes_part_in_simulated_arbitration():
    node = Node()
    network = SimulatedNetwork(SimulatedDevices([node]), 1_000_000)
    network.run_until(2 * MS)
    network.intervene(1, lambda at_ns: node.say(HELLO, at_ns))
    arrival = network.run_until(3 * MS)
    assert arrival is not None
    assert arrival.frame == HELLO
    assert 2 * MS < arrival.at_ns < 2.1 * MS


def test_time_that_stands_still_is_no_time_for_the_devices():
    node, bus = Node(deadline_ns=3 * MS), Bus()
    devices = RealTimeDevices(bus, SimulatedDevices([node]))
    devices.serve(2 * MS)
    with devices.standing_still():
        bus.now += 500 * MS
        bus.queue.append(Arrival(bus.now - 100 * MS, HELLO))
    devices.step(2 * MS + 1)
    assert node.heard == [(2 * MS, HELLO)]
    assert devices.origin_ns == 1500 * MS
    devices.serve(3 * MS - 1)
    assert bus.sent == []
    devices.serve(3 * MS)
    assert bus.sent == [FAREWELL]
    assert bus.now == 1503 * MS
