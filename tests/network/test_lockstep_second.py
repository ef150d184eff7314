"""The first promise of all: simulated time is exact, and every run is the same."""

from __future__ import annotations

import hashlib

import can
import pytest

from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.driver.bus.lockstep import LockstepBus
from torquerig.driver.wire.frame import Frame

PERIOD_NS = 4_000_000
SECOND_NS = 1_000_000_000


def one_second(drive) -> list[tuple[int, Frame]]:
    """Return what passes in a second: SYNC, three TPDOs, three RPDOs each 4 ms, three heartbeats each 50 ms."""
    log: list[tuple[int, Frame]] = []
    drives = [drive(node_id, period_ns=50_000_000) for node_id in (1, 2, 3)]
    network = SimulatedNetwork(SimulatedDevices(drives), 1_000_000)
    bus = LockstepBus(network, lambda at_ns, frame: log.append((at_ns, frame)))
    due_ns = bus.now_ns()
    while due_ns < SECOND_NS:
        bus.send(Frame(0x080))
        missing = {0x181, 0x182, 0x183}
        while missing:
            arrival = bus.receive(due_ns + PERIOD_NS // 2)
            assert arrival is not None
            missing.discard(arrival.frame.can_id)
        for node_id in (1, 2, 3):
            bus.send(Frame(0x200 + node_id, due_ns.to_bytes(4, "little")))
        due_ns += PERIOD_NS
        bus.wait_until(due_ns)
    assert bus.now_ns() == SECOND_NS
    bus.close()
    return log


def as_candump(log: list[tuple[int, Frame]]) -> bytes:
    lines = (f"({at_ns // 10**9}.{at_ns % 10**9:09d}) can0 {f.can_id:03X}#{f.data.hex().upper()}\n" for at_ns, f in log)
    return "".join(lines).encode()


def test_one_lockstep_second_is_exactly_250_syncs(drive):
    log = one_second(drive)
    syncs = [at_ns for at_ns, frame in log if frame.can_id == 0x080]
    assert len(syncs) == 250
    # A heartbeat that is on the wire when SYNC is due holds it up; here they begin where SYNC does, and lose to it.
    assert syncs == [k * PERIOD_NS + 55_000 for k in range(250)]


def test_the_log_of_a_lockstep_second_has_the_same_bytes_twice(drive):
    first, second = as_candump(one_second(drive)), as_candump(one_second(drive))
    assert first == second
    assert len(first.splitlines()) == 250 * 7 + 3 * 19  # the 20th heartbeat is due when the second is over
    assert hashlib.sha256(first).hexdigest() == hashlib.sha256(second).hexdigest()


def test_an_unmodified_python_can_program_runs_in_lockstep(drive):
    network = SimulatedNetwork(SimulatedDevices([drive(1), drive(2)]), 1_000_000)
    stamps = []
    with LockstepBus(network) as bus:
        for _ in range(250):
            bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
            while (message := bus.recv(0.002)) is not None:
                stamps.append((message.timestamp, message.arbitration_id))
    assert [can_id for _, can_id in stamps] == [0x181, 0x182] * 250
    assert [t for t, _ in stamps[:2]] == [190e-6, 325e-6]
    assert stamps[-1][0] == pytest.approx(249 * 2.325e-3 + 325e-6, abs=1e-12)


def test_the_wire_load_of_the_protocols_cycle_is_745_bits(drive):
    drives = [drive(node_id) for node_id in (1, 2, 3)]
    network = SimulatedNetwork(SimulatedDevices(drives), 1_000_000)
    bus = LockstepBus(network)
    bus.send(Frame(0x080))
    for _ in drives:
        bus.receive(PERIOD_NS)
    for node_id in (1, 2, 3):
        bus.send(Frame(0x200 + node_id, bytes(4)))
    bus.wait_until(PERIOD_NS)
    bus.close()
    assert network.statistics.frames == 7
    assert network.statistics.bits == 745
    assert network.statistics.busy_ns == 745_000
    assert network.statistics.busy_ns / network.now_ns() == pytest.approx(0.186, abs=5e-4)
