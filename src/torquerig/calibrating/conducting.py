"""Conducting a procedure: the bus, the drives, the record, and the calibration that comes of it."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

from torquerig.assembly import Rig
from torquerig.axes import axis_settings, group_settings
from torquerig.building import period_ns
from torquerig.calibrated import read_calibration
from torquerig.calibrating.deposit import Deposit, deposit, target_of
from torquerig.calibrating.notes import Notes, claim_record, provenance_of, write_record
from torquerig.calibrating.task import Consent, Task
from torquerig.calibration.conductor import Conductor
from torquerig.calibration.procedure import Grade, Result, Start, Watcher
from torquerig.driver.master.group import AxisGroup
from torquerig.errors import RecordError
from torquerig.garbage import no_collections
from torquerig.mechanism import warm_up
from torquerig.provenance import Drives, drives_of, notes_on_loaded, refuse_others
from torquerig.record import DONE
from torquerig.scheduling import real_time
from torquerig.stopping import undisturbed


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a procedure leaves.

    Attributes:
        result: What it brought.
        truth: What is true in the simulator; empty where nobody knows.
        notes: What a person should know.
        record: The folder of raw data and figure.
        picture: The figure.
        deposit: The calibration that was written; None when the verdict did not allow it.
    """

    result: Result
    truth: Mapping[str, Any]
    notes: tuple[str, ...]
    record: Path
    picture: Path
    deposit: Deposit | None


class Terms(NamedTuple):
    """On which terms a procedure is conducted.

    Attributes:
        seed: Of the script's chance.
        accept: Write a suspicious result into the calibration too.
        replace: Begin a new calibration, and only keep the old one beside it.
    """

    seed: int = 0
    accept: bool = False
    replace: bool = False

    @property
    def written(self) -> tuple[Grade, ...]:
        """How far a result must be trusted to be written."""
        return (Grade.OK, Grade.SUSPICIOUS) if self.accept else (Grade.OK,)


_USUAL: Final = Terms()


def conduct(task: Task, place: Path | None, consent: Consent, watcher: Watcher, terms: Terms = _USUAL) -> Outcome:
    """Run a procedure to its end, and keep what it leaves.

    Args:
        task: The procedure.
        place: The folder of the calibration; None: where the configuration's calibration is, or the current one.
        consent: Who agreed to the plan.
        watcher: Is told how far it is.
        terms: On which terms.

    Returns:
        What it leaves.

    Raises:
        ConfigurationError: The calibration that is there cannot be read, or was measured on other drives; nothing has
            moved.
        RecordError: A file cannot be written; if it is one of the folders, nothing has moved.
        LimitExceeded: A bound that was agreed to.
        TorqueRigError: The bus or a drive.
    """
    target = target_of(task.configuration, place)
    notes = Notes()
    record = claim_record(target.parent, task.name, notes.started)
    with _kept(record, task, notes, consent):
        measured = _measure(task, notes, watcher, seed=terms.seed, target=None if terms.replace else target)
        result = notes.result = task.procedure.evaluate(measured)
    picture = _drawn(task, result, record)
    truth = task.offer.truth(task.configuration, task.request) if notes.in_lockstep else {}
    written = None
    if result.verdict.grade in terms.written:
        facts = provenance_of(task, notes, consent)
        facts |= {"seed": terms.seed, "record": record.relative_to(target.parent).as_posix()}
        written = deposit(target, task.name, result, facts, found=notes.drives, replace=terms.replace)
    return Outcome(result, truth, tuple(notes.words), record, picture, written)


def perform(task: Task, watcher: Watcher, *, seed: int = 0) -> tuple[Result, tuple[str, ...]]:
    """Do what is no calibration, such as a jog: no record, nothing written.

    Args:
        task: What to do.
        watcher: Is told how far it is.
        seed: Of the script's chance.

    Returns:
        The result, and what a person should know.

    Raises:
        LimitExceeded, TorqueRigError: As in `conduct`.
    """
    notes = Notes()
    measured = _measure(task, notes, watcher, seed=seed, target=None)
    return task.procedure.evaluate(measured), tuple(notes.words)


