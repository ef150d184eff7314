"""A bus that may go and come back, for those who outlive it: a drive does not end because its cable is pulled."""

from collections.abc import Callable, Sequence
from typing import Final

from torquerig.driver.bus.batches import send_all_of
from torquerig.driver.bus.clock import RealClock
from torquerig.driver.bus.interface import Bus
from torquerig.driver.bus.merged import Waitable
from torquerig.driver.errors import BusError, LinkLost, TorqueRigError
from torquerig.driver.wire.frame import Arrival, Frame

RETRY_NS: Final = 100_000_000
"""How often to look whether the bus is back."""


class RejoiningBus:
    """A bus in real time that is joined again whenever it was lost; satisfies `Bus`.

    While it is gone, sending fails and receiving brings nothing, but both in time.
    """

    def __init__(self, join: Callable[[], Bus], tell: Callable[[str], None], *, rest_ns: int = 0) -> None:
        """Join the bus.

        Args:
            join: Opens the bus; in real time, so that every one it opens has the same clock.
            tell: Is told in a sentence when the bus goes and when it is back.
            rest_ns: How long after a vain attempt no other is made, for who looks at the bus again and again [ns].

        Raises:
            BusUrlError, BusError: It cannot be joined the first time.
        """
        self._join = join
        self._tell = tell
        self._clock = RealClock(spin_ns=0)
        self._rest_ns = rest_ns
        self._again_ns = 0  # when to try next, while the bus is gone
        self._bus: Bus | None = join()
        self._send_all = send_all_of(self._bus)

    def now_ns(self) -> int:
        """Return CLOCK_MONOTONIC [ns]."""
        return self._clock.now_ns()

    def wait_until(self, due_ns: int) -> None:
        """Wait without looking at the bus."""
        self._clock.wait_until(due_ns)

    def send(self, frame: Frame) -> None:
        """Hand a frame over for sending.

        Raises:
            BusError: It cannot be sent, or the bus is gone.
            ValueError: It is not a classic CAN frame.
        """
        self.send_all((frame,))

    def send_all(self, frames: Sequence[Frame]) -> int:
        """Hand frames over for sending; see `BatchBus`."""
        if self._bus is None:
            raise LinkLost("the bus is gone")
        try:
            return self._send_all(frames)
        except LinkLost as error:
            self._leave(error)
            raise

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame, or None once `until_ns` has come, also while the bus is gone."""
        while True:
            bus = self._bus or self._rejoined(until_ns)
            if bus is None:
                if self.now_ns() >= until_ns:
                    return None
                continue
            try:
                return bus.receive(until_ns)
            except BusError as error:
                self._leave(error)

    def fileno(self) -> int:
        """Return a descriptor that is readable whenever a frame waits; -1 while the bus is gone, or has none."""
        return self._bus.fileno() if isinstance(self._bus, Waitable) else -1

    def close(self) -> None:
        """Leave the bus; may be called again."""
        if self._bus is not None:
            self._bus.close()

    def _leave(self, error: BusError) -> None:
        assert self._bus is not None  # noqa: S101  (who fails was there)
        self._bus.close()
        self._bus = None
        self._tell(f"{error}; the drives live on and wait for it")

    def _rejoined(self, until_ns: int) -> Bus | None:
        """Return the bus if it is back; else wait a moment, no longer than asked for."""
        self._bus = self._attempt()
        if self._bus is None:
            self._clock.wait_until(min(until_ns, self.now_ns() + RETRY_NS))
            return None
        self._send_all = send_all_of(self._bus)
        self._tell("the bus is back")
        return self._bus

    def _attempt(self) -> Bus | None:
        """Join the bus, unless that failed just now; None when it cannot be."""
        if self.now_ns() < self._again_ns:
            return None
        try:
            return self._join()
        except TorqueRigError:
            self._again_ns = self.now_ns() + self._rest_ns
            return None
