"""Drives in steady operation: SYNC, process data and torques as compiled code, for real time at several kilohertz.

`SteadyDrives` borrows the state of all drives on a bus while nothing happens but the regular cycle, and gives it back
for whatever else happens: a heartbeat, an SDO, a controlword that is new, a limit that is reached, a deadline that
passes. What the drives say and do is the same, at the same times.
"""

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, Final

import numba
import numpy as np
from numpy.typing import NDArray

from torquerig.device_sim.drive.drive import LentDrive, SimulatedDrive
from torquerig.device_sim.drive.steady_kernels import live
from torquerig.device_sim.drive.steady_memory import (
    ADVANCE,
    ASK,
    ASKED,
    DRIVE,
    EFFECT,
    FIELD,
    FLEET,
    LEAVE,
    RPDO,
    SAID,
    TPDO,
    WAITING,
)
from torquerig.device_sim.plant.logged import LoggedMachine
from torquerig.driver.wire.frame import MAX_DATA_LENGTH, Frame

PDOS: Final = 4
"""TPDOs and RPDOs of a drive: those with default identifiers (CiA 301, 7.3.3)."""
_numba: Final[Any] = numba  # it has no types
_GIVEN: Final = frozenset({ADVANCE, ASK})
_NO_DATA: Final = (0,) * MAX_DATA_LENGTH
_Row = tuple[Any, ...]  # of a table of records, parts of it as tuples


class SteadyDrives:
    """All drives on a bus, as the regular cycle sees them."""

    def __init__(self, drives: Iterable[SimulatedDrive], machine: LoggedMachine, entries: NDArray[np.void]) -> None:
        """Make room for the drives, and the code for it.

        Args:
            drives: The drives, which turn motors 0, 1, 2 ... of the machine in this order.
            machine: The machine.
            entries: Where frames will be when they have come, in the order of their times: records with the fields
                `at_ns`, `can_id`, `flags` (0 for an 11-bit data frame), `length` and `data`.
        """
        self._drives = tuple(drives)
        self._machine = machine
        self._lent: tuple[LentDrive, ...] = ()
        count, motors = len(self._drives), machine.motors
        self._fleet = np.zeros(1, FLEET)
        self._records = np.zeros(count, DRIVE)
        self._effects = np.zeros((count, WAITING), EFFECT)
        self._rpdos, self._tpdos = np.zeros(count * PDOS, RPDO), np.zeros(count * PDOS, TPDO)
        self._fields = np.zeros(count * PDOS * MAX_DATA_LENGTH, FIELD)
        self._said = np.zeros(count * PDOS, SAID)
        turned = motors.angle, motors.rate, motors.torque, motors.demand
        lent = self._records, self._effects, self._rpdos, self._tpdos, self._fields, self._said, turned
        memory = self._fleet, lent, entries
        kernel: Any = live
        self._live: Callable[[int], int] = partial(
            kernel.compile((*map(_numba.typeof, memory), _numba.types.int64)), *memory
        )
        self._wanted, self._now, self._next = (self._fleet[name] for name in ("wanted_ns", "now_ns", "next_ns"))
        self._entries, self._taken, self._origin = (self._fleet[name] for name in ("entries", "taken", "origin_ns"))
        self._here, self._asked, self._spoken = (self._fleet[name] for name in ("machine_ns", "asked_ns", "said"))

    def borrow(self, now_ns: int) -> bool:
        """Take the state of the drives over, if all are steady; whether that is so.

        Args:
            now_ns: How far their time has come [ns].
        """
        lent = list[LentDrive]()
        for drive in self._drives:
            if (each := drive.lend()) is None:
                return False
            lent.append(each)
        self._lent = tuple(lent)
        if not (self._lay_out() and self._is_alone()):
            return False
        sync, motors = self._drives[0].sync, self._machine.motors
        counts = len(lent), sum(len(each.heard) for each in lent), sum(len(each.sent) for each in lent)
        times = now_ns, self._machine.now_ns, -1, min(each.other_event_ns for each in lent), 0, 0
        self._fleet[0] = (*counts, sync.cob_id, sync.length, motors.is_prompt, *times, 0, 0, 0, 0, motors.gear)
        return True

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
                self._measure(at_ns)
        return needed != LEAVE

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
        count = int(self._spoken[0])
        if not count:
            return []
        self._spoken[0] = 0
        return [Frame(can_id, bytes(data[:length])) for can_id, length, data in self._said[:count].tolist()]

    def give_back(self) -> int:
        """Give the state back to the drives; how far their time has come [ns]."""
        rpdos, tpdos = iter(_rows(self._rpdos)), iter(_rows(self._tpdos))
        rows = zip(self._drives, self._lent, _rows(self._records), self._effects, strict=True)
        for drive, lent, (clock, _, path, protection, watchdogs, node), effects in rows:
            behind, (_, syncs, heard_ns, waiting) = drive.behind, node
            behind.take_back(clock[1], clock[2], clock[3])
            behind.path.take_back(path[0], path[1], path[-2], path[-1])
            behind.protection.take_back(*protection[-3:])
            behind.watchdogs.take_back(*watchdogs[-2:])
            behind.command.take_back(effects[:waiting].tolist())
            drive.sync.take_back(syncs, clock[1])
            drive.timers.now_ns = heard_ns
            for rpdo, row in zip(lent.heard, rpdos, strict=False):
                rpdo.take_back(*row[-2:])
            for tpdo, row in zip(lent.sent, tpdos, strict=False):
                tpdo.take_back(row[4], bytes(row[-1][: row[2]]) if row[7] else None)
        return self.now_ns

    def _lay_out(self) -> bool:
        """Write what the drives lend into the memory; whether all their PDOs are plain."""
        rpdos, tpdos, fields = list[_Row](), list[_Row](), list[_Row]()
        for axis, lent in enumerate(self._lent):
            for rpdo in lent.rpdos:
                if rpdo is None:
                    return False
                rpdos.append((axis, *rpdo))
            for tpdo in lent.tpdos:
                if tpdo is None:
                    return False
                tpdos.append((axis, *tpdo[0], len(fields), len(fields) + len(tpdo[1]), 0, _NO_DATA))
                fields += tpdo[1]
            self._records[axis] = lent.parts
            self._effects[axis, : len(lent.pending)] = list(lent.pending)
        self._rpdos[: len(rpdos)], self._tpdos[: len(tpdos)], self._fields[: len(fields)] = rpdos, tpdos, fields
        return True

    def _measure(self, at_ns: int) -> None:
        """Have all values there that a SYNC's TPDOs may ask for."""
        sent = [tpdo for lent in self._lent for tpdo in lent.sent]
        for tpdo, record in zip(sent, self._tpdos, strict=False):
            for number, field in enumerate(self._fields[record["first"] : record["end"]]):
                if field["source"] == ASKED:
                    field["value"] = tpdo.measure(number, at_ns)
        self._asked[0] = at_ns

    def _is_alone(self) -> bool:
        """Whether all drives hear the same SYNC, and nobody what another one says."""
        syncs = {(drive.sync.cob_id, drive.sync.length) for drive in self._drives}
        said = {tpdo[0][0] for lent in self._lent for tpdo in lent.tpdos if tpdo is not None}
        return len(syncs) == 1 and not any(said.intersection(drive.listeners) for drive in self._drives)


def _rows(records: NDArray[np.void]) -> list[_Row]:
    """Records as numbers of Python's."""
    rows: list[_Row] = records.tolist()
    return rows
