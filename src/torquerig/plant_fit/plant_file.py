"""A plant as a file that `--config` takes."""

import re
from pathlib import Path
from typing import Final

from torquerig.errors import ConfigurationError
from torquerig.schema_machines import Plant
from torquerig.toml_text import write

_COMMENT_COLUMN: Final = 36


def check_free(path: Path) -> None:
    """Refuse a file that is there already, or cannot be.

    Raises:
        ConfigurationError: It exists, or its folder does not.
    """
    if path.exists():
        raise ConfigurationError(f"{path} exists, and no file is overwritten: name another with --out")
    if not path.parent.is_dir():
        raise ConfigurationError(f"{path} cannot be written: there is no folder {path.parent}")


def check_name(name: str) -> None:
    """Refuse a plant's name that is no bare key of TOML.

    Raises:
        ConfigurationError: It holds something else than letters, digits, - and _.
    """
    if not re.fullmatch(r"[A-Za-z0-9_-]+", name):
        raise ConfigurationError(f"the plant's name {name!r} cannot be: letters, digits, - and _ only")


def plant_toml(name: str, plant: Plant, head: list[str], notes: dict[str, str]) -> str:
    """A plant as TOML.

    Args:
        name: Its name, a bare key.
        plant: Its values.
        head: Lines of comment at the top.
        notes: A comment for some of its keys.

    Returns:
        The text: a configuration file that `torquerig run --config` takes.
    """
    lines = [*(f"# {line}" for line in head), f"[plant.{name}]"]
    for key, value in plant.model_dump(mode="json").items():
        note = notes.get(key)
        line = f"{key} = {write(value)}"
        lines.append(f"{line:<{_COMMENT_COLUMN}}  # {note}" if note else line)
    return "\n".join(lines) + "\n"


def write_plant(path: Path, text: str) -> None:
    """Write a new file.

    Raises:
        ConfigurationError: It exists, or cannot be written.
    """
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise ConfigurationError(f"{path} exists, and no file is overwritten") from None
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be written: {error.strerror}") from error
