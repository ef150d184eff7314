"""Records read back: what `record` and `results` have written, as the objects that it was written from."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from torquerig.configuration import checked
from torquerig.control import log as loop_log
from torquerig.control.log import LoopLog
from torquerig.device_sim.plant import TruthRows
from torquerig.errors import ConfigurationError, RecordError
from torquerig.provenance import Drives, drives_told
from torquerig.record import BUS_FILE, CYCLES_FILE, DONE, FORMAT, RUN_FILE, SIM, TRUTH_FILE
from torquerig.scheduling import Step
from torquerig.schema import Rig
from torquerig.summary import Summary
from torquerig.truth import at_instants, rows_of
from torquerig.truth import column_units as truth_units

Columns = Mapping[str, NDArray[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class RecordedRun:
    """A record: of a run, stopped or not, or of simulated drives.

    Attributes:
        place: Its folder.
        kind: `record.RUN` or `record.SIM`.
        started: When it began.
        ended: "done", or the sentence of what ended it; simulated drives always end by being stopped.
        time_zero_ns: What the zero of the record's clock is since 1970; 0 in simulated time.
        notes: What a person should know.
        counters: What was counted, by group and name: by the driver, or by the simulated drives.
        summary: The numbers of a run; None before its loop began, and of simulated drives.
        configuration: The whole configuration as nested tables.
        sources: Who set each value that is not a default, by dotted key.
        versions: Versions of what took part.
        planned_cycles: Cycles that the loop was to have; 0 where there was none.
        log: The loop's cycles, on the record's clock; None where there was no loop.
        truth: What the simulated machine really did, on the record's clock; None where nobody knew.
        real_time: The steps of the real-time set-up; none in simulated time, and in older records.
        drives: Who the drives were; None where nobody asked them, and in older records.
    """

    place: Path
    kind: str
    started: datetime
    ended: str
    time_zero_ns: int
    notes: tuple[str, ...]
    counters: Mapping[str, Mapping[str, Any]]
    summary: Summary | None
    configuration: Mapping[str, Any]
    sources: Mapping[str, str]
    versions: Mapping[str, str]
    planned_cycles: int
    log: LoopLog | None
    truth: TruthRows | None
    real_time: tuple[Step, ...] = ()
    drives: Drives | None = None

    @property
    def is_done(self) -> bool:
        """Whether this is a run that nothing stopped."""
        return self.ended == DONE

    @property
    def bus_log(self) -> Path:
        """The file of its frames."""
        return self.place / BUS_FILE

    def cycles(self, *, whole: bool = False) -> LoopLog:
        """The cycles of the loop.

        Args:
            whole: Whether a run that was stopped will not do.

        Returns:
            One row a cycle, at least one: times, measured, commanded and desired values, and `in_motion`.

        Raises:
            RecordError: There are none, or the run was stopped.
        """
        if self.kind == SIM:
            raise RecordError(f"{self.place} is a record of simulated drives: it has no cycles of a loop")
        if self.log is None or not self.log.rows:
            raise RecordError(f"{self.place} has no cycles: the run ended before the first one ({self.ended})")
        if whole and not self.is_done:
            raise RecordError(
                f"the run of {self.place} was stopped after {self.log.rows} of {self.planned_cycles} cycles"
                f" ({self.ended}): a whole one is needed"
            )
        return self.log

    def stamps_ns(self) -> NDArray[np.int64]:
        """When each cycle was due, on the clock that stamps the frames of bus.log, shape (rows,) [ns]."""
        log = self.cycles()
        stamps: NDArray[np.int64] = self.time_zero_ns + log.start_ns + log.due_ns[: log.rows]
        return stamps

    def true_positions(self) -> NDArray[np.float64] | None:
        """True positions when each cycle was due, shape (rows, 2) [m]; None where nobody knew."""
        if self.log is None or self.truth is None:
            return None
        return at_instants(self.truth, self.log.start_ns + self.log.due_ns[: self.log.rows])

    def rig(self) -> Rig:
        """The configuration as checked values.

        Raises:
            RecordError: It is not one of this version.
        """
        try:
            return checked(self.configuration)
        except ConfigurationError as error:
            raise RecordError(f"the configuration in {self.place / RUN_FILE} is not this version's: {error}") from None


def open_record(folder: str | Path) -> RecordedRun:
    """Read a record.

    Args:
        folder: Its folder, as `torquerig run --record` or `torquerig sim --record` has written it.

    Returns:
        Everything in it but the frames.

    Raises:
        RecordError: The folder is no record, of another format, or something in it is missing or damaged.
    """
    place = Path(folder)
    facts = _read_facts(place)
    try:
        return _recorded(place, facts)
    except KeyError as error:
        raise RecordError(f"{place / RUN_FILE} is damaged: {error.args[0]} is missing in it") from None
    except (TypeError, ValueError, AttributeError) as error:
        raise RecordError(f"{place / RUN_FILE} is damaged: {error}") from error


def _recorded(place: Path, facts: Mapping[str, Any]) -> RecordedRun:
    """The record that a run.json and the tables beside it make."""
    loop, summary = facts.get("loop"), facts.get("summary")
    is_simulator = facts["kind"] == SIM
    has_truth = is_simulator or (place / TRUTH_FILE).exists()
    return RecordedRun(
        place=place,
        kind=facts["kind"],
        started=datetime.fromisoformat(facts["started"]),
        ended="stopped" if is_simulator else facts["ended"],
        time_zero_ns=facts["time_zero_ns"],
        notes=tuple(facts.get("notes", ())),
        counters={"simulator": {"lost_frames": facts["lost_frames"]}} if is_simulator else facts["counters"],
        summary=summary and Summary.from_json(summary),
        configuration=facts["configuration"],
        sources=facts.get("sources", {}),
        versions=facts["versions"],
        planned_cycles=loop["planned_cycles"] if loop else 0,
        log=_read_cycles(place, loop["start_ns"], loop["period_ns"]) if loop else None,
        truth=rows_of(_read_table(place / TRUTH_FILE, truth_units())) if has_truth else None,
        real_time=tuple(Step(**step) for step in facts.get("real_time", ())),
        drives=drives_told(facts),
    )


def _read_facts(place: Path) -> Mapping[str, Any]:
    """What run.json says, if it is one that this version understands."""
    path = place / RUN_FILE
    if not place.is_dir():
        raise RecordError(f"there is no folder {place}: a record is a folder, as run --record writes it")
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise RecordError(f"{place} is no record: there is no {RUN_FILE} in it") from None
    except OSError as error:
        raise RecordError(f"cannot read {path}: {error.strerror}") from error
    except ValueError as error:
        raise RecordError(f"{path} is damaged: it is not JSON ({error})") from error
    if not isinstance(facts, dict):
        raise RecordError(f"{path} is damaged: it does not hold an object")
    if facts.get("format") != FORMAT:
        raise RecordError(
            f"{place} is of format {facts.get('format', 0)}, and this version reads format {FORMAT}: record it again,"
            " or read it with the version that its run.json names"
        )
    return facts


def _read_cycles(place: Path, start_ns: int, period_ns: int) -> LoopLog:
    """The loop's log."""
    optional = loop_log.column_units(optional=True)
    columns = _read_table(place / CYCLES_FILE, loop_log.column_units(optional=False), optional)
    return LoopLog.from_columns(columns, start_ns=start_ns, period_ns=period_ns)


