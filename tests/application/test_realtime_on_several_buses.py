"""Simulated devices in real time on several buses: each hears its own bus only, and their one time never goes back."""

from __future__ import annotations

from collections import deque

import pytest

from torquerig.device_sim.devices import NEVER_NS, Emission, SimulatedDevices
from torquerig.driver.bus.interface import Bus
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.realtime_several import PlacedBuses, SeveralRealTimeDevices
from torquerig.rejoining import RETRY_NS, RejoiningBus

MS = 1_000_000
SYNC = Frame(0x080)


class Clock:
    now = 0


class ScriptedBus:
    """A bus that brings given frames, on a clock that all buses share."""

    def __init__(self, clock: Clock, *script: tuple[int, Frame]) -> None:
        self.clock = clock
        self.script = deque(script)
        self.sent: list[Frame] = []
        self.full = False

    def now_ns(self) -> int:
        return self.clock.now

    def send(self, frame: Frame) -> None:
        if self.full:
            raise BusError("its send queue is full")
        self.sent.append(frame)

    def receive(self, until_ns: int) -> Arrival | None:
        assert until_ns == 0, "one bus must not be waited for alone"
        if self.script and self.script[0][0] <= self.clock.now:
            return Arrival(*self.script.popleft())
        return None


class Node:
    """Answers SYNC, says hello once, and tells a common list whenever its time moves."""

    def __init__(self, node_id: int, told: list[int], hello_ns: int) -> None:
        self.node_id = node_id
        self.heard: list[Frame] = []
        self._told = told
        self._hello_ns = hello_ns
        self._emissions: list[Emission] = []

    def next_event_ns(self) -> int:
        return self._hello_ns

    def advance(self, to_ns: int) -> None:
        self._told.append(to_ns)
        self._emissions.append(Emission(self._hello_ns, self.node_id, Frame(0x700 + self.node_id, b"\0")))
        self._hello_ns = NEVER_NS

    def receive(self, frame: Frame, at_ns: int) -> None:
        self._told.append(at_ns)
        self.heard.append(frame)
        if frame == SYNC:
            self._emissions.append(Emission(at_ns, self.node_id, Frame(0x180 + self.node_id)))

    def take(self) -> list[Emission]:
        taken, self._emissions = self._emissions, []
        return taken


class Scene:
    def __init__(self, *scripts: list[tuple[int, Frame]]) -> None:
        self.clock, self.told = Clock(), list[int]()
        self.buses: list[Bus] = [ScriptedBus(self.clock, *script) for script in scripts]
        self.nodes = [Node(1, self.told, 2 * MS), Node(2, self.told, 3 * MS), Node(3, self.told, 1 * MS)]
        groups = [SimulatedDevices(self.nodes[:2]), SimulatedDevices(self.nodes[2:])]
        placed = PlacedBuses(self.buses, self.wait)
        self.devices = SeveralRealTimeDevices(placed, placed, groups, wake_ns=0)

    def wait(self, until_ns: int) -> None:
        nearest = [bus.script[0][0] for bus in self.buses if bus.script]
        self.clock.now = min([until_ns, *nearest])

    def sent(self) -> list[list[int]]:
        return [[frame.can_id for frame in bus.sent] for bus in self.buses]


def test_devices_hear_and_answer_on_their_own_bus_only():
    scene = Scene([(4 * MS, SYNC), (5 * MS, Frame(0x201))], [(6 * MS, Frame(0x203))])
    scene.devices.serve(10 * MS)
    assert scene.sent() == [[0x701, 0x702, 0x181, 0x182], [0x703]]
    heard = [[frame.can_id for frame in node.heard] for node in scene.nodes]
    assert heard == [[0x702, 0x080, 0x182, 0x201], [0x701, 0x080, 0x181, 0x201], [0x203]]


def test_the_time_of_all_devices_is_one():
    scene = Scene([(4 * MS, SYNC)], [(3 * MS, Frame(0x203)), (4 * MS, SYNC)])
    scene.clock.now = 0
    scene.devices.serve(10 * MS)
    assert scene.told == sorted(scene.told)
    assert scene.told[:3] == [1 * MS, 2 * MS, 2 * MS]  # node 3's hello; node 1's, which node 2 hears
    assert scene.devices.now_ns == 10 * MS


def test_after_a_stall_frames_of_all_buses_are_taken_by_their_times():
    scene = Scene([(4 * MS, SYNC)], [(5 * MS, SYNC)])
    scene.clock.now = 500 * MS
    scene.devices.serve(10 * MS)
    assert scene.told == sorted(scene.told)
    assert 4 * MS in scene.told
    assert 5 * MS in scene.told


def test_what_one_bus_does_not_take_is_counted_and_the_other_goes_on():
    scene = Scene([(4 * MS, SYNC)], [(4 * MS, SYNC)])
    scene.buses[0].full = True
    scene.devices.serve(10 * MS)
    assert scene.sent() == [[], [0x703, 0x183]]
    assert scene.devices.lost == 4


def test_something_is_done_to_a_device_on_its_bus():
    scene = Scene([], [])
    scene.devices.serve(5 * MS)
    done: list[int] = []
    scene.devices.intervene(3, done.append)
    assert done == [5 * MS]
    with pytest.raises(KeyError):
        scene.devices.intervene(4, done.append)


def test_a_bus_that_is_gone_is_not_tried_at_every_look():
    attempts: list[int] = []

    def join() -> ScriptedBus:
        attempts.append(1)
        if len(attempts) > 1:
            raise BusError("down")
        bus = ScriptedBus(Clock())
        bus.receive = bus.close = lost
        return bus

    def lost(*_args: object) -> None:
        if _args:
            raise BusError("down")

    bus = RejoiningBus(join, lambda _words: None, rest_ns=1000 * RETRY_NS)
    for _ in range(100):
        assert bus.receive(0) is None
    assert len(attempts) == 2
    assert bus.fileno() == -1
