"""The effective configuration: the shipped one, over it a user's file, a calibration, the command line."""

import copy
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from torquerig.calibrated import read_calibration
from torquerig.complaints import complaint
from torquerig.consistency import check
from torquerig.errors import ConfigurationError
from torquerig.schema import Rig
from torquerig.schema_values import CIRCLE, CORNER
from torquerig.toml_text import Place, places

DEFAULT: Final = "default"
CALIBRATION_KEY: Final = "calibration.file"
OPTIONS: Final = "options"


@dataclass(frozen=True, slots=True)
class Setting:
    """One value of the effective configuration.

    Attributes:
        key: Its dotted key, as `loop.rate_hz`.
        value: Its value.
        source: Who set it: "default", "FILE:LINE" (of a calibration with the procedure), or who gave the options.
        default: The shipped value; None for a key that is not shipped.
        note: Unit, meaning and source, as the shipped file comments it.
    """

    key: str
    value: object
    source: str
    default: object
    note: str


@dataclass(frozen=True, slots=True)
class Configuration:
    """A checked configuration and where it comes from.

    Attributes:
        rig: The values.
        simulated: The values without those of a calibration: what is true of what is simulated does not follow what
            was measured of it.
        settings: Every value with its source, in the shipped file's order.
        calibration: The calibration that was read; None for none.
        provenance: Its tables of provenance: on which drives it was measured.
    """

    rig: Rig
    simulated: Rig
    settings: tuple[Setting, ...]
    calibration: Path | None = None
    provenance: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def as_tables(self) -> dict[str, Any]:
        """The configuration as nested tables, as TOML and JSON write it."""
        return self.rig.model_dump(mode="json", by_alias=True, exclude_none=True)


def load_configuration(
    path: str | Path | None = None, options: Mapping[str, object] | None = None, *, origin: str = OPTIONS
) -> Configuration:
    """Read, merge and check a configuration.

    Args:
        path: A TOML file that says what differs from the shipped configuration.
        options: Values by dotted key that win over the file, as {"loop.law": "coupled-pd"}.
        origin: Who gives the options, in messages and sources.

    Returns:
        The effective configuration.

    Raises:
        ConfigurationError: If the file cannot be read, a key is unknown, or a value is out of range: names table.key.
    """
    shipped = files("torquerig").joinpath("rig.toml").read_text(encoding="utf-8")
    tables = tomllib.loads(shipped)
    notes = places(shipped)
    defaults = dict(_leaves(tables))
    sources: dict[str, str] = {}
    if path is not None:
        text, own = _read(Path(path))
        _locate_trajectory(own, Path(path).parent)
        _merge(tables, own)
        sources |= _file_sources(Path(path), own, places(text))
    uncalibrated = copy.deepcopy(tables)
    calibration, provenance = _calibrate(tables, sources, None if path is None else Path(path), options or {})
    for key, value in (options or {}).items():
        _put(tables, key, value)
        _put(uncalibrated, key, value)
        sources[key] = origin
    rig = _validate(tables, sources)
    simulated = rig if calibration is None else _validate(uncalibrated, sources)
    settings = tuple(
        Setting(key, value, sources.get(key, DEFAULT), defaults.get(key), notes[key].comment if key in notes else "")
        for key, value in _leaves(tables)
    )
    return Configuration(rig, simulated, settings, calibration, provenance)


def checked(tables: Mapping[str, Any]) -> Rig:
    """The values of a whole configuration that is there as tables, as a record keeps it.

    Args:
        tables: Nested tables, as `Configuration.as_tables` gives them.

    Returns:
        The values.

    Raises:
        ConfigurationError: If a key is unknown or missing, or a value is out of range: names table.key.
    """
    return _validate(dict(tables), {})


def _read(path: Path) -> tuple[str, dict[str, Any]]:
    """The text and the tables of a user's file."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(f"cannot read the configuration {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"the configuration {path} is not UTF-8 text (byte {error.start})") from error
    try:
        return text, tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"the configuration {path} is not TOML: {error}") from error


def _locate_trajectory(own: Mapping[str, Any], folder: Path) -> None:
    """Let a user's file name a trajectory beside itself, wherever it is read from."""
    loop = own.get("loop")
    motion = loop.get("motion") if isinstance(loop, dict) else None
    if isinstance(loop, dict) and isinstance(motion, str) and motion not in {CIRCLE, CORNER}:
        loop["motion"] = str(folder / motion)


def _merge(tables: dict[str, Any], own: Mapping[str, Any]) -> None:
    """Put a user's tables over others, table by table."""
    for key, value in own.items():
        inner = tables.get(key)
        if isinstance(inner, dict) and isinstance(value, dict):
            _merge(inner, value)
        else:
            tables[key] = copy.deepcopy(value)


def _calibrate(
    tables: dict[str, Any], sources: dict[str, str], path: Path | None, options: Mapping[str, object]
) -> tuple[Path | None, Mapping[str, Mapping[str, Any]]]:
    """Put the values of `calibration.file` over others; which it is, relative to who names it, and its provenance."""
    named = options.get(CALIBRATION_KEY)
    place = Path()
    if named is None:
        table = tables["calibration"]
        named = table.get("file") if isinstance(table, dict) else None
        place = Path() if path is None else path.parent
    if not named or not isinstance(named, str):
        return None, {}
    calibration = read_calibration(place / named)
    for key, value in calibration.settings.items():
        _put(tables, key, value)
    sources |= calibration.sources
    return place / named, calibration.provenance


def _put(tables: dict[str, Any], key: str, value: object) -> None:
    """Set one value by its dotted key."""
    *path, name = key.split(".")
    for part in path:
        tables = tables.setdefault(part, {})
    tables[name] = value


def _leaves(tables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Every value with its dotted key."""
    for key, value in tables.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _file_sources(path: Path, own: Mapping[str, Any], found: Mapping[str, Place]) -> dict[str, str]:
    """Where in a user's file each of its keys and tables stands."""
    sources = {table: f"{path}:{place.line}" for table, place in found.items()}
    for key, _ in _leaves(own):
        sources.setdefault(key, str(path))
    return sources


def _validate(tables: dict[str, Any], sources: Mapping[str, str]) -> Rig:
    """The checked values, or one sentence that says whose they are and what is wrong."""
    try:
        rig = Rig.model_validate(_frozen(tables))
    except ValidationError as error:
        key, sentence = complaint(error, tables)
        raise ConfigurationError(_from(key, sources) + sentence) from None
    for problem in check(rig):
        raise ConfigurationError(_from(problem.key, sources) + problem.sentence)
    return rig


def _from(key: str, sources: Mapping[str, str]) -> str:
    """The beginning of a message about a key: who set it, or its table; empty for a default."""
    while key:
        if key in sources:
            return f"{sources[key]}: "
        key = key.rpartition(".")[0]
    return ""


def _frozen(value: object) -> Any:  # noqa: ANN401  (TOML's values are of any type)
    """Tables and lists with every list turned into a tuple, as the strict models want it."""
    match value:
        case dict():
            return {key: _frozen(inner) for key, inner in value.items()}
        case list():
            return tuple(map(_frozen, value))
        case _:
            return value
