"""Whatever comes over the wire: nothing raises, time goes on, and there is no torque without the enable sequence."""

from __future__ import annotations

import struct

from hypothesis import given, settings
from hypothesis import strategies as st

from torquerig.device_sim.canopen.core import NodeTiming
from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.driver.wire.cia402 import DriveState
from torquerig.driver.wire.frame import Frame

MS = 1_000_000
KNOWN = (0x000, 0x080, 0x081, 0x082, 0x181, 0x200, 0x201, 0x301, 0x381, 0x581, 0x601, 0x701, 0x702, 0x77F)
ENERGISED = {DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT_REACTION_ACTIVE}
INDICES = (*range(0x1000, 0x102A), *range(0x1400, 0x1404), *range(0x1600, 0x1604), *range(0x1800, 0x1804))
INDICES += (*range(0x1A00, 0x1A04), 0x2070, 0x2071, 0x2110, 0x2120, 0x2F00, 0x6007, *range(0x603F, 0x6042))
INDICES += (*range(0x605A, 0x605F), 0x6060, 0x6071, 0x6072, 0x6076, 0x6087, 0x608F, 0x6091, 0x6092, 0x6098, 0x60B2)

raw_frames = st.builds(
    Frame,
    can_id=st.sampled_from(KNOWN) | st.integers(0, 0x7FF),
    data=st.binary(max_size=8),
    remote=st.booleans(),
    extended=st.booleans(),
)
sdo_writes = st.builds(
    lambda specifier, index, subindex, data: Frame(0x601, struct.pack("<BHB4s", specifier, index, subindex, data)),
    st.sampled_from((0x23, 0x2B, 0x2F, 0x22, 0x21, 0x40)),
    st.sampled_from(INDICES),
    st.integers(0, 9),
    st.binary(min_size=4, max_size=4) | st.builds(lambda n: struct.pack("<I", n), st.integers(0, 300)),
)
commands = st.sampled_from([Frame(0x000, data) for data in (b"\x01\x01", b"\x02\x00", b"\x80\x01", b"\x81\x01")])
rpdos = st.builds(
    lambda controlword, torque: Frame(0x201, struct.pack("<Hh", controlword, torque)),
    st.sampled_from((0x00, 0x02, 0x06, 0x07, 0x0F, 0x0F, 0x0F, 0x80, 0x10F)),
    st.integers(-32768, 32767),
)
ENABLING = (Frame(0x000, b"\x01\x01"), *(Frame(0x201, bytes((c, 0, 0xFF, 0x1F))) for c in (0x06, 0x07, 0x0F)))
beginnings = st.sampled_from((ENABLING[:1], ENABLING[:2], ENABLING, ENABLING))
pauses = st.integers(0, MS) | st.integers(0, 60 * MS)
conversations = st.tuples(
    beginnings, st.lists(st.tuples(raw_frames | sdo_writes | rpdos | rpdos | commands, pauses), max_size=30)
)


class Machine:
    """Refuses to go back in time, and knows in which state it got torque."""

    axes = 1

    def __init__(self) -> None:
        self.drive: SimulatedDrive | None = None
        self.latest_ns = 0
        self.demand = 0.0

    def _pass(self, at_ns: int) -> None:
        assert at_ns >= self.latest_ns
        self.latest_ns = at_ns

    def set_torque_demand(self, axis: int, torque: float, at_ns: int) -> None:
        assert axis == 0
        self._pass(at_ns)
        if torque:
            assert self.drive is not None
            assert self.drive.state in ENERGISED
        self.demand = torque

    def motor_angle(self, axis: int, at_ns: int) -> float:
        self._pass(at_ns)
        return 1e-9 * at_ns * (axis + 1)

    def motor_velocity(self, axis: int, at_ns: int) -> float:
        self._pass(at_ns)
        return 1.0 + axis

    def motor_torque(self, axis: int, at_ns: int) -> float:
        self._pass(at_ns)
        return self.demand + axis


def build() -> tuple[SimulatedDrive, Machine]:
    machine = Machine()
    machine.drive = SimulatedDrive(1, 0, machine)
    machine.drive.advance(0)
    return machine.drive, machine


@settings(max_examples=150)
@given(conversations)
def test_no_conversation_raises_or_gives_torque_outside_enabled_states(conversation):
    drive, machine = build()
    beginning, middle = conversation
    now_ns = 0
    for frame, pause_ns in [*((frame, 0) for frame in beginning), *middle]:
        now_ns += pause_ns
        drive.receive(frame, now_ns)
        for emission in drive.take():
            assert len(emission.frame.data) <= 8
            assert emission.node_id == 1
        assert machine.demand == 0.0 or drive.state in ENERGISED
        assert drive.next_event_ns() > now_ns


@settings(max_examples=80)
@given(st.lists(st.tuples(raw_frames | sdo_writes, pauses), min_size=1, max_size=40))
def test_without_controlwords_there_is_never_torque(conversation):
    drive, machine = build()
    drive.receive(ENABLING[0], 0)
    now_ns = 0
    for frame, pause_ns in conversation:
        now_ns += pause_ns
        if frame.can_id not in {0x200, 0x201} and frame.data[1:3] != b"\x40\x60":
            drive.receive(frame, now_ns)
            assert machine.demand == 0.0


def test_every_readable_object_reads_with_the_length_of_its_type(bench):
    for entry in bench.drive.store:
        if entry.readable and entry.codec is not None and (entry.index, entry.subindex > 0) != (0x1003, True):
            assert len(bench.drive.store.read(entry.index, entry.subindex)) == entry.codec.size


def test_the_default_timing_boots_after_a_millisecond(fake_machine):
    drive = SimulatedDrive(7, 0, fake_machine(), power_on_ns=5)
    assert drive.next_event_ns() == 5
    drive.advance(5)
    drive.receive(Frame(0x000, b"\x81\x07"), 10)
    drive.advance(10 + NodeTiming().boot_ns)
    assert [(e.ready_ns, e.frame.can_id) for e in drive.take()] == [(5, 0x707), (10 + NodeTiming().boot_ns, 0x707)]
