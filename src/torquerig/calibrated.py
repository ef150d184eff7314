"""calibration.toml: what was measured on a rig and wins over its configuration.

Its tables are those of the configuration, with the keys of `KEYS` only; and, for people, [measured.NAME] with every
value of a procedure, its interval and unit, and [provenance.NAME]: when, how and on which drives it was measured.
"""

import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

from torquerig.errors import ConfigurationError
from torquerig.toml_text import Place, places

CALIBRATION_FILE: Final = "calibration.toml"
MEASURED: Final = "measured"
PROVENANCE: Final = "provenance"
RUN_OF: Final = " of "
"""Between the name of a procedure and the date of a run of it that was not its last one."""
KEYS: Final = (
    r"axes\.[123]\.(sign|encoder_zero|counts_per_nm_positive|counts_per_nm_negative)",
    r"model\.(link_length|bases|actuator_inertia|active_viscous|passive_viscous|active_coulomb)",
    r"latency\.(sample|reaction|current_lag)",
)
"""Which keys of the configuration calibration.toml may set, as regular expressions."""
_KNOWN: Final = re.compile("|".join(KEYS))


class Calibration(NamedTuple):
    """A calibration.toml that was read.

    Attributes:
        settings: Values by dotted key of the configuration.
        sources: Where each of them stands and what measured it, as "calibration.toml:3 (direction, 2026-11-22)".
        measured: Tables of [measured] by procedure.
        provenance: Tables of [provenance] by procedure.
    """

    settings: dict[str, object]
    sources: dict[str, str]
    measured: dict[str, dict[str, Any]]
    provenance: dict[str, dict[str, Any]]


def read_calibration(path: Path) -> Calibration:
    """Read a calibration.toml.

    Args:
        path: The file.

    Returns:
        What it says.

    Raises:
        ConfigurationError: If it cannot be read, or sets a key that is not for calibration.
    """
    try:
        text = path.read_text(encoding="utf-8")
        tables = tomllib.loads(text)
    except OSError as error:
        raise ConfigurationError(f"cannot read the calibration {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"the calibration {path} is not UTF-8 text (byte {error.start})") from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"the calibration {path} is not TOML: {error}") from error
    measured = _tables(path, tables, MEASURED)
    provenance = _tables(path, tables, PROVENANCE)
    settings = dict(_leaves(tables))
    stand = places(text)
    for key in settings:
        require_known(key, f"{path}{_line(stand, key)}")
    sources = {key: f"{path}{_line(stand, key)}{_origin(key, provenance)}" for key in settings}
    return Calibration(settings, sources, measured, provenance)


def require_known(key: str, whose: str) -> None:
    """See that a key is one that a calibration may set.

    Raises:
        ConfigurationError: If it is not.
    """
    if not _KNOWN.fullmatch(key):
        raise ConfigurationError(
            f"{whose}: {key} is not for a calibration to set; it may set axes.N.sign, encoder_zero and counts_per_nm_*,"
            " geometry, inertia and friction of [model], and [latency]"
        )


def procedure_of(run: str) -> str:
    """Which procedure a table of [measured] or [provenance] is of: "torque of 2026-11-22T05:00:00" is of torque."""
    return run.partition(RUN_OF)[0]


def _tables(path: Path, tables: dict[str, Any], name: str) -> dict[str, dict[str, Any]]:
    """Take a table of tables out of a file's tables."""
    found = tables.pop(name, {})
    if not isinstance(found, dict) or not all(isinstance(each, dict) for each in found.values()):
        raise ConfigurationError(f"the calibration {path}: {name} must hold a table a procedure, as [{name}.torque]")
    return found


def _leaves(tables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, object]]:
    for key, value in tables.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _line(stand: Mapping[str, Place], key: str) -> str:
    return f":{stand[key].line}" if key in stand else ""


def _origin(key: str, provenance: Mapping[str, Mapping[str, Any]]) -> str:
    """Which procedure set a key, and on which day; the last one that says so."""
    made = [(str(facts.get("date", "")), name) for name, facts in provenance.items() if key in facts.get("set", ())]
    return f" ({procedure_of(max(made)[1])}, {max(made)[0][:10]})" if made else ""
