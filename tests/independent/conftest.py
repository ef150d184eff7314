"""The simulated drives as other people's programs meet them: a process of its own on a bus."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import can
import pytest

PATIENCE_S = 20.0  # real time on a shared machine: order and content are asserted, never speed


@dataclass(frozen=True)
class Simulator:
    """A running `torquerig sim` and the folder that is its bus."""

    folder: Path
    process: subprocess.Popen[bytes]

    def open(self) -> can.BusABC:
        """Return a new member of the bus, opened by python-can alone."""
        return can.Bus(interface="unix", channel=str(self.folder))


@pytest.fixture(scope="session")
def simulator_process() -> Iterator[Simulator]:
    with tempfile.TemporaryDirectory(prefix="rig-") as name:
        folder = Path(name) / "bus"
        with can.Bus(interface="unix", channel=str(folder)) as listener:
            process = subprocess.Popen(
                [sys.executable, "-m", "torquerig", "sim", "--bus", f"unix:{folder}"],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
            )
            try:
                await_boot_ups(listener, process)
                yield Simulator(folder, process)
            finally:
                process.terminate()
                _, errors = process.communicate(timeout=PATIENCE_S)
        assert b"Traceback" not in errors, errors.decode()


@pytest.fixture
def simulator(simulator_process: Simulator) -> Simulator:
    """Return the simulator with every node reset: its objects have their power-on values."""
    with simulator_process.open() as bus:
        bus.send(can.Message(arbitration_id=0x000, is_extended_id=False, data=b"\x81\x00"))
        await_boot_ups(bus, simulator_process.process)
    return simulator_process


def await_boot_ups(bus: can.BusABC, process: subprocess.Popen[bytes]) -> None:
    """Wait until nodes 1 to 3 said their boot-up message: COB-ID 0x700 + node-id, one byte 0 (CiA 301, 7.2.8.3.3)."""
    missing = {0x701, 0x702, 0x703}
    while missing:
        message = bus.recv(PATIENCE_S)
        assert message is not None, f"no boot-up of {missing}; the simulator's exit status: {process.poll()}"
        if message.data == b"\x00":
            missing.discard(message.arbitration_id)
