"""Where a command is to write, judged before it does any work."""

import os
from pathlib import Path
from typing import Any, Final

import click

PICTURES: Final = (".png", ".svg", ".pdf")
"""What a picture's name may end in."""


class PictureFile(click.Path):
    """The type of an option that names a picture; one that is there already is replaced."""

    def __init__(self) -> None:
        """Take files only."""
        super().__init__(path_type=Path, dir_okay=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:  # noqa: ANN401  (click's signature)
        """The path, if a picture can be written there."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        if why := _objection(path):
            self.fail(why, param, ctx)
        return path


def default_picture(path: Path, option: str = "--picture") -> Path:
    """The place of a picture that nobody named.

    Args:
        path: The place.
        option: What would name another.

    Returns:
        The same.

    Raises:
        click.UsageError: If no picture can be written there.
    """
    if why := _objection(path):
        raise click.UsageError(f"{why}; {option} names another place")
    return path


def check_folder(path: Path, option: str = "--out") -> None:
    """Hold a folder that a command will fill, and make if need be, against the disk.

    Args:
        path: The folder.
        option: What names it.

    Raises:
        click.BadParameter: If it cannot be made, or nothing can be written there.
    """
    there = next(place for place in (path, *path.parents) if place.exists())
    verb = "written to" if there == path else "made"
    if why := _closed(there):
        raise click.BadParameter(f"{path} cannot be {verb}: {why}", param_hint=option)


def _objection(path: Path) -> str | None:
    """Why no picture can be written there; None if one can."""
    if path.suffix.lower() not in PICTURES:
        return f"{path} cannot be a picture: its name must end in {', '.join(PICTURES[:-1])} or {PICTURES[-1]}"
    if not path.parent.exists():
        return f"{path} cannot be written: there is no folder {path.parent}"
    why = _closed(path.parent)
    if why is None and path.exists() and not os.access(path, os.W_OK):
        why = "there is no permission to replace it"
    return why and f"{path} cannot be written: {why}"


def _closed(folder: Path) -> str | None:
    """Why nothing can be written into what is there; None if something can."""
    if not folder.is_dir():
        return f"{folder} is no folder"
    if not os.access(folder, os.W_OK | os.X_OK):
        return f"there is no permission to write into {folder.resolve()}"
    return None
