"""Writing calibration.toml: what was there stays unless it was measured anew, and the old file is kept beside it."""

import os
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from torquerig.calibrated import CALIBRATION_FILE, MEASURED, PROVENANCE, Calibration, read_calibration, require_known
from torquerig.calibration.procedure import Estimate, Result
from torquerig.configuration import Configuration
from torquerig.errors import RecordError
from torquerig.stopping import undisturbed
from torquerig.toml_text import write, write_key

_HEAD: Final = """\
# What was calibrated on this rig. `torquerig calibrate` writes it; `--calibration FILE`, or file under [calibration] in
# the configuration, loads it. [measured] and [provenance] are for people: how well, when and on what it was measured.
"""
_EMPTY: Final = Calibration({}, {}, {}, {})


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


def deposit(path: Path, name: str, result: Result, provenance: Mapping[str, Any]) -> Deposit:
    """Write a procedure's result into a calibration.

    At any moment there is a whole calibration under the path, the old one or the new one.

    Args:
        path: The calibration, which need not be there.
        name: The procedure.
        result: What it brought.
        provenance: Facts about how.

    Returns:
        What was written, and what was kept.

    Raises:
        ConfigurationError: The calibration that is there cannot be read, or the result sets what it must not.
        RecordError: It cannot be written.
    """
    for key in result.settings:
        require_known(key, f"procedure {name}")
    old = read_calibration(path) if path.exists() else _EMPTY
    new = Calibration(
        old.settings | dict(result.settings),
        {},
        old.measured | {name: {each.name: _listed(each) for each in result.estimates}},
        old.provenance | {name: {**provenance, "set": list(result.settings)}},
    )
    text = _text_for(path, new)
    try:
        with undisturbed():
            return Deposit(path, _replace(path, text))
    except OSError as error:
        raise RecordError(f"cannot write the calibration {path}: {error.strerror}") from error


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
    fresh = path.with_name(f".{path.name}.new")
    try:
        with fresh.open("w", encoding="utf-8", newline="\n") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        kept = None
        if path.exists():
            kept = path.with_name(f"{path.name}.{_next_number(path)}")
            kept.write_bytes(path.read_bytes())
        fresh.replace(path)
    except OSError:
        with suppress(OSError):
            fresh.unlink(missing_ok=True)
        raise
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
