"""Steady operation, compiled, is what the drives do frame by frame: the same frames, torques and objects."""

from __future__ import annotations

import random
import struct
from collections import deque
from collections.abc import Sequence

import pytest

from torquerig.assembly import build_simulation
from torquerig.configuration import load_configuration
from torquerig.device_sim import devices
from torquerig.device_sim.canopen import tpdo
from torquerig.device_sim.drive import Injection, SimulatedDrive, objects, protection, steady_memory, torque_drive
from torquerig.device_sim.drive.steady import SteadyDrives
from torquerig.device_sim.plant import TruthLog
from torquerig.device_sim.plant.logged import LoggedMachine
from torquerig.driver.wire import cob, nmt
from torquerig.driver.wire.cia402 import DriveState
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.driver.wire.nmt import NmtCommand, NmtState

US, MS = 1_000, 1_000_000
PERIOD = MS
FIRST = 20 * MS
SYNC = Frame(cob.SYNC)
RPDO = struct.Struct("<Hh")
OPERATE, HALT = 0x0F, 0x10F
HEARTBEAT = nmt.encode_heartbeat(127, NmtState.OPERATIONAL)
SILENCE = 30 * MS  # longer than any watchdog waits


def write(node: int, index: int, subindex: int, value: int, size: int) -> Frame:
    head = struct.pack("<BHB", {1: 0x2F, 2: 0x2B, 4: 0x23}[size], index, subindex)
    return Frame(cob.SDO_REQUEST + node, head + value.to_bytes(4, "little"))


class Rig:
    """The shipped rig's drives, which hear frames one by one."""

    def __init__(self, plant: str = "fitted") -> None:
        simulated = load_configuration(None, {"simulator.plant": plant}, origin="test").simulated
        self.truth = TruthLog()
        simulation = build_simulation(simulated, self.truth)
        assert isinstance(simulation.machine, LoggedMachine)
        self.machine, self.devices = simulation.machine, simulation.devices
        self.drives = [node for node in self.devices.nodes.values() if isinstance(node, SimulatedDrive)]
        self.said: list[Frame] = []

    def hear(self, arrivals: Sequence[Arrival]) -> None:
        for arrival in arrivals:
            Rig.pass_until(self, arrival.at_ns)  # what was said before goes out before
            self.say(self.devices.receive(arrival.frame, arrival.at_ns), arrival.at_ns)

    def pass_until(self, to_ns: int) -> None:
        while (due_ns := self.devices.next_event_ns()) <= to_ns:
            self.say(self.devices.advance(due_ns), due_ns)

    def say(self, emissions: Sequence[devices.Emission], at_ns: int) -> None:
        """Let siblings hear what a drive says, the more urgent first."""
        for emission in sorted(emissions, key=lambda emission: emission.frame.can_id):
            self.said.append(emission.frame)
            self.say(self.devices.receive(emission.frame, at_ns, emission.node_id), at_ns)

    def everything(self) -> list[object]:
        """All that anybody can know of the drives and the machine."""
        parts: list[object] = [self.machine.position.tolist(), self.machine.velocity.tolist()]  # type: ignore[attr-defined]
        for drive in self.drives:
            kept = [value for slot, value in enumerate(drive.store.values) if slot not in drive.store.sources]
            parts += [kept, drive.state, drive.torque_demand, drive.counters(), drive.timers.dues]
            parts += [drive.sync.count, drive.sync.last_ns, [rpdo.received for rpdo in drive.pdos.rpdos]]
            parts += [drive.behind.lend(), drive.behind.command.pending]
        return [*parts, *(column.tolist() for column in self.truth.rows())]


