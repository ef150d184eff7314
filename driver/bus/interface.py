"""What the rest of torquerig knows of a bus and of time: two small protocols, and the tap that records frames."""

from collections.abc import Callable
from typing import Protocol

from torquerig.driver.wire.frame import Arrival, Frame

Tap = Callable[[int, Frame], None]
"""Is told every frame that passes, with its time on the bus clock [ns]."""


class Clock(Protocol):
    """A monotonic clock in integer nanoseconds."""

    def now_ns(self) -> int:
        """Return the time [ns]; only differences mean something."""
        ...

    def wait_until(self, due_ns: int) -> None:
        """Return once the clock shows `due_ns` or later; at once if it does already."""
        ...


class Bus(Clock, Protocol):
    """A CAN bus, and the clock that its frames are stamped with: real time, or a simulated bus's own.

    A bus may hand back the frames that were sent through it.
    """

    def send(self, frame: Frame) -> None:
        """Hand a frame over for sending, without waiting until it is on the wire.

        Raises:
            BusError: It cannot be sent: the link is down or gone, the send buffer is full, the bus is closed.
            ValueError: It is not a classic CAN frame.
        """
        ...

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame, waiting for it until `until_ns`; None once that time has come.

        Frames that wait already come first, also when `until_ns` is in the past.

        Raises:
            BusError: The link is down or gone, or the bus is closed.
        """
        ...

    def close(self) -> None:
        """Leave the bus; may be called again."""
        ...
