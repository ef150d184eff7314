"""The simulated CAN wire: send queues, arbitration, frame times, and the devices that hear and answer.

Time moves from one event to the next: a frame's end, or whatever the devices have to do. A frame starts only when
nothing that could still enter its arbitration lies before it, so the outcome never depends on how a caller slices time.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

from torquerig.device_sim.arbitration import SendQueues, Waiting
from torquerig.device_sim.devices import Emission, SimulatedDevices
from torquerig.driver.wire.frame import MAX_DATA_LENGTH, Arrival, Frame, worst_case_bits

MASTER: Final = 0
"""The master's send queue; 0 is no node's id."""

_NS_PER_S: Final = 10**9


@dataclass(frozen=True, slots=True)
class WireStatistics:
    """What has passed over a wire.

    Attributes:
        frames: Complete frames.
        bits: Their bits, stuffing at its worst and interframe space included.
        busy_ns: How long they took [ns].
        longest_wait_ns: The longest that a frame was ready before it could start [ns].
        dropped: Frames for which there was no room at their node, because too many waited there.
    """

    frames: int = 0
    bits: int = 0
    busy_ns: int = 0
    longest_wait_ns: int = 0
    dropped: int = 0


class _Length(NamedTuple):
    """How long a frame is, stuffing at its worst and interframe space included."""

    bits: int
    duration_ns: int


class SimulatedNetwork:
    """Devices and one master on a simulated wire; the master's calls are what makes time pass."""

    def __init__(
        self, devices: SimulatedDevices, bit_rate: int, tap: Callable[[int, Frame], None] | None = None
    ) -> None:
        """Lay the wire at time 0.

        Args:
            devices: All nodes but the master.
            bit_rate: Of the wire [bit/s].
            tap: Is told every frame at its end [ns].

        Raises:
            ValueError: The bit rate is not positive.
        """
        if bit_rate <= 0:
            raise ValueError(f"a bit rate is positive, not {bit_rate} bit/s")
        self._devices = devices
        self._lengths = {extended: _lengths(bit_rate, extended=extended) for extended in (False, True)}
        self._taps = [tap] if tap is not None else []
        self._queues = SendQueues()
        self._now_ns = 0
        self._on_wire: Waiting | None = None
        self._length = _Length(0, 0)  # of the frame on the wire
        self._end_ns = 0  # of that frame
        self._frames = 0
        self._bits_sent = 0
        self._busy_ns = 0
        self._longest_wait_ns = 0
        self._dropped = 0

    @property
    def statistics(self) -> WireStatistics:
        """What has passed so far; a frame on its way is not counted yet."""
        return WireStatistics(self._frames, self._bits_sent, self._busy_ns, self._longest_wait_ns, self._dropped)

    def now_ns(self) -> int:
        """Return the simulated time [ns]."""
        return self._now_ns

    def watch(self, tap: Callable[[int, Frame], None]) -> None:
        """Tell `tap` every frame from now on, at its end [ns]."""
        self._taps.append(tap)

    def intervene(self, node_id: int, act: Callable[[int], None]) -> None:
        """Do something to a device now that no frame does; see `SimulatedDevices.intervene`."""
        self._enqueue(self._devices.intervene(node_id, self._now_ns, act))

    def submit(self, frame: Frame) -> None:
        """Put a frame into the master's send queue now; there it always finds room."""
        self._queues.put(MASTER, frame, self._now_ns, room=sys.maxsize)

    def next_ns(self) -> int:
        """The earliest time that `run_until` must be given for anything to happen.

        An event or a frame's end happens at its own time; a frame starts only when given a later one than its start.
        """
        event_ns = self._devices.next_event_ns()
        if self._on_wire is not None:
            return min(self._end_ns, event_ns)
        return min(max(self._now_ns, self._queues.ready_ns()) + 1, event_ns)

    def run_until(self, until_ns: int) -> Arrival | None:
        """Advance to the end of the first frame that a device sends, no later than `until_ns`.

        A frame that would start at `until_ns` itself does not start yet: what the caller submits then still takes
        part in its arbitration.

        Returns:
            The frame, time standing at its end; None when there is none, time standing at `until_ns`, or where it
            stood if that is in the past.
        """
        until_ns = max(until_ns, self._now_ns)
        while (winner := self._on_wire or self._start(until_ns)) is not None:
            if self._end_ns > until_ns:
                self._advance(until_ns)
                return None
            arrival = self._finish(winner)
            if arrival is not None:
                return arrival
        return None

    def _start(self, until_ns: int) -> Waiting | None:
        """Advance until a frame starts, and return it; or to `until_ns`, and return None."""
        devices, queues = self._devices, self._queues
        while True:
            start_ns = max(self._now_ns, queues.ready_ns())
            event_ns = devices.next_event_ns()
            if start_ns >= until_ns <= event_ns:
                self._advance(until_ns)
                return None
            if start_ns < event_ns:
                break
            self._advance(event_ns)  # what happens then may be ready in time for this arbitration
        self._now_ns = start_ns
        winner = queues.take(start_ns)
        frame = winner.frame
        self._on_wire = winner
        self._length = self._lengths[frame.extended][0 if frame.remote else len(frame.data)]
        self._end_ns = start_ns + self._length.duration_ns
        self._longest_wait_ns = max(self._longest_wait_ns, start_ns - winner.ready_ns)
        return winner

    def _finish(self, winner: Waiting) -> Arrival | None:
        """Advance to the end of the frame on the wire, let all hear it, and return it if the master does."""
        node_id, frame, end_ns = winner.node_id, winner.frame, self._end_ns
        bits, duration_ns = self._length
        self._on_wire = None
        self._frames += 1
        self._bits_sent += bits
        self._busy_ns += duration_ns
        self._now_ns = end_ns
        for tap in self._taps:
            tap(end_ns, frame)
        sender = None if node_id == MASTER else node_id
        self._enqueue(self._devices.receive(frame, end_ns, sender))
        return None if sender is None else Arrival(end_ns, frame)

    def _advance(self, to_ns: int) -> None:
        self._enqueue(self._devices.advance(to_ns))
        self._now_ns = max(self._now_ns, to_ns)

    def _enqueue(self, emissions: list[Emission]) -> None:
        for ready_ns, node_id, frame in emissions:
            self._dropped += not self._queues.put(node_id, frame, ready_ns)


def _lengths(bit_rate: int, *, extended: bool) -> tuple[_Length, ...]:
    """How long frames of 0, 1, 2 ... data bytes are; the time is rounded up to whole nanoseconds."""
    bits = (worst_case_bits(length, extended=extended) for length in range(MAX_DATA_LENGTH + 1))
    return tuple(_Length(each, -(-each * _NS_PER_S // bit_rate)) for each in bits)
