"""A simulated drive on a bench, over a machine that remembers what it was told and stands where the test puts it."""

from __future__ import annotations

import struct
from collections.abc import Callable

import pytest

from torquerig.device_sim.canopen.core import NodeTiming
from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.drive.parameters import DriveParameters
from torquerig.driver.wire.frame import Frame

MS = 1_000_000
SYNC = Frame(0x080)
PROMPT = NodeTiming(boot_ns=MS, answer_ns=0, sample_ns=20_000, reaction_ns=50_000)
SIGNED = {0x2077, 0x6063, 0x6064, 0x606C, 0x6074, 0x6077, 0x6078}
SIZES = {1: 0x2F, 2: 0x2B, 4: 0x23}


class FakeMachine:
    """Torque is there at once; angle and velocity are the test's. Time must not go back."""

    def __init__(self, axes: int = 1) -> None:
        self.axes = axes
        self.angle = [0.0] * axes
        self.velocity = [0.0] * axes
        self.demand = [0.0] * axes
        self.commands: list[tuple[int, int, float]] = []
        self._latest_ns = 0

    def _pass(self, at_ns: int) -> None:
        assert at_ns >= self._latest_ns, f"the machine's time went back from {self._latest_ns} to {at_ns}"
        self._latest_ns = at_ns

    def set_torque_demand(self, axis: int, torque: float, at_ns: int) -> None:
        self._pass(at_ns)
        self.demand[axis] = torque
        self.commands.append((at_ns, axis, torque))

    def motor_angle(self, axis: int, at_ns: int) -> float:
        self._pass(at_ns)
        return self.angle[axis]

    def motor_velocity(self, axis: int, at_ns: int) -> float:
        self._pass(at_ns)
        return self.velocity[axis]

    def motor_torque(self, axis: int, at_ns: int) -> float:
        self._pass(at_ns)
        return self.demand[axis]


class DriveBench:
    """Node 1 on axis 0. `now_ns` is when the next frame is complete; frames that answer are kept in `heard`."""

    def __init__(self, parameters: DriveParameters, machine: FakeMachine) -> None:
        self.machine = machine
        self.drive = SimulatedDrive(1, 0, machine, parameters)
        self.now_ns = 0
        self.heard: list[tuple[int, int, bytes]] = []
        self.wait(0)

    def _take(self) -> None:
        self.heard += [(e.ready_ns, e.frame.can_id, e.frame.data) for e in self.drive.take()]

    def wait(self, until_ns: int) -> None:
        self.now_ns = until_ns
        self.drive.advance(until_ns)
        self._take()

    def hear(self, can_id: int, data: bytes = b"", at_ns: int | None = None) -> None:
        self.now_ns = self.now_ns if at_ns is None else at_ns
        self.drive.receive(Frame(can_id, data), self.now_ns)
        self._take()

    def rpdo(self, controlword: int, torque: int, at_ns: int | None = None) -> None:
        self.hear(0x201, struct.pack("<Hh", controlword, torque), at_ns)

    def sync(self, at_ns: int | None = None) -> tuple[int, int, int]:
        """Return statusword, position and raw torque of the TPDO1 that answers."""
        before = len(self.heard)
        self.hear(0x080, b"", at_ns)
        data = next(data for _, can_id, data in self.heard[before:] if can_id == 0x181)
        return struct.unpack("<Hih", data)

    def sdo(self, index: int, subindex: int, data: bytes) -> int:
        """Write by expedited SDO; return 0 or the abort code."""
        self.hear(0x601, struct.pack("<BHB", SIZES[len(data)], index, subindex) + data.ljust(4, b"\0"))
        answer = self.heard.pop()[2]
        return 0 if answer[0] == 0x60 else int.from_bytes(answer[4:], "little")

    def write(self, index: int, value: int, size: int, subindex: int = 0) -> None:
        assert self.sdo(index, subindex, value.to_bytes(size, "little", signed=value < 0)) == 0

    def start(self) -> None:
        """NMT start, and no heartbeat, so that only what is tested speaks."""
        self.write(0x1017, 0, 2)
        self.hear(0x000, b"\x01\x01")

    def enable(self, torque: int = 0) -> None:
        """Walk to operation enabled by RPDOs of type 255."""
        for controlword in (0x06, 0x07):
            self.rpdo(controlword, 0)
        self.rpdo(0x0F, torque)
        assert self.state == 0x27

    def read(self, index: int, subindex: int = 0) -> int:
        """Read by expedited SDO; with a sign where the EDS has one."""
        self.hear(0x601, struct.pack("<BHBI", 0x40, index, subindex, 0))
        answer = self.heard.pop()[2]
        assert answer[0] & 0xF3 == 0x43, answer
        data = answer[4 : 8 - (answer[0] >> 2 & 3)]
        return int.from_bytes(data, "little", signed=index in SIGNED)

    @property
    def statusword(self) -> int:
        return self.drive.store.get(0x6041)  # not by SDO: also of a stopped node

    @property
    def state(self) -> int:
        """The statusword's state bits 0 to 3, 5 and 6."""
        return self.statusword & 0x6F

    @property
    def emergencies(self) -> list[tuple[int, int]]:
        """When each emergency was ready, and its code."""
        return [(at_ns, int.from_bytes(data[:2], "little")) for at_ns, can_id, data in self.heard if can_id == 0x081]

    @property
    def torque(self) -> float:
        return self.machine.demand[0]


@pytest.fixture
def machine() -> FakeMachine:
    return FakeMachine()


@pytest.fixture
def make_bench(machine: FakeMachine) -> Callable[..., DriveBench]:
    def make(**parameters: object) -> DriveBench:
        return DriveBench(DriveParameters(timing=PROMPT, **parameters), machine)  # type: ignore[arg-type]

    return make


@pytest.fixture
def bench(make_bench: Callable[..., DriveBench]) -> DriveBench:
    bench = make_bench()
    bench.start()
    return bench


@pytest.fixture
def enabled(bench: DriveBench) -> DriveBench:
    bench.enable()
    bench.wait(bench.now_ns + MS)
    return bench


@pytest.fixture
def fake_machine() -> type[FakeMachine]:
    return FakeMachine
