"""Simulated devices in real time when frames do not end: others are still heard, and nothing grows."""

from collections import deque
from dataclasses import dataclass, field

from torquerig.device_sim.devices import NEVER_NS, Emission, SimulatedDevices
from torquerig.driver.bus.echoes import OUTSTANDING, EchoFilter
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.realtime import RealTimeDevices

MS = 1_000_000
STOP = Frame(0x000, b"\x81\x00")


@dataclass
class Bus:
    """A bus on which a frame takes 0.1 ms; STOP comes after a while."""

    now: int = 0
    sent: int = 0
    queue: deque[Arrival] = field(default_factory=lambda: deque([Arrival(5 * MS, STOP)]))

    def now_ns(self) -> int:
        return self.now

    def wait_until(self, due_ns: int) -> None:
        self.now = max(self.now, due_ns)

    def send(self, _frame: Frame) -> None:
        self.sent += 1
        self.now += MS // 10

    def receive(self, until_ns: int) -> Arrival | None:
        if self.queue and self.queue[0].at_ns <= max(until_ns, self.now):
            return self.queue.popleft()
        self.now = max(self.now, until_ns)
        return None

    def close(self) -> None:
        pass


@dataclass
class Parrot:
    """A node that answers whatever it hears, until it is told to stop."""

    node_id: int
    stopped: bool = False
    outbox: list[Emission] = field(default_factory=list)

    def next_event_ns(self) -> int:
        return NEVER_NS

    def advance(self, to_ns: int) -> None:
        pass

    def receive(self, frame: Frame, at_ns: int) -> None:
        self.stopped = self.stopped or frame == STOP
        if not self.stopped:
            self.outbox.append(Emission(at_ns + 20_000, self.node_id, Frame(0x180 + self.node_id, frame.data)))

    def take(self) -> list[Emission]:
        taken, self.outbox = self.outbox, []
        return taken


def test_nodes_that_answer_each_other_for_ever_still_hear_the_bus():
    bus, parrots = Bus(), [Parrot(1), Parrot(2)]
    bus.queue.appendleft(Arrival(1 * MS, Frame(0x080)))
    RealTimeDevices(bus, SimulatedDevices(parrots)).serve(20 * MS)
    assert all(parrot.stopped for parrot in parrots)
    assert bus.sent < 200


def test_what_an_echo_filter_remembers_does_not_grow_with_the_frames():
    echoes = EchoFilter()
    for number in range(5000):
        frame = Frame(0x181, number.to_bytes(4, "little"))
        echoes.sent(frame, number * MS)
        assert echoes.is_echo(Arrival(number * MS, frame))
    assert echoes.outstanding == 0


def test_of_echoes_that_are_lost_only_so_many_are_waited_for():
    echoes = EchoFilter()
    for number in range(20_000):
        frame = Frame(0x181, number.to_bytes(4, "little"))
        echoes.sent(frame, number * MS)
        if number % 10:
            echoes.is_echo(Arrival(number * MS, frame))
    assert 0 < echoes.outstanding <= OUTSTANDING
