"""Where conversations are held: the kernel's vcan, the unix bus, and a simulated wire in virtual time."""

import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

import can
from conversation import Telegram

from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.device_sim.plant import BareRotor, RotorParameters

PATIENCE_S: Final = 30.0  # real time on a shared machine: order and content are asserted, never speed
NS: Final = 1_000_000_000
LONGEST_FRAME_NS: Final = 200_000
BITRATE: Final = 1_000_000
STICKY: Final = RotorParameters(inertia=0.01, coulomb=0.05, breakaway=0.07)


@dataclass(frozen=True)
class Station:
    """A running `torquerig sim`, and how python-can joins its bus."""

    interface: str
    channel: str

    def open(self) -> can.BusABC:
        """Return a new member of the bus."""
        return can.Bus(interface=self.interface, channel=self.channel)


class RealLine:
    """A member of a real-time bus; python-can alone knows which."""

    patience_s = PATIENCE_S

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus

    def now_s(self) -> float:
        """Return the time on this line."""
        return time.monotonic()

    def say(self, text: str) -> None:
        """Send a frame."""
        frame = Telegram.parse(text)
        kind = {"arbitration_id": frame.can_id, "is_extended_id": frame.extended, "is_remote_frame": frame.remote}
        content = {"dlc": len(frame.data)} if frame.remote else {"data": frame.data}
        self._bus.send(can.Message(**kind, **content))

    def hear(self, until_s: float) -> str | None:
        """Return the next frame, or None when there was none until then."""
        message = self._bus.recv(max(0.0, until_s - time.monotonic()))
        if message is None:
            return None
        return str(Telegram(message.arbitration_id, bytes(message.data), extended=message.is_extended_id))


class WireLine:
    """The master's end of a simulated wire: waiting is what makes its time pass.

    A frame is said when the next one may be: else both would wait together, and the lower identifier go first.
    """

    patience_s = 1.0

    def __init__(self) -> None:
        rotors = BareRotor(STICKY, axes=3)
        drives = [SimulatedDrive(node_id, node_id - 1, rotors) for node_id in (1, 2, 3)]
        self._passed: list[object] = []
        self._heard: deque[str] = deque()
        self._wire = SimulatedNetwork(
            SimulatedDevices(drives), BITRATE, lambda _at_ns, frame: self._passed.append(frame)
        )

    def now_s(self) -> float:
        """Return the time on this line."""
        return self._wire.now_ns() / NS

    def say(self, text: str) -> None:
        """Send a frame."""
        frame = Telegram.parse(text)
        self._passed.clear()
        self._wire.submit(frame)
        while not any(passed is frame for passed in self._passed):
            heard = self._next(self._wire.now_ns() + LONGEST_FRAME_NS)
            if heard is not None:
                self._heard.append(heard)

    def hear(self, until_s: float) -> str | None:
        """Return the next frame, or None when there was none until then."""
        return self._heard.popleft() if self._heard else self._next(int(until_s * NS))

    def overhear(self) -> None:
        """Let pass what is still to be said of earlier conversations."""
        while self._next(self._wire.now_ns() + NS // 1000) is not None:
            pass
        self._heard.clear()

    def _next(self, until_ns: int) -> str | None:
        arrival = self._wire.run_until(until_ns)
        return None if arrival is None else str(Telegram(arrival.frame.can_id, arrival.frame.data))


@contextmanager
def running(interface: str, channel: str) -> Iterator[Station]:
    """Run the simulated drives as a process of their own, from their boot-up messages on."""
    with can.Bus(interface=interface, channel=channel) as listener:
        process = subprocess.Popen(
            [sys.executable, "-m", "torquerig", "sim", "--bus", f"{interface}:{channel}"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        )
        try:
            _await_boot_ups(listener, process)
        except BaseException:
            process.kill()
            process.communicate()
            raise
    try:
        yield Station(interface, channel)
    finally:
        process.terminate()
        _, errors = process.communicate(timeout=PATIENCE_S)
    assert b"Traceback" not in errors, errors.decode()


def _await_boot_ups(bus: can.BusABC, process: subprocess.Popen[bytes]) -> None:
    """Wait until nodes 1 to 3 said their boot-up message: COB-ID 0x700 + node-id, one byte 0 (CiA 301, 7.2.8.3.3)."""
    missing = {0x701, 0x702, 0x703}
    while missing:
        message = bus.recv(PATIENCE_S)
        assert message is not None, f"no boot-up of {missing}; the simulator's exit status: {process.poll()}"
        if message.data == b"\x00":
            missing.discard(message.arbitration_id)
