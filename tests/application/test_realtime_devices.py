"""Simulated devices in real time, on a bus and with devices that are made for the purpose: no clock is read."""

from collections import deque
from dataclasses import dataclass, field

import pytest

from torquerig.device_sim.devices import NEVER_NS, Emission, SimulatedDevices
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.realtime import RealTimeDevices

MS = 1_000_000
COMMAND = Frame(0x201, bytes(4))
ORIGIN_NS = 1_000 * MS


@dataclass
class Bus:
    """A bus whose clock moves when somebody waits; `stall_ns` is what each look at it takes more than it should."""

    now: int = ORIGIN_NS
    stall_ns: int = 0
    echoes: bool = False
    broken: bool = False
    queue: deque[Arrival] = field(default_factory=deque)
    sent: list[tuple[int, Frame]] = field(default_factory=list)

    def now_ns(self) -> int:
        return self.now

    def wait_until(self, due_ns: int) -> None:
        self.now = max(self.now, due_ns)

    def send(self, frame: Frame) -> None:
        if self.broken:
            raise BusError("nobody acknowledges")
        self.sent.append((self.now - ORIGIN_NS, frame))
        if self.echoes:
            self.queue.append(Arrival(self.now, frame))

    def receive(self, until_ns: int) -> Arrival | None:
        self.now += self.stall_ns
        if self.queue and self.queue[0].at_ns <= max(until_ns, self.now):
            self.now = max(self.now, self.queue[0].at_ns)
            return self.queue.popleft()
        self.now = max(self.now, until_ns)
        return None

    def close(self) -> None:
        pass


@dataclass
class Node:
    """A node that wants a frame every 3 ms at least, and says when it missed one."""

    node_id: int
    deadline_ns: int = NEVER_NS
    heard: list[tuple[int, Frame]] = field(default_factory=list)
    outbox: list[Emission] = field(default_factory=list)

    def next_event_ns(self) -> int:
        return self.deadline_ns

    def advance(self, to_ns: int) -> None:
        if self.deadline_ns <= to_ns:
            self.outbox.append(Emission(self.deadline_ns, self.node_id, Frame(0x080 + self.node_id, bytes(8))))
            self.deadline_ns = NEVER_NS

    def receive(self, frame: Frame, at_ns: int) -> None:
        self.heard.append((at_ns, frame))
        if frame == COMMAND:
            self.deadline_ns = at_ns + 3 * MS

    def take(self) -> list[Emission]:
        taken, self.outbox = self.outbox, []
        return taken


def serve(bus: Bus, nodes: list[Node], until_ns: int, wake_ns: int = 0) -> RealTimeDevices:
    devices = RealTimeDevices(bus, SimulatedDevices(nodes), wake_ns)
    devices.serve(until_ns)
    return devices


def test_a_frame_is_heard_at_the_time_at_which_it_was_complete():
    bus, node = Bus(), Node(1)
    bus.queue.append(Arrival(ORIGIN_NS + 5 * MS, COMMAND))
    serve(bus, [node], 6 * MS)
    assert node.heard == [(5 * MS, COMMAND)]


def test_after_a_stall_waiting_frames_are_heard_before_time_goes_on():
    bus, node = Bus(stall_ns=50 * MS), Node(1)
    bus.queue.extend(Arrival(ORIGIN_NS + number * 2 * MS, COMMAND) for number in range(1, 11))
    serve(bus, [node], 22 * MS)
    assert [at_ns for at_ns, _ in node.heard] == [number * 2 * MS for number in range(1, 11)]
    assert bus.sent == []


def test_a_frame_that_never_came_is_missed_at_its_time():
    bus, node = Bus(), Node(1)
    bus.queue.append(Arrival(ORIGIN_NS + 2 * MS, COMMAND))
    serve(bus, [node], 9 * MS)
    assert bus.sent == [(5 * MS, Frame(0x081, bytes(8)))]


