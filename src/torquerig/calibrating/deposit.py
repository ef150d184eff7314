"""Writing calibration.toml: what was there stays unless it was measured anew, and the old file is kept beside it."""

import fcntl
import os
import re
import time
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from torquerig.calibrated import (
    CALIBRATION_FILE,
    MEASURED,
    PROVENANCE,
    RUN_OF,
    Calibration,
    procedure_of,
    read_calibration,
    require_known,
)
from torquerig.calibration.procedure import Estimate, Result
from torquerig.configuration import Configuration
from torquerig.errors import RecordError
from torquerig.provenance import Drives, refuse_others
from torquerig.stopping import undisturbed
from torquerig.toml_text import write, write_key

_HEAD: Final = """\
# What was calibrated on this rig. `torquerig calibrate` writes it; `--calibration FILE`, or file under [calibration] in
# the configuration, loads it. [measured] and [provenance] are for people: how well, when and on what it was measured.
"""
_EMPTY: Final = Calibration({}, {}, {}, {})
PATIENCE: Final = 10.0
"""How long another procedure may take to write [s]; our choice: it needs some milliseconds."""
_ASK_AGAIN: Final = 0.05


class Deposit(NamedTuple):
    """What was written.

    Attributes:
        path: The calibration.
        kept: The one that was there before, under its new name; None if there was none.
    """

    path: Path
    kept: Path | None


