"""Sending several frames at once, on buses that can and on those that cannot."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol, runtime_checkable

from torquerig.driver.bus.interface import Bus
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Frame

SendAll = Callable[[Sequence[Frame]], int]
"""See `BatchBus.send_all`."""


@runtime_checkable
class BatchBus(Protocol):
    """What a `Bus` may be able to do besides."""

    def send_all(self, frames: Sequence[Frame]) -> int:
        """Hand frames over for sending, in their order; see `Bus.send`.

        Returns:
            How many were handed over, from the first on: fewer than there are if one could not be.

        Raises:
            BusError: The first of them cannot be sent.
            ValueError: One is not a classic CAN frame.
        """
        ...


def send_all_of(bus: Bus) -> SendAll:
    """Return what sends several frames on a bus: by its own means, or one after the other."""
    return bus.send_all if isinstance(bus, BatchBus) else partial(one_by_one, bus)


def one_by_one(bus: Bus, frames: Sequence[Frame]) -> int:
    """Send frames one after the other; see `BatchBus.send_all`."""
    for count, frame in enumerate(frames):
        try:
            bus.send(frame)
        except BusError:
            if not count:
                raise
            return count
    return len(frames)