class SteadyRig(Rig):
    """The same, which takes what is regular as steady operation, a few frames at a time."""

    def __init__(self, plant: str = "fitted", *, luck: random.Random, run: int = 12) -> None:
        super().__init__(plant)
        self._luck, self._run = luck, run
        self._steady = SteadyDrives(self.drives, self.machine)
        self._now_ns = 0
        self.borrowed = 0

    def hear(self, arrivals: Sequence[Arrival]) -> None:
        left = deque(arrivals)
        while left:
            if self._steady.borrow(self._now_ns):
                self.borrowed += 1
                for _ in range(self._luck.randint(1, self._run)):
                    if not left or not self._hear_steadily(left[0]):
                        break
                    left.popleft()
                self._now_ns = self._steady.give_back()
            if left:
                super().hear([left[0]])
                self._now_ns = left.popleft().at_ns

    def _hear_steadily(self, arrival: Arrival) -> bool:
        regular = self._steady.receive(arrival.frame, arrival.at_ns)
        self.said += self._steady.take()
        return regular

    def pass_until(self, to_ns: int) -> None:
        if self._steady.borrow(self._now_ns):
            self._steady.advance(to_ns)
            self.said += self._steady.take()
            self._steady.give_back()
        super().pass_until(to_ns)
        self._now_ns = to_ns


