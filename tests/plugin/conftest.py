"""Rigs in one process that is kept, because starting it takes seconds, and a master made of bytes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import can
import pytest

from torquerig.rig_process import RigProcess
from torquerig.simulated_rig import SimulatedRig

PATIENCE_S = 20.0  # real time on a shared machine: order and content are asserted, never speed


@pytest.fixture(scope="session")
def process() -> Iterator[RigProcess]:
    process = RigProcess()
    yield process
    process.close()


@pytest.fixture
def rig(process) -> Iterator[SimulatedRig]:
    with SimulatedRig(process=process) as rig:
        yield rig


class Master:
    """A CANopen master typed from CiA 301: NMT, expedited SDO, RPDO1."""

    def __init__(self, bus: can.BusABC) -> None:
        self.bus = bus

    def send(self, can_id: int, data: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=can_id, is_extended_id=False, data=data))

    def hear(self, can_id: int, begin: bytes = b"") -> bytes:
        """Return the data of the next frame with this identifier that begins so."""
        give_up = time.monotonic() + PATIENCE_S
        while time.monotonic() < give_up:
            message = self.bus.recv(PATIENCE_S)
            if message is not None and message.arbitration_id == can_id and bytes(message.data).startswith(begin):
                return bytes(message.data)
        raise AssertionError(f"no frame {can_id:03X} {begin.hex()}")

    def read(self, node_id: int, index: int, subindex: int = 0) -> int:
        multiplexer = index.to_bytes(2, "little") + bytes([subindex])
        self.send(0x600 + node_id, b"\x40" + multiplexer + bytes(4))
        answer = self.hear(0x580 + node_id)
        assert answer[1:4] == multiplexer
        assert answer[0] & 0xE3 == 0x43
        return int.from_bytes(answer[4 : 8 - (answer[0] >> 2 & 3)], "little")

    def write(self, node_id: int, index: int, value: int, size: int) -> None:
        multiplexer = index.to_bytes(2, "little") + b"\x00"
        self.send(0x600 + node_id, bytes([0x23 | 4 - size << 2]) + multiplexer + value.to_bytes(4, "little"))
        assert self.hear(0x580 + node_id) == b"\x60" + multiplexer + bytes(4)

    def enable(self, node_id: int, torque: int = 0) -> None:
        """Walk a drive to operation enabled by RPDO1 and let it push [counts], without watchdogs."""
        self.send(0x000, bytes([1, node_id]))
        for controlword in (0x06, 0x07, 0x0F):
            self.push(node_id, torque if controlword == 0x0F else 0, controlword)

    def push(self, node_id: int, torque: int, controlword: int = 0x0F) -> None:
        self.send(0x200 + node_id, controlword.to_bytes(2, "little") + torque.to_bytes(2, "little", signed=True))


@pytest.fixture(scope="session")
def master_of() -> Callable[[SimulatedRig], Master]:
    return lambda rig: Master(rig.bus)


@pytest.fixture
def master(rig, master_of) -> Master:
    return master_of(rig)


@pytest.fixture(scope="session")
def await_true() -> Callable[[Callable[[], bool], str], None]:
    """Return what waits until something is so."""

    def wait(condition: Callable[[], bool], what: str) -> None:
        give_up = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < give_up, f"waited in vain until {what}"
            time.sleep(0.02)

    return wait
