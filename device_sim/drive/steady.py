"""Drives in steady operation: SYNC, process data and torques as compiled code, for real time at several kilohertz.

`SteadyDrives` borrows the state of all drives on a bus while nothing happens but the regular cycle, heartbeats and calm
looks of the protection, and gives it back for whatever else happens: an SDO, a controlword that is new, a limit that is
reached, a deadline that passes. What the drives say and do is the same, at the same times.
"""

import struct
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

import numba
import numpy as np

from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.drive.steady_kernels import live
from torquerig.device_sim.drive.steady_loan import Loan
from torquerig.device_sim.drive.steady_memory import ADVANCE, ALARM, ASIDE, ASK, HEARD, LEAVE
from torquerig.device_sim.plant.logged import LoggedMachine
from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Frame

_numba: Final[Any] = numba  # it has no types
_GIVEN: Final = frozenset({ADVANCE, ASK, ASIDE, ALARM})
_HEARTBEATS: Final = range(cob.HEARTBEAT + 1, cob.HEARTBEAT + 128)
_HEARD: Final = struct.Struct("=BBHI8s")  # as `steady_memory.HEARD`


class SteadyDrives:
    """All drives on a bus, as the regular cycle sees them."""

    def __init__(self, drives: Sequence[SimulatedDrive], machine: LoggedMachine) -> None:
        """Make room for the drives, and the code for them.

        Args:
            drives: The drives, which turn motors 0, 1, 2 ... of the machine in this order.
            machine: The machine.
        """
        self._machine = machine
        self._loan = Loan(drives, machine)
        heard = np.zeros(1, HEARD)
        memory = self._loan.fleet, self._loan.lent, heard
        kernel: Any = live
        types = (*map(_numba.typeof, memory), _numba.types.int64)
        self._live: Callable[[int], int] = partial(kernel.compile(types), *memory)
        self._heard, self._waits = heard.view(np.uint8).data, heard["waits"]
        self._said = self._loan.lent[5]
        self._frames: list[Frame] = []  # beside the cycle's
        fleet = self._loan.fleet
        self._wanted, self._here, self._spoken = (fleet[name] for name in ("wanted_ns", "machine_ns", "said"))
        self._now, self._next = (fleet[name] for name in ("now_ns", "next_ns"))

    def borrow(self, now_ns: int) -> bool:
        """Take the state of the drives over, if all are steady; whether that is so.

        Args:
            now_ns: How far their time has come [ns].
        """
        self._waits[0] = 0
        return self._loan.borrow(now_ns)

    def receive(self, frame: Frame, at_ns: int) -> bool:
        """Let the drives hear a frame, after all that is due until then has happened.

        Args:
            frame: The frame.
            at_ns: When it was complete, not before the drives' time [ns].

        Returns:
            Whether that was regular. If not, the drives have not heard it, and what they lent is to be given back.
        """
        can_id, data, remote, extended = frame
        if can_id in _HEARTBEATS and not (remote or extended):
            return self.advance(at_ns) and self._loan.hear_heartbeat(frame, at_ns)
        _HEARD.pack_into(self._heard, 0, 1, remote or extended, len(data), can_id, data)
        return self.advance(at_ns)

    def advance(self, to_ns: int) -> bool:
        """Let everything happen that is due at or before a time, not before the drives' time.

        Returns:
            Whether that was regular. If not, what comes before has happened, and the loan is to be given back.
        """
        while (needed := self._live(to_ns)) in _GIVEN:
            at_ns = self._wanted.item()
            if needed == ADVANCE:
                self._machine.advance(at_ns)
                self._here[0] = at_ns
            elif needed == ASK:
                self._loan.measure(at_ns)
            elif needed == ALARM:
                if not self._loan.has_no_alarm(to_ns):
                    return False
            else:
                frames = self._loan.live_aside(at_ns)
                if frames is None:
                    return False
                self._frames = self.take() + frames
        return bool(needed != LEAVE)

    @property
    def next_event_ns(self) -> int:
        """When something happens next without a frame, as of the last time that all was regular [ns]."""
        return int(self._next[0])

    def take(self) -> list[Frame]:
        """What the drives have said since they were last asked, in the order of arbitration."""
        frames, count = self._frames, self._spoken.item()
        if frames:
            self._frames = []
        if not count:
            return frames
        self._spoken[0] = 0
        return frames + [Frame(can_id, bytes(data[:length])) for can_id, length, data in self._said[:count].tolist()]

    def give_back(self) -> int:
        """Give the state back to the drives; how far their time has come [ns]."""
        self._loan.give_back()
        return int(self._now[0])