def session(rng: random.Random, cycles: int, amplitude: int, *, gaps: float = 0.03, odd: float = 0.01) -> list[Arrival]:
    """Start, enable and drive with all sorts of targets, and now and then what is not regular."""
    script = [Arrival(FIRST, nmt.encode_command(NmtCommand.START, 0)), Arrival(FIRST, HEARTBEAT)]
    due_ns = FIRST + PERIOD
    for node in (1, 2, 3):
        watched = (127 << 16 | 200, (node % 3 + 1) << 16 | 20)  # the master, and a sibling
        settings = (0x1006, 0, PERIOD // US, 4), (0x2120, 1, 5, 1), (0x1400, 5, 20, 2), (0x1017, 0, 7, 2)
        settings += tuple((0x1016, number + 1, entry, 4) for number, entry in enumerate(watched))
        script += [Arrival(FIRST, write(node, *setting)) for setting in settings]
    for cycle in range(cycles):
        controlword = (6, 7, OPERATE)[min(cycle // 2, 2)]
        if rng.random() > gaps:
            script.append(Arrival(due_ns, SYNC if rng.random() > odd else Frame(cob.SYNC, b"\1")))
        for node in (1, 2, 3):
            counts = rng.randint(-amplitude, amplitude) if controlword == OPERATE else 0
            word = HALT if controlword == OPERATE and rng.random() < odd else controlword
            frame = Frame(cob.RPDO[1] + node, RPDO.pack(word, counts))
            script.append(Arrival(due_ns + rng.randint(100, 600) * US, frame))
        if rng.random() < 10 * odd:
            slower, short = write(1, 0x6087, 0, 5000, 4), Frame(0x201, b"\x0f")
            strange = rng.choice([HEARTBEAT, HEARTBEAT, Frame(0x123, b"foreign"), slower, short])
            script.append(Arrival(due_ns + 700 * US, strange))
        due_ns += PERIOD
    return sorted(script, key=lambda arrival: arrival.at_ns)


def both(script: Sequence[Arrival], *, seed: int, plant: str = "fitted", run: int = 12) -> tuple[Rig, SteadyRig]:
    """The script on both rigs."""
    plain, steady = Rig(plant), SteadyRig(plant, luck=random.Random(seed), run=run)
    for rig in (plain, steady):
        rig.pass_until(FIRST - MS)
        rig.hear(script)
        rig.pass_until(script[-1].at_ns + SILENCE)
    return plain, steady


def assert_same(plain: Rig, steady: Rig) -> None:
    assert steady.said == plain.said
    for ours, theirs in zip(steady.everything(), plain.everything(), strict=True):
        assert ours == theirs


@pytest.mark.parametrize("seed", range(4))
def test_it_says_and_does_what_drives_do_frame_by_frame(seed: int) -> None:
    plain, steady = both(session(random.Random(seed), 250, 3000), seed=seed)
    assert_same(plain, steady)
    assert steady.borrowed > 100


@pytest.mark.parametrize("seed", range(2))
def test_limits_and_overloads_are_met_as_they_are_frame_by_frame(seed: int) -> None:
    plain, steady = both(session(random.Random(seed), 300, 9000), seed=seed)
    assert_same(plain, steady)
    assert steady.borrowed > 10
    assert {drive.state for drive in steady.drives} == {DriveState.FAULT}  # SILENCE, if nothing before


def test_missing_syncs_are_counted_and_end_operation_as_they_do_frame_by_frame() -> None:
    plain, steady = both(session(random.Random(3), 200, 3000, gaps=0.3), seed=3)
    assert_same(plain, steady)
    assert steady.drives[0].store.get(*objects.MISSED_SYNCS) > 10


def test_heartbeats_and_calm_looks_do_not_end_steady_operation() -> None:
    script = session(random.Random(11), 200, 3000, gaps=0.0, odd=0.0)
    script += [Arrival(FIRST + 20 * MS + k * 10 * MS + 700 * US, HEARTBEAT) for k in range(15)]
    plain, steady = both(sorted(script, key=lambda arrival: arrival.at_ns), seed=11, run=1000)
    assert_same(plain, steady)
    assert len([frame for frame in steady.said if frame.can_id == cob.HEARTBEAT + 1]) > 20
    assert steady.borrowed < 20


def test_what_a_look_finds_ends_steady_operation() -> None:
    script = session(random.Random(12), 200, 3000, gaps=0.0, odd=0.0)
    heat = write(2, 0x2F00, 0, Injection.MOTOR_TEMPERATURE, 4)
    plain, steady = both([*script[:500], Arrival(script[500].at_ns, heat), *script[500:]], seed=12, run=1000)
    assert_same(plain, steady)
    assert steady.drives[1].state is DriveState.FAULT


def test_more_targets_at_once_than_there_is_room_for_are_taken_frame_by_frame() -> None:
    script = session(random.Random(13), 100, 3000, gaps=0.0, odd=0.0)
    at_ns = script[-1].at_ns
    flood = [
        Arrival(at_ns, Frame(cob.RPDO[1] + 2, RPDO.pack(OPERATE, 50 * k))) for k in range(2 * steady_memory.WAITING)
    ]
    after = [Arrival(at_ns + 20 * US, SYNC), Arrival(at_ns + MS, SYNC)]
    plain, steady = both([*script, *flood, *after], seed=13)
    assert_same(plain, steady)


def test_a_slow_tpdo_asks_for_its_temperatures() -> None:
    plain, steady = both(session(random.Random(5), 100, 3000, gaps=0.0), seed=5)
    slow = [frame for frame in steady.said if frame.can_id == cob.TPDO[2] + 1]
    assert len(slow) > 5
    assert slow == [frame for frame in plain.said if frame.can_id == cob.TPDO[2] + 1]


def test_gears_that_give_are_turned_alike() -> None:
    plain, steady = both(session(random.Random(7), 60, 3000), seed=7, plant="fit5")
    assert_same(plain, steady)
    assert steady.borrowed > 20


def test_a_drive_that_is_not_steady_is_not_borrowed() -> None:
    rig = SteadyRig(luck=random.Random(0))
    rig.pass_until(FIRST - MS)
    rig.hear(session(random.Random(0), 3, 0))
    assert rig.borrowed == 0


@pytest.mark.parametrize(
    ("here", "there"),
    [
        (steady_memory.NEVER_NS, devices.NEVER_NS),
        (steady_memory.CONSTANT, tpdo.CONSTANT),
        (steady_memory.TRIP_LOAD, protection.TRIP_LOAD),
        (steady_memory.LATENCY_MAXIMUM, torque_drive.LATENCY_MAXIMUM),
    ],
)
def test_compiled_code_knows_the_same_constants(here: float, there: float) -> None:
    assert here == there
