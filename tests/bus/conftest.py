"""A bus of every kind with two neighbours on it, so that one suite can ask the same of all."""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from torquerig.device_sim.devices import NEVER_NS, Emission, SimulatedDevices
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.driver.bus.interface import Bus
from torquerig.driver.bus.url import open_bus
from torquerig.driver.wire.frame import Frame

sys.path.insert(0, str(Path(__file__).parent))  # cyclic_bench

PATIENCE_NS = 20 * 10**9  # real time on a shared machine: order and content are asserted, never speed
_numbers = itertools.count()


class LockstepNeighbour:
    """A node of the simulated wire that says what it is told to say."""

    def __init__(self, node_id: int) -> None:
        self.node_id = node_id
        self.heard: list[Frame] = []
        self._says: list[Emission] = []
        self._emissions: list[Emission] = []

    def say(self, at_ns: int, frame: Frame) -> None:
        self._says.append(Emission(at_ns, self.node_id, frame))

    def next_event_ns(self) -> int:
        return self._says[0].ready_ns if self._says else NEVER_NS

    def advance(self, to_ns: int) -> None:
        while self._says and self._says[0].ready_ns <= to_ns:
            self._emissions.append(self._says.pop(0))

    def receive(self, frame: Frame, at_ns: int) -> None:  # noqa: ARG002 - the protocol's
        self.heard.append(frame)

    def take(self) -> list[Emission]:
        taken, self._emissions = self._emissions, []
        return taken


class LockstepBench:
    """The lockstep bus and two nodes of its wire."""

    echoes = False

    def __init__(self) -> None:
        self._nodes = [LockstepNeighbour(1), LockstepNeighbour(2)]
        self.log: list[tuple[int, Frame]] = []
        self.bus: Bus = open_bus(
            "lockstep:",
            bitrate=1_000_000,
            tap=lambda at_ns, frame: self.log.append((at_ns, frame)),
            wire=lambda: SimulatedNetwork(SimulatedDevices(self._nodes), 1_000_000),
        )
        self.python_can: can.BusABC = self.bus

    def say(self, neighbour: int, frame: Frame) -> None:
        self._nodes[neighbour].say(self.bus.now_ns(), frame)

    def heard(self, neighbour: int, count: int) -> list[Frame]:
        self.bus.wait_until(self.bus.now_ns() + count * 200_000)
        return self._nodes[neighbour].heard

    def close(self) -> None:
        self.bus.close()


class RealTimeBench:
    """A real-time bus and two more members of it."""

    def __init__(self, url: str, *, echoes: bool = False) -> None:
        self.echoes = echoes
        self.log: list[tuple[int, Frame]] = []
        self.bus: Bus = open_bus(url, bitrate=1_000_000, tap=lambda at_ns, frame: self.log.append((at_ns, frame)))
        self.python_can: can.BusABC = self.bus._bus
        self._neighbours = [open_bus(url, bitrate=1_000_000) for _ in range(2)]

    def say(self, neighbour: int, frame: Frame) -> None:
        self._neighbours[neighbour].send(frame)

    def heard(self, neighbour: int, count: int) -> list[Frame]:
        arrivals = (self._neighbours[neighbour].receive(time.monotonic_ns() + PATIENCE_NS) for _ in range(count))
        return [arrival.frame for arrival in arrivals]

    def close(self) -> None:
        for bus in (self.bus, *self._neighbours):
            bus.close()


URLS = {
    "unix": "unix:{folder}",
    "virtual": "virtual:bench-{number}",
    "udp_multicast": "udp_multicast:239.74.163.2",
    "socketcan": "socketcan:vcan0",
}


@pytest.fixture(
    params=["lockstep", "unix", "virtual", "udp_multicast", pytest.param("socketcan", marks=pytest.mark.vcan)]
)
def bench(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[LockstepBench | RealTimeBench]:
    kind = request.param
    if kind == "lockstep":
        bench = LockstepBench()
    else:
        url = URLS[kind].format(folder=tmp_path / "bus", number=next(_numbers))
        bench = RealTimeBench(url, echoes=kind == "udp_multicast")
    yield bench
    bench.close()
