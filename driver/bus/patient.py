"""A bus whose time stands still while a process stalls, for rigs that are simulated on both sides.

On a shared machine a process may stand still for a tenth of a second; a machine simulated in real time moves on
meanwhile under the last torque, and the run ends in a limit that says nothing of the program under test. Two sides that
take their time from here wait for each other instead, in every cycle: the controller for the answers to its SYNC, the
simulator for the next SYNC. The frames, their order and their content on the real bus are what they would be.
"""

from collections.abc import Sequence
from typing import Final

from torquerig.driver.bus.batches import send_all_of
from torquerig.driver.bus.interface import Bus, Tap
from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Arrival, Frame

STALL_NS: Final = 1_000_000
"""Longer than this between two looks at the clock, with nothing waited for, is a stall; our choice: four times what
waking up costs a process on a shared machine."""


class PatientBus:
    """A bus in real time that waits for what follows a SYNC; satisfies `Bus`.

    Attributes:
        patient_with: The bus.
        stood_still_ns: For how long its time has stood still so far [ns].
    """

    def __init__(
        self, bus: Bus, awaited: frozenset[int], *, within_ns: int, patience_ns: int, tap: Tap | None = None
    ) -> None:
        """Take a bus over.

        Args:
            bus: The bus.
            awaited: COB-IDs of the frames that must each come after a SYNC, whoever sends that.
            within_ns: When they are due, after the SYNC: time stands still there until they have come [ns].
            patience_ns: How long it stands still at most; then it goes on, and waits again after a SYNC only when all
                have come again [ns].
            tap: Is told every frame with our time of it [ns].
        """
        self.stood_still_ns = 0
        self.patient_with = bus
        self._send_all = send_all_of(bus)
        self._tap = tap
        self._awaited = awaited
        self._within_ns = within_ns
        self._patience_ns = patience_ns
        self._missing: set[int] = set()
        self._patient = True
        self._due_ns = 0  # of what is missing, in our time
        self._give_up_ns = 0  # when patience ends, in the bus's time
        self._looked_ns = bus.now_ns()  # the last look at the bus's time
        self._stamp_ns = self._looked_ns  # of the last frame, either way: none is older than one before it

    def now_ns(self) -> int:
        """Return the bus's time less the time that it stood still [ns]."""
        self._look(self._looked_ns)
        return self._looked_ns - self.stood_still_ns

    def wait_until(self, due_ns: int) -> None:
        """Wait without looking at the bus."""
        while self.now_ns() < due_ns:
            until_ns = due_ns + self.stood_still_ns
            self.patient_with.wait_until(until_ns)
            self._look(until_ns)

    def send(self, frame: Frame) -> None:
        """Hand a frame over for sending; see `Bus.send`."""
        self.send_all((frame,))

    def send_all(self, frames: Sequence[Frame]) -> int:
        """Hand frames over for sending; see `BatchBus`."""
        count = self._send_all(frames)
        self._stamp_ns = self.now_ns()
        for frame in frames[:count]:
            self._follow(frame)
        return count

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame, or None once `until_ns` has come; see `Bus.receive`."""
        while True:
            stand_ns = max(self._due_ns, self._looked_ns - self.stood_still_ns)
            waits = self._patient and bool(self._missing) and until_ns > stand_ns
            wait_ns = max(self._give_up_ns, self._looked_ns) if waits else until_ns + self.stood_still_ns
            arrival = self.patient_with.receive(wait_ns)
            self._look(wait_ns if arrival is None else min(arrival.at_ns, wait_ns))
            if waits:
                self.stood_still_ns += max(0, self._looked_ns - self.stood_still_ns - stand_ns)
            if arrival is not None:
                return self._stamped(arrival)
            if not waits:
                return None
            self._patient = False

    def close(self) -> None:
        """Leave the bus; may be called again."""
        self.patient_with.close()

    def _look(self, waited_until_ns: int) -> None:
        """Look at the bus's time; what has gone by beyond what was waited for was a stall."""
        bus_ns = self.patient_with.now_ns()
        stalled_ns = bus_ns - max(self._looked_ns, waited_until_ns) - STALL_NS
        self._looked_ns = bus_ns
        self.stood_still_ns += max(0, stalled_ns)

    def _stamped(self, arrival: Arrival) -> Arrival:
        """The frame in our time: neither older than one before it nor younger than now."""
        now_ns = self._looked_ns - self.stood_still_ns
        self._stamp_ns = min(max(arrival.at_ns - self.stood_still_ns, self._stamp_ns), now_ns)
        self._follow(arrival.frame)
        return Arrival(self._stamp_ns, arrival.frame)

    def _follow(self, frame: Frame) -> None:
        """Tell the tap, await what follows a SYNC, and no more what has come."""
        if self._tap is not None:
            self._tap(self._stamp_ns, frame)
        if frame.can_id in self._missing:
            self._missing.remove(frame.can_id)
            self._patient = self._patient or not self._missing
        if frame.can_id == cob.SYNC:
            self._missing = set(self._awaited)
            self._due_ns = self._stamp_ns + self._within_ns
            self._give_up_ns = self._looked_ns + self._patience_ns
