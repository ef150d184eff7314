"""The simulated CAN wire: send queues, arbitration, frame times, and the devices that hear and answer.

Time moves from one event to the next: a frame's end, or whatever the devices have to do. A frame starts only when
nothing that could still enter its arbitration lies before it, so the outcome never depends on how a caller slices time.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

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
        self._bits = {
            extended: tuple(worst_case_bits(length, extended=extended) for length in range(MAX_DATA_LENGTH + 1))
            for extended in (False, True)
        }
        self._bit_rate = bit_rate
        self._taps = [tap] if tap is not None else []
        self._queues = SendQueues()
        self._now_ns = 0
        self._on_wire: Waiting | None = None
        self._bits_on_wire = 0
        self._end_ns = 0  # of the frame on the wire
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
        while True:
            start_ns = max(self._now_ns, self._queues.ready_ns())
            event_ns = self._devices.next_event_ns()
            if min(start_ns, event_ns) >= until_ns:
                self._advance(until_ns)
                return None
            if start_ns < event_ns:
                break
            self._advance(event_ns)  # what happens then may be ready in time for this arbitration
        self._now_ns = start_ns
        winner = self._queues.take(start_ns)
        self._on_wire = winner
        self._bits_on_wire = self._bits[winner.frame.extended][0 if winner.frame.remote else len(winner.frame.data)]
        self._end_ns = start_ns + self._duration_ns(self._bits_on_wire)
        self._longest_wait_ns = max(self._longest_wait_ns, start_ns - winner.ready_ns)
        return winner

    def _finish(self, winner: Waiting) -> Arrival | None:
        """Advance to the end of the frame on the wire, let all hear it, and return it if the master does."""
        node_id, frame = winner.node_id, winner.frame
        self._on_wire = None
        self._frames += 1
        self._bits_sent += self._bits_on_wire
        self._busy_ns += self._duration_ns(self._bits_on_wire)
        self._now_ns = self._end_ns
        for tap in self._taps:
            tap(self._end_ns, frame)
        if node_id == MASTER:
            self._enqueue(self._devices.receive(frame, self._end_ns))
            return None
        self._enqueue(self._devices.receive(frame, self._end_ns, node_id))
        return Arrival(self._end_ns, frame)

    def _advance(self, to_ns: int) -> None:
        self._enqueue(self._devices.advance(to_ns))
        self._now_ns = max(self._now_ns, to_ns)

    def _enqueue(self, emissions: list[Emission]) -> None:
        for emission in emissions:
            self._dropped += not self._queues.put(emission.node_id, emission.frame, emission.ready_ns)

    def _duration_ns(self, bits: int) -> int:
        """Return how long bits take [ns], rounded up to whole nanoseconds."""
        return -(-bits * _NS_PER_S // self._bit_rate)