def target_of(configuration: Configuration, place: Path | None) -> Path:
    """Where a result will be written, seen to be possible before anything moves.

    Args:
        configuration: Of the rig.
        place: The folder of the calibration; None: where the configuration's calibration is, or the current one.

    Returns:
        The calibration, which need not be there.

    Raises:
        ConfigurationError: The calibration that is there cannot be read.
        RecordError: What it says cannot be written again, or nothing can be written into its folder.
    """
    path = configuration.calibration or Path(CALIBRATION_FILE)
    if place is not None:
        path = place / CALIBRATION_FILE
    if path.exists():
        _text_for(path, read_calibration(path))
    there = next(folder for folder in path.absolute().parents if folder.exists())
    if not there.is_dir():
        raise RecordError(f"cannot write the calibration {path}: {there} is no folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise RecordError(f"cannot write the calibration {path}: there is no permission to write into {there}")
    return path


def deposit(
    path: Path,
    name: str,
    result: Result,
    provenance: Mapping[str, Any],
    *,
    found: Drives | None = None,
    replace: bool = False,
) -> Deposit:
    """Write a procedure's result into a calibration.

    There is always a whole calibration under the path, and who writes into one folder does so one after the other.

    Args:
        path: The calibration, which need not be there.
        name: The procedure.
        result: What it brought.
        provenance: Facts about how.
        found: The drives that it was measured on; None where nobody knows.
        replace: Begin anew, and only keep the old calibration beside the new one.

    Returns:
        What was written, and what was kept.

    Raises:
        ConfigurationError: The calibration that is there cannot be read or is of other drives, or the result sets what
            it must not.
        RecordError: It cannot be written.
    """
    facts = {**provenance, **(found.facts() if found else {})}
    try:
        with undisturbed(), _alone(path.parent):
            old = read_calibration(path) if path.exists() and not replace else _EMPTY
            refuse_others(path, old.provenance, found)
            return Deposit(path, _replace(path, _text_for(path, _merged(old, name, result, facts))))
    except RecordError:
        raise
    except OSError as error:
        raise RecordError(f"cannot write the calibration {path}: {error.strerror}") from error


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Be the only one who writes a calibration in a folder.

    Raises:
        RecordError: Another one does, for long.
    """
    held = os.open(folder, os.O_RDONLY)
    try:
        give_up = time.monotonic() + PATIENCE
        while not _is_locked(held):
            if time.monotonic() >= give_up:
                raise RecordError(
                    f"another procedure has been writing into {folder} for {PATIENCE:g} s: see what it does"
                )
            time.sleep(_ASK_AGAIN)
        yield
    finally:
        os.close(held)


def _is_locked(held: int) -> bool:
    """Whether an open folder is ours now."""
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks, such as some of the network: there one has to take care oneself
        return True
    return True


def _merged(old: Calibration, name: str, result: Result, facts: Mapping[str, Any]) -> Calibration:
    """A calibration with a result over what was there.

    A run of a procedure keeps its tables as long as a value of it is in force: under the procedure's name the last one,
    older ones with their date.

    Raises:
        ConfigurationError: The result sets what it must not.
    """
    for key in result.settings:
        require_known(key, f"procedure {name}")
    measured, provenance = dict(old.measured), {}
    for run, before in old.provenance.items():
        told = before.get("set", [])
        kept = [key for key in told if key not in result.settings] if isinstance(told, list) else told
        values = measured.pop(run, None)
        if procedure_of(run) == name and not kept:
            continue
        as_name = f"{name}{RUN_OF}{before.get('date', '')}" if run == name else run
        provenance[as_name] = {**before, **({"set": kept} if "set" in before else {})}
        if values is not None:
            measured[as_name] = values
    measured[name] = {each.name: _listed(each) for each in result.estimates}
    provenance[name] = {**facts, "set": list(result.settings)}
    return Calibration(old.settings | dict(result.settings), {}, measured, provenance)


def _text_for(path: Path, calibration: Calibration) -> str:
    """The text of a calibration, seen to be TOML in UTF-8.

    Raises:
        RecordError: It is not, as of a value that TOML does not have.
    """
    try:
        text = _text(calibration)
        tomllib.loads(text)
        text.encode("utf-8")
    except ValueError as error:
        raise RecordError(f"cannot write the calibration {path}, which is as it was: {error}") from error
    return text


def _replace(path: Path, text: str) -> Path | None:
    """Put a text in the place of a file, which is kept under the next free number."""
    fresh = path.with_name(f".{path.name}.{os.getpid()}.new")
    try:
        with fresh.open("w", encoding="utf-8", newline="\n") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        kept = _keep(path, _next_number(path)) if path.exists() else None
        fresh.replace(path)
    except OSError:
        with suppress(OSError):
            fresh.unlink(missing_ok=True)
        raise
    return kept


def _keep(path: Path, number: int) -> Path:
    """Give a file a second name, with this number or the next that is free; what is there is left alone."""
    kept = path.with_name(f"{path.name}.{number}")
    try:
        os.link(path, kept)
    except FileExistsError:
        return _keep(path, number + 1)
    except OSError:  # a file system on which a file has one name only
        with kept.open("xb") as copy:
            copy.write(path.read_bytes())
    return kept


def _next_number(path: Path) -> int:
    """One more than the number of the last file that was kept."""
    numbered = re.compile(re.escape(path.name) + r"\.(\d+)")
    taken = [int(match[1]) for each in path.parent.iterdir() if (match := numbered.fullmatch(each.name))]
    return max(taken, default=0) + 1


def _listed(estimate: Estimate) -> list[object]:
    return [estimate.value, estimate.low, estimate.high, estimate.unit]


def _text(calibration: Calibration) -> str:
    """A calibration as TOML."""
    tables: dict[str, dict[str, object]] = {}
    for key, value in calibration.settings.items():
        table, _, name = key.rpartition(".")
        tables.setdefault(table, {})[name] = value
    blocks = [_HEAD, *(_block(table, tables[table]) for table in sorted(tables))]
    for title, groups in ((MEASURED, calibration.measured), (PROVENANCE, calibration.provenance)):
        for name, values in groups.items():
            note = "  # value, low, high (95 %), unit" if title == MEASURED else ""
            blocks.append(_block(f"{title}.{write_key(name)}", values, note))
    return "\n".join(blocks)


def _block(header: str, values: Mapping[str, object], note: str = "") -> str:
    return "\n".join([f"[{header}]{note}", *_lines(values), ""])


def _lines(values: Mapping[str, object]) -> Iterator[str]:
    for name, value in values.items():
        yield f"{write_key(name)} = {write(_plain(value))}"


def _plain(value: object) -> object:
    """A value without numpy's types, whose text is not TOML's."""
    match value:
        case np.generic() | np.ndarray():
            return value.tolist()
        case list() | tuple():
            return [_plain(each) for each in value]
        case Mapping():
            return {key: _plain(each) for key, each in value.items()}
        case _:
            return value
