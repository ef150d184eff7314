"""The program that an adapter is plugged into, and a bus served while a test plays that program."""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from torquerig.assembly import build_simulation
from torquerig.configuration import load_configuration
from torquerig.driver.bus.slcan import SlcanBus
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.realtime import RealTimeDevices

PATIENCE_NS = 20 * 10**9
PATIENCE_S = 20.0


class Host:
    """A program that has the port open and knows it as a file, no more."""

    def __init__(self, port: Path | str) -> None:
        self.descriptor = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def say(self, data: bytes) -> None:
        assert os.write(self.descriptor, data) == len(data)

    def hear(self, length: int, serve: Callable[[], object]) -> bytes:
        """Return so many bytes, with the bus served meanwhile."""
        heard = b""
        until = time.monotonic() + PATIENCE_S
        while len(heard) < length:
            assert time.monotonic() < until, f"of {length} bytes came {heard!r}"
            serve()
            with suppress(BlockingIOError):
                heard += os.read(self.descriptor, length - len(heard))
        return heard

    def leave(self) -> None:
        os.close(self.descriptor)


def look(bus: SlcanBus) -> Arrival | None:
    """Return what the bus has by now."""
    return bus.receive(bus.now_ns() + 2_000_000)


def miss(bus: SlcanBus) -> None:
    """Look until the bus has noticed that the host is gone: on a busy machine one look may be over before it began."""
    until_ns = bus.now_ns() + PATIENCE_NS
    while bus.connected:
        assert look(bus) is None
        assert bus.now_ns() < until_ns


def take(bus: SlcanBus, count: int) -> list[Frame]:
    """Return the next frames, waiting for them."""
    arrivals = [bus.receive(bus.now_ns() + PATIENCE_NS) for _ in range(count)]
    return [arrival.frame for arrival in arrivals if arrival is not None]


@contextmanager
def repeated(step: Callable[[], object]) -> Iterator[None]:
    """Have something done by a thread over and over; what it works on is the thread's alone meanwhile."""
    done = threading.Event()

    def run() -> None:
        while not done.is_set():
            step()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


@contextmanager
def served(bus: SlcanBus) -> Iterator[list[Frame]]:
    """Have the bus served; yield the list to which the frames go that come."""
    heard: list[Frame] = []

    def serve() -> None:
        arrival = look(bus)
        if arrival is not None:
            heard.append(arrival.frame)

    with repeated(serve):
        yield heard


@contextmanager
def simulated_drives(bus: SlcanBus) -> Iterator[None]:
    """Have the three simulated drives of the shipped configuration live on the bus."""
    devices = RealTimeDevices(bus, build_simulation(load_configuration().rig, None).devices)
    with repeated(lambda: devices.step(bus.now_ns() - devices.origin_ns + 2_000_000)):
        yield
