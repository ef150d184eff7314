"""A cycle of two axes, and buses to lead it on, each with a neighbour that plays the drives."""

from __future__ import annotations

import socket
import struct
import time
from types import SimpleNamespace

from torquerig.benchmarks.wire_pair import PairedCanBus, PairedKernelCanBus
from torquerig.benchmarks.wire_places import CAN_FRAME
from torquerig.driver.bus.clock import RealClock
from torquerig.driver.bus.url import open_bus
from torquerig.driver.master.port_cycle import CycleMap
from torquerig.driver.master.scale import AxisScale
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.pdo import PdoField, PdoLayout

PATIENCE_NS = 20 * 10**9  # real time on a shared machine
TPDO = PdoLayout([PdoField(0x6041, 0, "H"), PdoField(0x6064, 0, "i"), PdoField(0x2077, 0, "h")])
RPDO = PdoLayout([PdoField(0x6040, 0, "H"), PdoField(0x2071, 0, "h")])
SCALES = (AxisScale(2e-5, 1, 20670.0, 19528.0, zero=0.25), AxisScale(-2e-5, -1, 20670.0, 19528.0, (-1000, 1000)))
EMERGENCY = Frame(0x081, bytes(8))
LONG_AGO = 0


def two_axes():
    plan = CycleMap(2)
    for axis in range(2):
        plan.answer(0x181 + axis, axis, TPDO, (0, 1, 2), answers=True)
        number = plan.command(0x201 + axis, RPDO.size)
        plan.target(axis, (number, RPDO, 1), (number, RPDO, 0))
    return plan.done([SimpleNamespace(scale=scale) for scale in SCALES])


def answer(axis: int, position: int = 0, torque: int = 0, statusword: int = 0x1237) -> Frame:
    return Frame(0x181 + axis, struct.pack("<Hih", statusword, position, torque))


class PairBench:
    """The kernel CAN's code without the kernel's CAN: a pair of sockets for process data, another for the rest."""

    def __init__(self, tap) -> None:
        ours, self._theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._theirs.settimeout(20.0)
        self.bus = PairedKernelCanBus(PairedCanBus(ours), RealClock(0), tap)

    def say(self, frame: Frame) -> None:
        end = self.bus.process_data() if 0x181 <= frame.can_id <= 0x182 else None
        (end or self._theirs).send(CAN_FRAME.pack(frame.can_id, len(frame.data), frame.data))

    def heard(self, count: int) -> list[Frame]:
        frames = [CAN_FRAME.unpack(self._theirs.recv(16)) for _ in range(count)]
        return [Frame(can_id, data[:length]) for can_id, length, data in frames]

    def close(self) -> None:
        self.bus.close()
        self._theirs.close()


class BusBench:
    """A real bus with a neighbour."""

    def __init__(self, url: str, tap) -> None:
        self.bus = open_bus(url, bitrate=1_000_000, tap=tap, spin_ns=0)
        self.neighbour = open_bus(url, bitrate=1_000_000, spin_ns=0)
        self.say = self.neighbour.send

    def heard(self, count: int) -> list[Frame]:
        arrivals = (self.neighbour.receive(time.monotonic_ns() + PATIENCE_NS) for _ in range(count))
        return [arrival.frame for arrival in arrivals]

    def close(self) -> None:
        self.bus.close()
        self.neighbour.close()


def take_until(port, wanted: int, patience_ns: int = PATIENCE_NS) -> int:
    flags, until_ns = 0, time.monotonic_ns() + patience_ns
    while not flags & wanted and time.monotonic_ns() < until_ns:
        flags |= port.take(until_ns)
    return flags


def count(bench, name: str) -> int:
    return int(bench.cycle.block[name][0])
