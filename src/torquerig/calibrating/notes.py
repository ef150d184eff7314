"""What a procedure leaves, whatever ends it: its record, and where its values come from."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from itertools import chain, count
from pathlib import Path
from typing import Any, Final

from torquerig.buses import bus_urls, channel_names, words_for
from torquerig.calibrating.task import Consent, Task
from torquerig.calibration.conductor import Conductor
from torquerig.calibration.procedure import Result
from torquerig.configuration import DEFAULT
from torquerig.device_sim.plant import TruthRows
from torquerig.errors import RecordError
from torquerig.provenance import Drives
from torquerig.record import BUS_FILE, RUN_FILE, TRUTH_FILE, BusLog, claim, write_run, write_table
from torquerig.truth import columns_of

DATA_FOLDER: Final = "calibration-data"


@dataclass(slots=True)
class Notes:
    """What is known of a procedure so far, for its record, whatever ends it.

    Attributes:
        started: When it began.
        bus_log: Every frame.
        words: What a person should know.
        drives: Whom it was measured on; None where nobody knows, or not yet.
        counters: What the driver counted.
        epoch_ns: What the bus clock's zero is since 1970; 0 in simulated time.
        truth: What the simulated machine really did.
        in_lockstep: Whether the drives are simulated in this process.
        conductor: With the cycles.
        result: What it brought.
    """

    started: datetime = field(default_factory=lambda: datetime.now(UTC))
    bus_log: BusLog = field(default_factory=BusLog)
    words: list[str] = field(default_factory=list)
    drives: Drives | None = None
    counters: dict[str, Any] = field(default_factory=dict)
    epoch_ns: int = 0
    truth: TruthRows | None = None
    in_lockstep: bool = False
    conductor: Conductor | None = None
    result: Result | None = None


def claim_record(folder: Path, name: str, started: datetime) -> Path:
    """Make the folder of a procedure's record, which no other procedure has.

    Args:
        folder: Where the calibration is.
        name: The procedure.
        started: When it began.

    Returns:
        The folder, empty: its name is the time and the procedure, with a number where that is taken.

    Raises:
        RecordError: It cannot be made.
    """
    first = folder / DATA_FOLDER / f"{started:%Y%m%dT%H%M%S}-{name}"
    return claim(next(filter(_is_made, _numbered(first)), first))


def provenance_of(task: Task, notes: Notes, consent: Consent) -> dict[str, Any]:
    """How a result came about; of which drives it is stands beside it."""
    assert notes.result is not None  # noqa: S101  (only a result is deposited)
    return {
        "date": notes.started.isoformat(timespec="seconds"),
        "verdict": notes.result.verdict.grade.value,
        "command": consent.command,
        "agreed": consent.who,
        "torquerig": version("torquerig"),
        "bus": words_for(bus_urls(task.configuration.rig)),
    }


def write_record(place: Path, task: Task, notes: Notes, how_it_ended: str, consent: Consent) -> None:
    """Write what there is, the cycles first: it may be the only trace of what went wrong.

    Args:
        place: The record's folder.
        task: The procedure.
        notes: What is known of it.
        how_it_ended: "done", or the sentence of what ended it.
        consent: Who agreed.

    Raises:
        RecordError: Some of it cannot be written; what can be is.
    """
    result, conductor = notes.result, notes.conductor
    tables = [*([conductor.notebook.table()] if conductor else []), *(result.tables if result else ())]
    writes = [partial(write_table, place / f"{table.name}.parquet", table.columns) for table in tables]
    if notes.truth is not None:
        writes.append(partial(write_table, place / TRUTH_FILE, columns_of(notes.truth)))
    channel, *others = channel_names(bus_urls(task.configuration.rig))
    writes.append(partial(notes.bus_log.write, place / BUS_FILE, channel, notes.epoch_ns, others))
    writes.append(partial(write_run, place / RUN_FILE, _facts(task, notes, how_it_ended, consent)))
    unwritten = []
    for write in writes:
        try:
            write()
        except OSError as error:
            unwritten.append(str(error))
    if unwritten:
        raise RecordError("; ".join(unwritten))


def _facts(task: Task, notes: Notes, how_it_ended: str, consent: Consent) -> dict[str, Any]:
    """What run.json tells."""
    result, conductor = notes.result, notes.conductor
    return {
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
        **(notes.drives.facts() if notes.drives else {}),
        "counters": notes.counters,
        "stretches": conductor.notebook.stretches if conductor else [],
        "verdict": result and asdict(result.verdict) | {"grade": result.verdict.grade.value},
        "result": result and dict(result.facts),
        "configuration": task.configuration.as_tables(),
        "sources": {each.key: each.source for each in task.configuration.settings if each.source != DEFAULT},
    }


def _numbered(place: Path) -> Iterator[Path]:
    """The place, and others with numbers behind its name."""
    return chain([place], (place.with_name(f"{place.name}-{number}") for number in count(2)))


def _is_made(place: Path) -> bool:
    """Whether a folder is new and ours; also when it cannot be made at all, for reasons that `claim` tells."""
    try:
        place.mkdir(parents=True)
    except FileExistsError:
        return False
    except OSError:
        return True
    return True
