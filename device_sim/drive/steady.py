"""Drives in steady operation: SYNC, process data and torques as compiled code, for real time at several kilohertz.

`SteadyDrives` borrows the state of all drives on a bus while nothing happens but the regular cycle, and gives it back
for whatever else happens: a heartbeat, an SDO, a controlword that is new, a limit that is reached, a deadline that
passes. What the drives say and do is the same, at the same times.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

import numba
import numpy as np
from numpy.typing import NDArray

from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.drive.steady_kernels import live
from torquerig.device_sim.drive.steady_loan import Loan
from torquerig.device_sim.drive.steady_memory import ADVANCE, ASK, LEAVE
from torquerig.device_sim.plant.logged import LoggedMachine
from torquerig.driver.wire.frame import Frame

_numba: Final[Any] = numba  # it has no types
_GIVEN: Final = frozenset({ADVANCE, ASK})


class SteadyDrives:
    """All drives on a bus, as the regular cycle sees them."""

    def __init__(self, drives: Sequence[SimulatedDrive], machine: LoggedMachine, entries: NDArray[np.void]) -> None:
        """Make room for the drives, and the code for it.

        Args:
            drives: The drives, which turn motors 0, 1, 2 ... of the machine in this order.
            machine: The machine.
            entries: Where frames will be when they have come, in the order of their times: records with the fields
                `at_ns`, `can_id`, `flags` (0 for an 11-bit data frame), `length` and `data`.
        """
        self._machine = machine
        self._loan = Loan(drives, machine)
        memory = self._loan.fleet, self._loan.lent, entries
        kernel: Any = live
        types = (*map(_numba.typeof, memory), _numba.types.int64)
        self._live: Callable[[int], int] = partial(kernel.compile(types), *memory)
        self._said = self._loan.lent[5]
        fleet = self._loan.fleet
        self._wanted, self._here, self._spoken = (fleet[name] for name in ("wanted_ns", "machine_ns", "said"))
        self._now, self._next = (fleet[name] for name in ("now_ns", "next_ns"))
        self._entries, self._taken, self._origin = (fleet[name] for name in ("entries", "taken", "origin_ns"))

    def borrow(self, now_ns: int) -> bool:
        """Take the state of the drives over, if all are steady; whether that is so.

        Args:
            now_ns: How far their time has come [ns].
        """
        return self._loan.borrow(now_ns)

    def hear(self, entries: int, origin_ns: int) -> None:
        """Have frames be taken that came.

        Args:
            entries: How many there are at the place for entries.
            origin_ns: What the drives' time 0 is in their times.
        """
        self._entries[0], self._taken[0], self._origin[0] = entries, 0, origin_ns

    def live(self, until_ns: int) -> bool:
        """Let the drives take the frames that came, and what is due without frames happen until a time.

        Args:
            until_ns: The drives' time to go to when all frames are taken [ns].

        Returns:
            Whether it may be called again: False if something comes next that is not regular, an event or the frame at
            `taken`. When it returns, the drives may have said something: see `said`.
        """
        while (needed := self._live(until_ns)) in _GIVEN:
            at_ns = self._wanted.item()
            if needed == ADVANCE:
                self._machine.advance(at_ns)
                self._here[0] = at_ns
            else:
                self._loan.measure(at_ns)
        return bool(needed != LEAVE)

    @property
    def taken(self) -> int:
        """How many of the frames that came have been taken."""
        return int(self._taken[0])

    @property
    def now_ns(self) -> int:
        """How far the drives' time has come [ns]."""
        return int(self._now[0])

    @property
    def next_ns(self) -> int:
        """When something happens next without a frame, as of the last time that all was done [ns]."""
        return int(self._next[0])

    def said(self) -> list[Frame]:
        """What the drives have said, to be sent now, in the order of arbitration."""
        count = self._spoken.item()
        if not count:
            return []
        self._spoken[0] = 0
        return [Frame(can_id, bytes(data[:length])) for can_id, length, data in self._said[:count].tolist()]

    def give_back(self) -> int:
        """Give the state back to the drives; how far their time has come [ns]."""
        self._loan.give_back()
        return self.now_ns