@contextmanager
def _kept(record: Path, task: Task, notes: Notes, consent: Consent) -> Iterator[None]:
    """Write the record of what is done inside, also when something ends it, which then matters more."""
    try:
        yield
    except BaseException as error:
        with undisturbed():
            try:
                write_record(record, task, notes, str(error) or type(error).__name__, consent)
            except RecordError as unwritten:
                error.add_note(str(unwritten))
        raise
    with undisturbed():
        write_record(record, task, notes, DONE, consent)


def _drawn(task: Task, result: Result, record: Path) -> Path:
    """The figure of a result."""
    picture = record / f"{task.name}.png"
    try:
        task.offer.draw(result, f"{task.name}: {result.verdict.grade.value}", picture)
    except OSError as error:
        raise RecordError(f"cannot write the figure {picture}: {error.strerror or error}") from error
    return picture


def _measure(task: Task, notes: Notes, watcher: Watcher, *, seed: int, target: Path | None) -> Any:  # noqa: ANN401
    """Open the bus, have the script done, and leave the drives disabled; or take what was measured before.

    What comes back is of the procedure's own type. With a target the drives must be those of what is there already.
    """
    if task.configuration.calibration is not None:
        notes.words.append(f"In force: the calibration {task.configuration.calibration}.")
    if task.recorded is not None:
        notes.drives = task.offer.drives(task.configuration, task.request)
        _require_same_drives(target, notes.drives)
        return task.recorded
    warm_up()
    with task.offer.open_rig(task.configuration, notes.bus_log) as rig:
        notes.in_lockstep = rig.is_simulated
        if not rig.is_simulated:
            notes.epoch_ns = time.time_ns() - rig.bus.now_ns()
        try:
            return _lead(task, rig, notes, watcher, seed=seed, target=target)
        finally:
            notes.truth = rig.truth()


def _lead(task: Task, rig: Rig, notes: Notes, watcher: Watcher, *, seed: int, target: Path | None) -> Any:  # noqa: ANN401
    settings = task.configuration.rig
    group = AxisGroup(rig.bus, axis_settings(task.configuration), group_settings(settings))
    watcher.advance(0.0, "configuring the drives")
    try:
        with no_collections(), real_time(0 if rig.is_simulated else settings.loop.fifo_priority) as how, group:
            if not rig.is_simulated:
                notes.words.append(f"The procedure ran under {how}.")
            _meet(task, group, notes, target)
            conductor = notes.conductor = Conductor(
                group,
                task.plan.bounds,
                period_ns=period_ns(settings),
                seed=seed,
                lasts=task.plan.lasts,
                watcher=watcher,
            )
            if task.procedure.start is Start.HOMED and group.home():
                notes.words.append("The drives took the pose of the home fixture for home.")
            if task.procedure.start is not Start.AS_FOUND:
                notes.words += group.enable()
            return task.procedure.measure(conductor)
    finally:
        notes.counters = {"frames": asdict(group.pump_counts), "cycles": asdict(group.cycle_counts)}


def _meet(task: Task, group: AxisGroup, notes: Notes, target: Path | None) -> None:
    """Note who the drives are, before they are enabled, and hold them against both calibrations.

    Raises:
        ConfigurationError: What is there was measured on other drives.
    """
    own = task.configuration
    notes.drives = drives_of(group, in_lockstep=notes.in_lockstep)
    _require_same_drives(target, notes.drives)
    any_drives = own.rig.calibration.any_drives
    notes.words += notes_on_loaded(own.calibration, own.provenance, notes.drives, any_drives=any_drives)


def _require_same_drives(target: Path | None, found: Drives | None) -> None:
    """See that what is in a calibration was measured on the same drives."""
    if target is not None and target.exists():
        refuse_others(target, read_calibration(target).provenance, found)
