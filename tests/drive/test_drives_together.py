"""Three drives under one time: order of events, the sibling stop among them, and what one cycle looks like."""

from __future__ import annotations

import struct

import pytest

from torquerig.device_sim.devices import NEVER_NS, SimulatedDevices
from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.driver.wire.frame import Frame

MS = 1_000_000
IDS = (1, 2, 3)


class Rig:
    """Three drives whose own frames the siblings hear at once."""

    def __init__(self, machine) -> None:
        self.machine = machine
        self.drives = {n: SimulatedDrive(n, n - 1, machine) for n in IDS}
        self.devices = SimulatedDevices(self.drives.values())
        self.heard: list[tuple[int, int, bytes]] = []
        self.advance(0)

    def advance(self, to_ns: int) -> None:
        while (due_ns := self.devices.next_event_ns()) <= to_ns:
            self._spread(self.devices.advance(due_ns))

    def hear(self, can_id: int, data: bytes, at_ns: int) -> None:
        self.advance(at_ns)
        self._spread(self.devices.receive(Frame(can_id, data), at_ns))

    def _spread(self, emissions) -> None:
        for emission in emissions:
            self.heard.append((emission.ready_ns, emission.frame.can_id, emission.frame.data))
            self._spread(self.devices.receive(emission.frame, emission.ready_ns, emission.node_id))

    def write(self, node_id: int, index: int, subindex: int, value: int, size: int, at_ns: int) -> None:
        head = struct.pack("<BHB", {1: 0x2F, 2: 0x2B, 4: 0x23}[size], index, subindex)
        self.hear(0x600 + node_id, head + value.to_bytes(4, "little"), at_ns)

    def emergencies(self) -> list[tuple[int, int, int]]:
        return [
            (at_ns, can_id - 0x80, int.from_bytes(data[:2], "little"))
            for at_ns, can_id, data in self.heard
            if 0x81 <= can_id <= 0x83
        ]


@pytest.fixture
def rig(fake_machine):
    """All three in operation enabled at 5 ms with 0.1 N·m and more, watching each other's emergencies."""
    rig = Rig(fake_machine(3))
    for n in IDS:
        for k, sibling in enumerate(i for i in IDS if i != n):
            rig.write(n, 0x1028, k + 1, 0x80 + sibling, 4, MS)
        rig.write(n, 0x1400, 5, 12, 2, 2 * MS)
    rig.hear(0x000, b"\x01\x00", 3 * MS)
    for controlword in (0x06, 0x07, 0x0F):
        for n in IDS:
            rig.hear(0x200 + n, struct.pack("<Hh", controlword, 2067 * n), 4 * MS)
    rig.advance(5 * MS)
    assert rig.machine.demand == [0.1, 0.2, 0.3]
    rig.heard.clear()
    return rig


def test_one_cycle_is_three_tpdos_for_a_sync(rig):
    rig.hear(0x080, b"", 6 * MS)
    assert [(at_ns, can_id) for at_ns, can_id, _ in rig.heard] == [(6 * MS + 20_000, 0x180 + n) for n in IDS]


def test_a_fault_of_one_drive_takes_the_torque_of_all_in_the_instant_its_emergency_is_heard(rig):
    rig.write(2, 0x2F00, 0, 1, 4, 7 * MS)
    assert rig.machine.demand == [0.0, 0.0, 0.0]
    assert rig.emergencies() == [(7 * MS, 2, 0x2310), (7 * MS, 1, 0xFF01), (7 * MS, 3, 0xFF01)]


def test_drives_that_all_miss_their_rpdos_tell_it_themselves_or_stop_with_the_first(rig):
    rig.advance(100 * MS)
    assert rig.machine.demand == [0.0, 0.0, 0.0]
    assert {(at_ns, node_id) for at_ns, node_id, _ in rig.emergencies()} == {(16 * MS, n) for n in IDS}
    assert {code for _, _, code in rig.emergencies()} <= {0x8250, 0xFF01}


def test_after_a_sibling_stop_each_drive_resets_without_latching_the_others(rig):
    rig.write(2, 0x2F00, 0, 1, 4, 7 * MS)
    for controlword in (0x00, 0x80, 0x06, 0x07, 0x0F):
        for n in IDS:
            rig.hear(0x200 + n, struct.pack("<Hh", controlword, 0), 8 * MS)
    assert [rig.drives[n].store.get(0x6041) & 0x6F for n in IDS] == [0x27, 0x27, 0x27]


def test_events_of_all_nodes_happen_in_the_order_of_their_times(rig):
    """The machine refuses to go back in time; ramps of three drives interleave on it."""
    for n, at_ns in ((1, 6 * MS), (2, 6 * MS + 33_000), (3, 6 * MS + 66_000)):
        rig.hear(0x200 + n, struct.pack("<Hh", 0x02, 0), at_ns)
    rig.advance(40 * MS)
    assert rig.machine.demand == [0.0, 0.0, 0.0]
    times = [at_ns for at_ns, _, _ in rig.machine.commands]
    assert times == sorted(times)


def test_node_ids_must_differ(fake_machine):
    machine = fake_machine(2)
    with pytest.raises(ValueError, match="node-ids must differ"):
        SimulatedDevices([SimulatedDrive(1, 0, machine), SimulatedDrive(1, 1, machine)])


def test_a_drive_needs_an_axis_of_its_machine(fake_machine):
    with pytest.raises(ValueError, match="a machine with 2 axes has no axis 2"):
        SimulatedDrive(1, 2, fake_machine(2))


def test_no_devices_have_no_events():
    devices = SimulatedDevices([])
    assert devices.next_event_ns() == NEVER_NS
    assert devices.advance(MS) == []
    assert devices.receive(Frame(0x080), MS) == []


def test_serial_numbers_differ(rig):
    assert [rig.drives[n].store.get(0x1018, 4) for n in IDS] == [1, 2, 3]
