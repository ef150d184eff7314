"""Conducting a procedure: the bus, the drives, the record, and the calibration that comes of it."""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from itertools import chain, count
from pathlib import Path
from typing import Any, Final, NamedTuple

from torquerig.assembly import Rig
from torquerig.axes import axis_settings, group_settings
from torquerig.building import period_ns
from torquerig.calibrating.deposit import Deposit, deposit, target_of
from torquerig.calibrating.offer import Offer, Request
from torquerig.calibration.conductor import Conductor
from torquerig.calibration.procedure import Grade, Plan, Procedure, Result, Start, Watcher
from torquerig.configuration import DEFAULT, Configuration
from torquerig.device_sim.plant import TruthRows
from torquerig.driver.errors import TorqueRigError
from torquerig.driver.master.group import AxisGroup
from torquerig.errors import RecordError
from torquerig.garbage import no_collections
from torquerig.mechanism import warm_up
from torquerig.record import BUS_FILE, RUN_FILE, TRUTH_FILE, BusLog, channel_name, claim, write_run, write_table
from torquerig.scheduling import real_time
from torquerig.stopping import undisturbed
from torquerig.truth import columns_of

DATA_FOLDER: Final = "calibration-data"
_IDENTITY: Final = 0x1018  # vendor, product, revision, serial number (CiA 301, 7.5.2.19)


class Consent(NamedTuple):
    """How somebody came to agree to a plan.

    Attributes:
        who: Who agreed, and how.
        command: What was called.
    """

    who: str
    command: str


@dataclass(frozen=True, slots=True)
class Task:
    """A procedure that is ready to be conducted.

    Attributes:
        name: The procedure's name.
        offer: The application's part of it.
        configuration: Of the rig.
        request: What was asked for.
        procedure: Made of the two.
        plan: What it will do.
    """

    name: str
    offer: Offer
    configuration: Configuration
    request: Request
    procedure: Procedure[Any]
    plan: Plan

    @classmethod
    def prepare(cls, name: str, offer: Offer, configuration: Configuration, request: Request) -> "Task":
        """Make the procedure, and have it plan; nothing is opened."""
        procedure = offer.make(configuration, request)
        return cls(name, offer, configuration, request, procedure, procedure.plan())


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


@dataclass(slots=True)
class _Notes:
    """What is known so far, for the record, whatever ends the procedure."""

    started: datetime = field(default_factory=lambda: datetime.now(UTC))
    bus_log: BusLog = field(default_factory=BusLog)
    words: list[str] = field(default_factory=list)
    drives: list[str] = field(default_factory=list)
    counters: dict[str, Any] = field(default_factory=dict)
    epoch_ns: int = 0
    truth: TruthRows | None = None
    is_simulated: bool = False
    conductor: Conductor | None = None
    result: Result | None = None


def conduct(
    task: Task, place: Path | None, consent: Consent, watcher: Watcher, *, seed: int = 0, accept: bool = False
) -> Outcome:
    """Run a procedure to its end, and keep what it leaves.

    Args:
        task: The procedure.
        place: The folder of the calibration; None: where the configuration's calibration is, or the current one.
        consent: Who agreed to the plan.
        watcher: Is told how far it is.
        seed: Of the script's chance.
        accept: Write a suspicious result into the calibration too.

    Returns:
        What it leaves.

    Raises:
        ConfigurationError: The calibration that is there cannot be read; nothing has moved.
        RecordError: A file cannot be written; if it is one of the folders, nothing has moved.
        LimitExceeded: A bound that was agreed to.
        TorqueRigError: The bus or a drive.
    """
    target = target_of(task.configuration, place)
    notes = _Notes()
    record = claim(_free(target.parent / DATA_FOLDER / f"{notes.started:%Y%m%dT%H%M%S}-{task.name}"))
    try:
        measured = _measure(task, notes, watcher, seed)
        notes.result = task.procedure.evaluate(measured)
    except BaseException as error:
        with undisturbed():
            try:
                _write_record(record, task, notes, str(error) or type(error).__name__, consent)
            except RecordError as unwritten:
                error.add_note(str(unwritten))
        raise
    with undisturbed():
        _write_record(record, task, notes, "done", consent)
    result = notes.result
    picture = record / f"{task.name}.png"
    try:
        task.offer.draw(result, f"{task.name}: {result.verdict.grade.value}", picture)
    except OSError as error:
        raise RecordError(f"cannot write the figure {picture}: {error.strerror or error}") from error
    truth = task.offer.truth(task.configuration, task.request) if notes.is_simulated else {}
    written = None
    if result.verdict.grade is Grade.OK or (accept and result.verdict.grade is Grade.SUSPICIOUS):
        where = record.relative_to(target.parent).as_posix()
        written = deposit(
            target, task.name, result, _provenance(task, notes, consent) | {"seed": seed, "record": where}
        )
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
    notes = _Notes()
    measured = _measure(task, notes, watcher, seed)
    return task.procedure.evaluate(measured), tuple(notes.words)


