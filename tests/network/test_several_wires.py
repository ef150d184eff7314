"""Several simulated wires in one time: each does what it would do alone, and none runs ahead of another."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.device_sim.wires import SimulatedWires
from torquerig.driver.bus.lockstep import LockstepBus
from torquerig.driver.bus.several import SeveralBuses
from torquerig.driver.wire.frame import Frame

MS = 1_000_000
BIT_RATE = 1_000_000
CYCLES = 30
Log = list[tuple[int, Frame]]


def network(nodes, log: Log) -> SimulatedNetwork:
    return SimulatedNetwork(SimulatedDevices(nodes), BIT_RATE, lambda at_ns, frame: log.append((at_ns, frame)))


def cycles(wire, node_ids) -> None:
    """What a master does: SYNC, the answers, commands, each millisecond."""
    for cycle in range(CYCLES):
        due_ns = (cycle + 1) * MS
        while wire.run_until(due_ns) is not None:
            pass
        wire.submit(Frame(0x080))
        for _ in node_ids:
            wire.run_until(due_ns + MS // 2)
        for node_id in node_ids:
            wire.submit(Frame(0x200 + node_id, cycle.to_bytes(4, "little")))


def test_a_wire_among_others_does_to_the_nanosecond_what_it_does_alone(drive):
    alone: Log = []
    among: Log = []
    cycles(network([drive(1, 7 * MS), drive(2, 777_777)], alone), (1, 2))
    other = network([drive(3, 333_333), drive(4, 1_000_001)], [])
    wires = SimulatedWires([other, network([drive(1, 7 * MS), drive(2, 777_777)], among)])
    cycles(wires.ends[1], (1, 2))
    assert among == alone
    assert len(alone) > 4 * CYCLES


def test_one_wire_as_several_is_the_lockstep_bus(drive):
    logs: list[Log] = [[], []]
    nodes = [[drive(node_id, 5 * MS) for node_id in (1, 2, 3)] for _ in logs]
    wires = SimulatedWires([network(nodes[1], logs[1])])
    several = SeveralBuses([LockstepBus(wires.ends[0])], {1: 0, 2: 0, 3: 0}, wires.advance)
    for bus in (LockstepBus(network(nodes[0], logs[0])), several):
        for cycle in range(CYCLES):
            due_ns = (cycle + 1) * MS
            while bus.receive(due_ns) is not None:
                pass
            assert bus.now_ns() == due_ns
            bus.send(Frame(0x080))
            while (arrival := bus.receive(due_ns + MS // 2)) is not None:
                bus.send(Frame(arrival.frame.can_id + 0x80, bytes(4)))
        bus.close()
    assert logs[1] == logs[0]


class Clockwork:
    """A node whose events are told to a common list, as those of drives reach a common machine."""

    def __init__(self, node_id: int, times: list[int], told: list[int]) -> None:
        self.node_id = node_id
        self._times = sorted(times)
        self._told = told

    def next_event_ns(self) -> int:
        return self._times[0] if self._times else 1 << 62

    def advance(self, to_ns: int) -> None:
        while self._times and self._times[0] <= to_ns:
            self._told.append(self._times.pop(0))

    def receive(self, _frame: Frame, at_ns: int) -> None:
        self._told.append(at_ns)

    def take(self) -> list:
        return []


@given(st.lists(st.lists(st.integers(1, 2 * MS), max_size=12), min_size=2, max_size=3), st.integers(1, 2 * MS))
def test_what_happens_on_all_wires_happens_in_the_order_of_time(times, sent_ns):
    told: list[int] = []
    networks = [network([Clockwork(place + 1, each, told)], []) for place, each in enumerate(times)]
    wires = SimulatedWires(networks)
    wires.advance(sent_ns)
    for end in wires.ends:
        end.submit(Frame(0x080))
    assert not wires.advance(3 * MS)
    assert told == sorted(told)
    assert len(told) == sum(map(len, times)) + len(times)


def test_a_sync_is_heard_at_one_instant_on_all_wires(drive):
    drives = [drive(node_id) for node_id in (1, 2, 3)]
    wires = SimulatedWires([network([each], []) for each in drives])
    several = SeveralBuses([LockstepBus(end) for end in wires.ends], {1: 0, 2: 1, 3: 2}, wires.advance)
    several.wait_until(MS)
    several.send(Frame(0x080))
    answers = [several.receive(2 * MS) for _ in drives]
    assert {each.heard[0] for each in drives} == {(MS + 55_000, Frame(0x080))}
    assert {arrival.at_ns for arrival in answers} == {MS + 55_000 + 135_000}
    assert several.now_ns() == MS + 190_000
    assert several.receive(2 * MS) is None


def test_something_done_to_a_device_happens_now(drive):
    nodes = [drive(1), drive(2)]
    wires = SimulatedWires([network([node], []) for node in nodes])
    wires.advance(5 * MS)
    done: list[int] = []
    wires.ends[1].intervene(2, done.append)
    assert done == [5 * MS]
    with pytest.raises(KeyError):
        wires.ends[1].intervene(1, done.append)
