"""Any python-can interface as a bus of ours, in real time."""

import errno
import time
from collections import Counter
from typing import Final

import can

from torquerig.driver.bus.interface import Clock, Tap
from torquerig.driver.bus.messages import check_frame, flaw_of, frame_of, message_of
from torquerig.driver.bus.unix import UnixBus
from torquerig.driver.errors import BusError, LinkLost
from torquerig.driver.wire.frame import Arrival, Frame

OLDEST_NS: Final = 60 * 10**9
"""A frame this old may have waited for a stalled process; an older stamp is a device's own clock, not the epoch."""

_REASONS: Final = {
    errno.ENETDOWN: "its link is down or gone (sudo ip link set INTERFACE up)",
    errno.ENXIO: "the interface is gone",
    errno.ENODEV: "the interface is gone",
    errno.ENOBUFS: "its send queue is full, as when nobody acknowledges frames: is a drive on, at this bit rate?",
}
_LINK_LOST: Final = frozenset({errno.ENETDOWN, errno.ENXIO, errno.ENODEV})


class PythonCanBus:
    """A python-can bus behind our bus protocol.

    Error frames, CAN FD frames and malformed messages are counted, never handed on. A link that goes down shows in
    `send` only: python-can's `recv` goes on to return nothing, which the drives' watchdogs and ours notice.
    """

    def __init__(self, bus: can.BusABC, clock: Clock, tap: Tap | None = None, *, spin_ns: int = 0) -> None:
        """Take over an open python-can bus; `close` shuts it down.

        Args:
            bus: The python-can bus.
            clock: Real time; epoch timestamps are converted to it.
            tap: Is told every frame sent (at the time of sending) and received (at its arrival).
            spin_ns: How long before its deadline `receive` stops sleeping and polls [ns].
        """
        self._bus = bus
        self._clock = clock
        self.now_ns = clock.now_ns  # without a call in between: it is asked several times a cycle
        self._tap = tap
        self._spin_ns = spin_ns
        self._ignored: Counter[str] = Counter()
        self._latest_ns = clock.now_ns()
        self._closed = False

    @property
    def ignored(self) -> dict[str, int]:
        """How many messages were not handed on, by kind: `error`, `fd`, `malformed`."""
        return dict(self._ignored)

    @property
    def counts(self) -> dict[str, int]:
        """Everything that went wrong without an error: `ignored`, and what the unix bus counts."""
        return {**self._ignored, **(self._bus.counts if isinstance(self._bus, UnixBus) else {})}

    def wait_until(self, due_ns: int) -> None:
        """Wait without looking at the bus; frames queue meanwhile."""
        self._clock.wait_until(due_ns)

    def send(self, frame: Frame) -> None:
        """Hand a frame to the interface.

        Raises:
            BusError: It cannot be sent: the link is down or gone, the send buffer is full, the bus is closed.
            ValueError: It is not a classic CAN frame.
        """
        self._check_open()
        check_frame(frame)
        try:
            self._put(frame)
        except (can.CanError, OSError) as error:
            raise self._failure("send", error) from error
        if self._tap is not None:
            self._tap(self._clock.now_ns(), frame)

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame, or None once `until_ns` has come; what waits already comes first.

        Raises:
            BusError: The link is gone, or the bus is closed.
        """
        self._check_open()
        while True:
            left_ns = until_ns - self._spin_ns - self._clock.now_ns()
            try:
                message = self._bus.recv(left_ns / 1e9 if left_ns > 0 else 0.0)
            except (can.CanError, OSError) as error:
                raise self._failure("receive", error) from error
            if message is None:
                if self._clock.now_ns() >= until_ns:
                    return None
            elif flaw := flaw_of(message):
                self._ignored[flaw] += 1
            else:
                return self._arrival(message)

    def fileno(self) -> int:
        """Return a descriptor that is readable whenever a frame waits.

        Raises:
            NotImplementedError: python-can's interface has none.
        """
        return self._bus.fileno()

    def close(self) -> None:
        """Shut the python-can bus down; may be called again."""
        self._closed = True
        self._bus.shutdown()

    def _put(self, frame: Frame) -> None:
        self._bus.send(message_of(frame))

    def _arrival(self, message: can.Message) -> Arrival:
        """Return the frame with its time on the monotonic clock, which is now if the message does not tell.

        Times never run backwards, as frames on one wire cannot, whatever NTP does to the epoch meanwhile.
        """
        age_ns = time.time_ns() - int(message.timestamp * 1e9)
        now_ns = self._clock.now_ns()
        at_ns = max(self._latest_ns, now_ns - age_ns if 0 <= age_ns <= OLDEST_NS else now_ns)
        self._latest_ns = at_ns
        frame = frame_of(message)
        if self._tap is not None:
            self._tap(at_ns, frame)
        return Arrival(at_ns, frame)

    def _check_open(self) -> None:
        if self._closed:
            raise BusError(f"the bus ({self._bus.channel_info}) is closed")

    def _failure(self, verb: str, error: can.CanError | OSError) -> BusError:
        number = error.error_code if isinstance(error, can.CanError) else error.errno
        reason = _REASONS.get(number or 0) or str(error).splitlines()[0]
        kind = LinkLost if number in _LINK_LOST else BusError
        return kind(f"cannot {verb} on the bus ({self._bus.channel_info}): {reason}")