def _measure(task: Task, notes: _Notes, watcher: Watcher, seed: int) -> Any:  # noqa: ANN401  (the procedure's own)
    """Open the bus, have the script done, and leave the drives disabled; or take what was measured before."""
    if (found := task.offer.recorded(task.configuration, task.request)) is not None:
        return found
    warm_up()
    with task.offer.open_rig(task.configuration, notes.bus_log.tap) as rig:
        notes.is_simulated = rig.is_simulated
        if not rig.is_simulated:
            notes.epoch_ns = time.time_ns() - rig.bus.now_ns()
        try:
            return _lead(task, rig, notes, watcher, seed)
        finally:
            notes.truth = rig.truth()


def _lead(task: Task, rig: Rig, notes: _Notes, watcher: Watcher, seed: int) -> Any:  # noqa: ANN401
    settings = task.configuration.rig
    group = AxisGroup(rig.bus, axis_settings(task.configuration), group_settings(settings))
    watcher.advance(0.0, "configuring the drives")
    try:
        with no_collections(), real_time(0 if rig.is_simulated else settings.loop.fifo_priority) as how, group:
            if not rig.is_simulated:
                notes.words.append(f"The procedure ran under {how}.")
            notes.drives = _identities(group)
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


def _identities(group: AxisGroup) -> list[str]:
    """Who the drives are, a sentence each (object 1018); a drive without a serial number has none."""
    words = []
    for axis in group.axes:
        parts = []
        for subindex, name in enumerate(("vendor", "product", "revision", "serial number"), start=1):
            try:
                parts.append(f"{name} {group.read(axis.node_id, _IDENTITY, subindex)!r}")
            except TorqueRigError:
                continue
        words.append(f"node {axis.node_id}: {', '.join(parts) or 'without identity'}")
    return words


def _free(place: Path) -> Path:
    """The place, or with the first number behind it that is free."""
    numbered = (place.with_name(f"{place.name}-{number}") for number in count(2))
    return next(each for each in chain([place], numbered) if not each.exists())


def _provenance(task: Task, notes: _Notes, consent: Consent) -> dict[str, Any]:
    """How a result came about."""
    assert notes.result is not None  # noqa: S101  (only a result is deposited)
    return {
        "date": notes.started.isoformat(timespec="seconds"),
        "verdict": notes.result.verdict.grade.value,
        "command": consent.command,
        "agreed": consent.who,
        "torquerig": version("torquerig"),
        "bus": task.configuration.rig.bus.url,
        "simulated": notes.is_simulated,
        "drives": notes.drives,
    }


def _write_record(place: Path, task: Task, notes: _Notes, how_it_ended: str, consent: Consent) -> None:
    """Write what there is, the cycles first: it may be the only trace of what went wrong.

    Raises:
        RecordError: Some of it cannot be written; what can be is.
    """
    result, conductor = notes.result, notes.conductor
    facts = {
        "procedure": task.name,
        "started": notes.started.isoformat(),
        "ended": how_it_ended,
        "time_zero_ns": notes.epoch_ns,
        "command": consent.command,
        "agreed": consent.who,
        "axis": task.request.axis,
        "options": dict(task.request.options),
        "bounds": asdict(task.plan.bounds),
        "notes": notes.words,
        "drives": notes.drives,
        "counters": notes.counters,
        "stretches": conductor.notebook.stretches if conductor else [],
        "verdict": result and asdict(result.verdict) | {"grade": result.verdict.grade.value},
        "result": result and dict(result.facts),
        "configuration": task.configuration.as_tables(),
        "sources": {each.key: each.source for each in task.configuration.settings if each.source != DEFAULT},
    }
    tables = [*([conductor.notebook.table()] if conductor else []), *(result.tables if result else ())]
    writes = [partial(write_table, place / f"{table.name}.parquet", table.columns) for table in tables]
    if notes.truth is not None:
        writes.append(partial(write_table, place / TRUTH_FILE, columns_of(notes.truth)))
    channel = channel_name(task.configuration.rig.bus.url)
    writes.append(partial(notes.bus_log.write, place / BUS_FILE, channel, notes.epoch_ns))
    writes.append(partial(write_run, place / RUN_FILE, facts))
    unwritten = []
    for write in writes:
        try:
            write()
        except OSError as error:
            unwritten.append(str(error))
    if unwritten:
        raise RecordError("; ".join(unwritten))
