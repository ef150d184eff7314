"""The report: one HTML file that needs nothing beside it, and the pictures and records that are behind it."""

import base64
from collections.abc import Callable, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from torquerig.control.motions import THESIS_STROKES
from torquerig.errors import RecordError
from torquerig.record import claim, versions
from torquerig.reproduction.experiments import MOTIONS
from torquerig.reproduction.figures import pictures
from torquerig.reproduction.misprints import misprints
from torquerig.reproduction.plots import Picture
from torquerig.reproduction.settings import Departures
from torquerig.reproduction.tables import PlantReport

REPORT_FILE: Final = "report.html"
TEMPLATE: Final = "report.html.j2"
RECORDS: Final = "records"
DEFAULT_FOLDER: Final = "torquerig-reproduction"


def claim_folder(wanted: Path | None) -> Path:
    """Make the folder of a report.

    Args:
        wanted: Where it is to be, new or empty; None for the first free one of torquerig-reproduction,
            torquerig-reproduction-2 and so on, here.

    Returns:
        The folder, empty.

    Raises:
        RecordError: If something is in it already, or it cannot be made.
    """
    if wanted is not None:
        if (wanted / RECORDS).is_dir() and not (wanted / REPORT_FILE).exists():
            raise RecordError(
                f"{wanted} holds records of a reproduction that did not come to its report: remove it, or name another"
                " folder"
            )
        return claim(wanted)
    place, number = Path(DEFAULT_FOLDER), 1
    while place.exists():
        number += 1
        place = Path(f"{DEFAULT_FOLDER}-{number}")
    return claim(place)


def put_away(place: Path) -> int:
    """Remove the empty folders of a reproduction that was stopped.

    Args:
        place: The report's folder; it goes too if nothing is in it.

    Returns:
        How many records are left.
    """
    records = place / RECORDS
    begun = list(records.iterdir()) if records.is_dir() else []
    kept = [record for record in begun if any(record.iterdir())]
    empty = [record for record in begun if record not in kept]
    for folder in (*empty, records, place):
        with suppress(OSError):  # it is not empty, or not there, or not ours to remove
            folder.rmdir()
    return len(kept)


def write_report(
    reports: Sequence[PlantReport], departures: Departures, place: Path, watch: Callable[[str], None]
) -> Path:
    """Draw the figures, and write them and the report.

    Args:
        reports: What came out on each plant.
        departures: What the user's file changes.
        place: The report's folder, where the runs' records are already.
        watch: Is told what is being done.

    Returns:
        The report's file.

    Raises:
        RecordError: If a file cannot be written.
    """
    path = place / REPORT_FILE
    try:
        drawn = []
        for picture in pictures([report.runs for report in reports], watch):
            (place / picture.file_name).write_bytes(picture.png)
            drawn.append(picture)
        watch("writing the report")
        path.write_text(render(reports, departures, drawn), encoding="utf-8")
    except OSError as error:
        raise RecordError(f"cannot write the report {path}: {error.strerror or error}") from error
    return path


def render(reports: Sequence[PlantReport], departures: Departures, drawn: Sequence[Picture]) -> str:
    """The report as HTML.

    Args:
        reports: What came out on each plant.
        departures: What the user's file changes.
        drawn: Its pictures.

    Returns:
        The whole document, the pictures inside.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined  # noqa: PLC0415  (only reports need it)

    environment = Environment(
        loader=PackageLoader("torquerig.reproduction", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["data_uri"] = _data_uri
    return environment.get_template(TEMPLATE).render(
        reports=reports,
        departures=departures,
        figures=_by_number(drawn),
        misprints=misprints(),
        motions={motion: THESIS_STROKES[motion] for motion in MOTIONS},
        findings=list(zip(*(report.findings for report in reports), strict=True)),
        records=RECORDS,
        versions=versions(),
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    )


def _by_number(drawn: Sequence[Picture]) -> dict[str, list[Picture]]:
    """Pictures by the thesis' number, in order."""
    figures: dict[str, list[Picture]] = {}
    for picture in drawn:
        figures.setdefault(picture.number, []).append(picture)
    return figures


def _data_uri(png: bytes) -> str:
    """A picture as an address that holds it."""
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")