def _read_table(path: Path, units: Mapping[str, str], optional: Mapping[str, str] | None = None) -> Columns:
    """The columns of a Parquet file, all that are expected, in the units expected.

    Args:
        path: The file.
        units: Names of the columns and their units.
        optional: Those of columns that older files do not have.

    Raises:
        RecordError: The file or a column is missing, damaged, or in another unit.
    """
    import pyarrow as pa  # noqa: PLC0415  (takes half a second, and only records need it)
    import pyarrow.parquet as pq  # noqa: PLC0415

    try:
        table = pq.read_table(path)
    except FileNotFoundError:
        raise RecordError(f"{path} is missing") from None
    except (OSError, pa.ArrowException) as error:
        raise RecordError(f"{path} is damaged: it is not a Parquet file ({error})".replace("\n", " ")) from error
    present = {name: unit for name, unit in (optional or {}).items() if name in table.column_names}
    expected = {**units, **present}
    for name, unit in expected.items():
        if name not in table.column_names:
            raise RecordError(f"{path} has no column {name}")
        told = (table.schema.field(name).metadata or {}).get(b"unit", b"?").decode()
        if told != unit:
            raise RecordError(f"{path}: column {name} is in {told!r}, it must be in {unit!r}")
    return {name: table[name].to_numpy() for name in expected}