def test_an_event_that_is_computed_late_still_comes_before_a_later_frame():
    bus, node = Bus(), Node(1)
    bus.queue.extend(Arrival(ORIGIN_NS + at_ns, COMMAND) for at_ns in (2 * MS, 5 * MS + MS // 10))
    serve(bus, [node], 6 * MS, wake_ns=MS // 5)
    assert node.heard == [(2 * MS, COMMAND), (5 * MS + MS // 10, COMMAND)]
    assert bus.sent == [(5 * MS + MS // 10, Frame(0x081, bytes(8)))]


def test_a_frame_in_time_is_in_time_however_late_it_is_looked_at():
    bus, node = Bus(), Node(1)
    bus.queue.extend(Arrival(ORIGIN_NS + at_ns, COMMAND) for at_ns in (2 * MS, 5 * MS - 1))
    serve(bus, [node], 6 * MS, wake_ns=MS // 5)
    assert bus.sent == []


def test_a_frame_goes_out_within_the_wake_up_time_of_its_event():
    bus = Bus()
    serve(bus, [Node(1, deadline_ns=4 * MS)], 9 * MS, wake_ns=MS // 5)
    assert bus.sent == [(4 * MS + MS // 5, Frame(0x081, bytes(8)))]


def test_time_never_runs_backwards_when_a_frame_comes_with_an_old_stamp():
    bus, node = Bus(), Node(1)
    devices = serve(bus, [node], 9 * MS)
    bus.queue.append(Arrival(ORIGIN_NS + 2 * MS, COMMAND))
    devices.serve(10 * MS)
    assert node.heard == [(9 * MS, COMMAND)]


def test_siblings_hear_what_a_node_sends_and_the_node_does_not():
    bus, nodes = Bus(), [Node(1, deadline_ns=4 * MS), Node(2)]
    serve(bus, nodes, 5 * MS)
    assert nodes[0].heard == []
    assert nodes[1].heard == [(4 * MS, Frame(0x081, bytes(8)))]


def test_a_frame_is_sent_when_it_is_ready_and_by_arbitration():
    bus = Bus()
    nodes = [Node(2, deadline_ns=4 * MS), Node(1, deadline_ns=4 * MS), Node(3, deadline_ns=6 * MS)]
    serve(bus, nodes, 7 * MS)
    assert [(at_ns, frame.can_id) for at_ns, frame in bus.sent] == [(4 * MS, 0x081), (4 * MS, 0x082), (6 * MS, 0x083)]


def test_own_frames_that_the_bus_gives_back_are_not_heard_again():
    bus, nodes = Bus(echoes=True), [Node(1, deadline_ns=4 * MS), Node(2)]
    bus.queue.append(Arrival(ORIGIN_NS + 1 * MS, Frame(0x080)))
    serve(bus, nodes, 300 * MS)
    assert nodes[0].heard == [(1 * MS, Frame(0x080))]
    assert nodes[1].heard == [(1 * MS, Frame(0x080)), (4 * MS, Frame(0x081, bytes(8)))]


def test_on_a_bus_without_echo_a_frame_like_an_own_one_is_heard():
    bus, nodes = Bus(), [Node(1, deadline_ns=4 * MS), Node(2)]
    twin = Frame(0x081, bytes(8))
    bus.queue.append(Arrival(ORIGIN_NS + 500 * MS, twin))
    serve(bus, nodes, 501 * MS)
    assert nodes[0].heard == [(500 * MS, twin)]


def test_a_frame_that_the_bus_does_not_take_is_counted():
    bus = Bus(broken=True)
    assert serve(bus, [Node(1, deadline_ns=4 * MS)], 5 * MS).lost == 1


@pytest.mark.parametrize("stall_ns", [0, MS, 7 * MS])
def test_stalls_change_nothing_of_what_the_nodes_hear(stall_ns):
    bus, node = Bus(stall_ns=stall_ns), Node(1)
    bus.queue.extend(Arrival(ORIGIN_NS + number * MS, COMMAND) for number in range(1, 20))
    serve(bus, [node], 25 * MS)
    assert [at_ns for at_ns, _ in node.heard] == [number * MS for number in range(1, 20)]
    assert [frame.can_id for _, frame in bus.sent] == [0x081]
