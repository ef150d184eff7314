"""What drives lend to a steady cycle, written into its memory, and taken back from there."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.device_sim.drive.drive import LentDrive, SimulatedDrive
from torquerig.device_sim.drive.steady_memory import (
    ASKED,
    DRIVE,
    EFFECT,
    FIELD,
    FLEET,
    NEVER_NS,
    RPDO,
    SAID,
    TPDO,
    WAITING,
)
from torquerig.device_sim.plant.logged import LoggedMachine
from torquerig.driver.wire import nmt
from torquerig.driver.wire.frame import MAX_DATA_LENGTH, Frame
from torquerig.driver.wire.nmt import NmtState

PDOS: Final = 4
"""TPDOs and RPDOs of a drive: those with default identifiers (CiA 301, 7.3.3)."""
_UNSENT: Final = (0, 0, (0,) * MAX_DATA_LENGTH)
_NEVER_ASKED: Final = -1
_Row = tuple[Any, ...]


class Loan:
    """Memory for all drives on a bus.

    Attributes:
        fleet: One record of `steady_memory.FLEET`, shape (1,).
        lent: The rest: drives, effects, RPDOs, TPDOs, their fields, what is said, and the machine's motors.
    """

    def __init__(self, drives: Sequence[SimulatedDrive], machine: LoggedMachine) -> None:
        """Make room.

        Args:
            drives: The drives, which turn motors 0, 1, 2 ... of the machine in this order.
            machine: The machine.
        """
        self._drives = drives
        self._machine = machine
        count, motors = len(drives), machine.motors
        self.fleet = np.zeros(1, FLEET)
        self._records, self._effects = np.zeros(count, DRIVE), np.zeros((count, WAITING), EFFECT)
        self._rpdos, self._tpdos = np.zeros(count * PDOS, RPDO), np.zeros(count * PDOS, TPDO)
        self._fields = np.zeros(count * PDOS * MAX_DATA_LENGTH, FIELD)
        tables = self._records, self._effects, self._rpdos, self._tpdos, self._fields, np.zeros(count * PDOS, SAID)
        self.lent = (*tables, (motors.angle, motors.rate, motors.torque, motors.demand))
        self._heard, self._made, self._values = self._rpdos[:0], self._tpdos[:0], self._fields["value"][:0]
        self._beats = [(drive, nmt.encode_heartbeat(drive.node_id, NmtState.OPERATIONAL)) for drive in drives]
        self._owners: list[LentDrive] = []
        self._plans: list[tuple[object, object]] = []
        self._identifiers: frozenset[int] = frozenset()
        self.fleet["drives"], self.fleet["gear"], self.fleet["is_prompt"] = count, motors.gear, motors.is_prompt

    def borrow(self, now_ns: int) -> bool:
        """Take the state of the drives over, if all are steady; whether that is so.

        Args:
            now_ns: How far their time has come [ns].
        """
        owners = list[LentDrive]()
        for drive in self._drives:
            if (owner := drive.lend()) is None:
                return False
            owners.append(owner)
        self._owners = owners
        plans: list[tuple[object, object]] = [(owner.heard, owner.said) for owner in owners]
        if plans != self._plans:
            self._plans = plans
            self._lay_out()
        if not self._is_alone():
            return False
        self._fill()
        fleet = self.fleet[0]
        fleet["now_ns"], fleet["machine_ns"], fleet["asked_ns"] = now_ns, self._machine.now_ns, _NEVER_ASKED
        fleet["others_ns"] = min([owner.other_event_ns for owner in owners])
        fleet["aside_ns"] = min([owner.aside_ns for owner in owners])
        fleet["said"] = 0
        return True

    def give_back(self) -> None:
        """Have the drives go on from where the steady cycle ended."""
        rpdos, tpdos = iter(_rows(self._heard)), iter(_rows(self._made))
        rows = zip(self._drives, self._owners, _rows(self._records), strict=True)
        for axis, (drive, owner, (clock, _, path, protection, watchdogs, node)) in enumerate(rows):
            behind, (_, syncs, heard_ns, waiting) = drive.behind, node
            behind.take_back(clock[1], clock[2], clock[3])
            behind.path.take_back(path[0], path[1], path[-2], path[-1])
            behind.protection.take_back(*protection[-3:])
            behind.watchdogs.take_back(*watchdogs[-2:])
            behind.command.take_back(self._effects[axis, :waiting].tolist() if waiting else ())
            drive.sync.take_back(syncs, clock[1])
            drive.timers.now_ns = heard_ns
            for rpdo, row in zip(owner.rpdos, rpdos, strict=False):
                rpdo.take_back(*row[-2:])
            for tpdo, (_, _, length, _, _, _, syncs, sent, data) in zip(owner.tpdos, tpdos, strict=False):
                tpdo.take_back(syncs, bytes(data[:length]) if sent else None)

    def measure(self, at_ns: int) -> None:
        """Have all values there that a SYNC's TPDOs may ask for."""
        rows = zip([tpdo for owner in self._owners for tpdo in owner.tpdos], self._made, strict=True)
        for tpdo, record in rows:
            for number, field in enumerate(self._fields[record["first"] : record["end"]]):
                if field["source"] == ASKED:
                    field["value"] = tpdo.measure(number, at_ns)
        self.fleet["asked_ns"] = at_ns

    def live_aside(self, at_ns: int) -> list[Frame] | None:
        """Have happen what is due beside the cycle: heartbeats, and looks of the protection.

        Returns:
            What the drives say; None if that would not leave the cycle regular: then no heartbeat has gone out, and a
            drive that would trip has not looked.
        """
        beats = [beat for drive, beat in self._beats if drive.error_control.producer.timer.due_ns <= at_ns]
        if not all(drive.expects(beat) for beat in beats for drive in self._drives):
            return None
        for axis, drive in enumerate(self._drives):
            protection = drive.behind.protection
            if protection.look.due_ns <= at_ns:
                protection.take_back(*self._records["protection"].item(axis)[-3:])
                if not protection.look_calmly(at_ns):
                    return None
        for drive in self._drives:
            if drive.error_control.producer.timer.due_ns <= at_ns:
                drive.error_control.producer.timer.ring()
                drive.take()
        self.fleet["machine_ns"] = self._machine.now_ns
        self.fleet["aside_ns"] = min([drive.aside_ns for drive in self._drives])
        for beat in beats:
            self._hear(beat, at_ns)
        return beats

    def hear_heartbeat(self, frame: Frame, at_ns: int) -> bool:
        """Let the drives hear a heartbeat; False, and nobody has, if that would not leave the cycle regular."""
        if not all(drive.expects(frame) for drive in self._drives):
            return False
        self._hear(frame, at_ns)
        return True

    def has_no_alarm(self, at_ns: int) -> bool:
        """Whether nothing rings at a time: heartbeats that were heard put their alarms off."""
        others_ns = min([drive.other_event_ns for drive in self._drives])
        deadline_ns = min(
            self._records["watchdogs"]["deadline_ns"].min(), self._heard["deadline_ns"].min(initial=NEVER_NS)
        )
        self.fleet["others_ns"] = others_ns
        return bool(min(others_ns, deadline_ns) > at_ns)

    def _hear(self, beat: Frame, at_ns: int) -> None:
        for drive in self._drives:
            if beat.can_id in drive.listeners:
                drive.error_control.consumer.receive(beat, at_ns)

    def _lay_out(self) -> None:
        """Write how PDOs are read and made."""
        rpdos, tpdos, fields = list[_Row](), list[_Row](), list[_Row]()
        for axis, owner in enumerate(self._owners):
            rpdos += [(axis, *plan, 0, 0, 0) for plan in owner.heard]
            for plan in owner.said:
                end = len(fields) + len(plan.fields)
                tpdos.append((axis, *plan.frame, len(fields), end, *_UNSENT))
                fields += [(*field, 0) for field in plan.fields]
        self._heard, self._made = self._rpdos[: len(rpdos)], self._tpdos[: len(tpdos)]
        self._heard[:], self._made[:], self._fields[: len(fields)] = rpdos, tpdos, fields
        self._values = self._fields["value"][: len(fields)]
        self.fleet["rpdos"], self.fleet["tpdos"] = len(rpdos), len(tpdos)
        self._identifiers = frozenset(plan.frame[0] for owner in self._owners for plan in owner.said)

    def _fill(self) -> None:
        """Write the state."""
        for axis, owner in enumerate(self._owners):
            self._records[axis] = owner.parts
            for place, effect in enumerate(owner.pending):
                self._effects[axis, place] = effect
        rpdos = [rpdo.lend() for owner in self._owners for rpdo in owner.rpdos]
        for name, column in zip(("event_ns", "deadline_ns", "received"), zip(*rpdos, strict=True), strict=False):
            self._heard[name] = column
        tpdos = [tpdo.lend() for owner in self._owners for tpdo in owner.tpdos]
        self._made["syncs"], self._made["sent"] = [syncs for syncs, _ in tpdos], 0
        self._values[:] = [value for _, values in tpdos for value in values]

    def _is_alone(self) -> bool:
        """Whether all drives hear the same SYNC, and nobody what another one says."""
        sync = self._drives[0].sync
        self.fleet["sync_id"], self.fleet["sync_length"] = can_id, length = sync.cob_id, sync.length
        return all(
            drive.sync.cob_id == can_id
            and drive.sync.length == length
            and self._identifiers.isdisjoint(drive.listeners)
            for drive in self._drives
        )


def _rows(records: NDArray[np.void]) -> list[_Row]:
    """Records as numbers of Python's."""
    rows: list[_Row] = records.tolist()
    return rows
