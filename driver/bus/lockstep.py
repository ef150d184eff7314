"""The bus inside one process whose time is simulated: waiting for a frame or a deadline advances the simulation to it.

So the bus is the clock, and driver, loop and laws are the very code that runs in real time. What is simulated is
injected (`SimulatedWire`): the driver never imports a simulator.
"""

import threading
from collections import deque
from typing import Final, NoReturn, Protocol

import can
from can.typechecking import CanFilters

from torquerig.driver.bus.interface import Tap
from torquerig.driver.bus.messages import check_frame, flaw_of, frame_of, message_of
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Arrival, Frame

PATIENCE_NS: Final = 60 * 10**9
"""Simulated time after which a `recv` without a timeout gives up: nobody else could ever make a frame come."""


class SimulatedWire(Protocol):
    """A simulated CAN wire with devices on it, as its one master meets it."""

    def now_ns(self) -> int:
        """Return the simulated time [ns]."""
        ...

    def submit(self, frame: Frame) -> None:
        """Put a frame into the master's send queue now; it takes part in arbitration."""
        ...

    def run_until(self, until_ns: int) -> Arrival | None:
        """Advance to the first frame that reaches the master no later than `until_ns`, and return it.

        Returns:
            The frame, time standing at its end; None when there is none, time standing at `until_ns`, or where it
            stood if that is in the past.
        """
        ...

    def watch(self, tap: Tap) -> None:
        """Tell `tap` every frame at its end, the master's and those between devices included."""
        ...


class LockstepError(can.CanOperationError, BusError):
    """A use of the lockstep bus that cannot be; an error to those who know python-can and to those who know us."""


class LockstepBus(can.BusABC):
    """The master's end of a simulated wire: a python-can bus, and a `Bus` of ours with exact integer times.

    It belongs to the thread that made it. Programs written for python-can run on it unchanged as long as they keep to
    that thread (no Notifier, no periodic sending): what waits in `recv` advances the time.
    """

    def __init__(self, wire: SimulatedWire, tap: Tap | None = None, *, can_filters: CanFilters | None = None) -> None:
        """Take the master's end of a wire.

        Args:
            wire: What is simulated.
            tap: Is told every frame on the wire at its end.
            can_filters: See `can.BusABC.set_filters`.
        """
        self._wire = wire
        self._queue: deque[Arrival] = deque()
        self._owner = threading.current_thread()
        self._owner_id = threading.get_ident()
        self._closed = False
        self.channel_info = "lockstep bus"
        if tap is not None:
            wire.watch(tap)
        super().__init__(channel="lockstep", can_filters=can_filters)

    def now_ns(self) -> int:
        """Return the simulated time [ns]."""
        return self._wire.now_ns()

    def wait_until(self, due_ns: int) -> None:
        """Advance the simulation to `due_ns`; frames that come meanwhile are kept for `receive`."""
        self._check_use()
        while (arrival := self._wire.run_until(due_ns)) is not None:
            self._queue.append(arrival)

    def send(self, msg: can.Message | Frame, timeout: float | None = None) -> None:
        """Put a frame into the master's send queue; time does not advance.

        Args:
            msg: A classic CAN frame, python-can's or ours.
            timeout: Not needed: the queue has room.

        Raises:
            LockstepError: The bus is closed, or another thread's.
            ValueError: It is not a classic CAN frame.
        """
        del timeout
        self._check_use()
        if isinstance(msg, Frame):
            check_frame(msg)
            self._wire.submit(msg)
        elif flaw := flaw_of(msg):
            raise ValueError(f"the lockstep bus carries classic CAN frames only, not this one ({flaw}): {msg}")
        else:
            self._wire.submit(frame_of(msg))

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame, or None with the time at `until_ns`; what waits already comes first.

        Raises:
            LockstepError: The bus is closed, or another thread's.
        """
        self._check_use()
        while True:
            arrival = self._queue.popleft() if self._queue else self._wire.run_until(until_ns)
            if arrival is None or self._filters is None or self._matches_filters(message_of(arrival.frame)):
                return arrival

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Return the next message, timestamped in simulated seconds, or None after `timeout` simulated seconds.

        This replaces BusABC.recv, which loops on wall time and would let simulated time run away.

        Raises:
            LockstepError: The bus is closed, or another thread's; or there was no timeout, and no frame comes.
        """
        wait_ns = PATIENCE_NS if timeout is None else max(0, round(timeout * 1e9))
        arrival = self.receive(self.now_ns() + wait_ns)
        if arrival is not None:
            return message_of(arrival.frame, arrival.at_ns / 1e9)
        if timeout is None:
            raise LockstepError(f"no frame came in {PATIENCE_NS // 10**9} s of simulated time, and recv has no timeout")
        return None

    def close(self) -> None:
        """Leave the wire; may be called again."""
        self.shutdown()

    def shutdown(self) -> None:
        """Leave the wire; may be called again."""
        super().shutdown()
        self._closed = True

    def _send_periodic_internal(self, *_args: object, **_kwargs: object) -> NoReturn:
        raise LockstepError("the lockstep bus cannot send periodically: that needs a thread beside the one that waits")

    def _check_use(self) -> None:
        if self._closed:
            raise LockstepError("the lockstep bus is closed")
        if threading.get_ident() != self._owner_id:
            raise LockstepError(
                f"the lockstep bus belongs to thread {self._owner.name}, whose waiting is what advances its time: "
                f"{threading.current_thread().name} may not use it (a real-time bus such as unix:FOLDER allows that)"
            )
