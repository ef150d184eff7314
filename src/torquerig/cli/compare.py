"""`torquerig compare`: several records side by side."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

import click
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from torquerig.cli.options import picture_option
from torquerig.cli.places import default_picture
from torquerig.cli.show import as_object
from torquerig.cli.tables import number
from torquerig.comparison_picture import Entry, draw_comparison
from torquerig.json_numbers import finite
from torquerig.record_figures import Figure, differing, figures_of, ratio
from torquerig.records import RecordedRun, open_record
from torquerig.summary import motion_in_words
from torquerig.toml_text import write

DEFAULT_PICTURE = Path("torquerig-compare.png")
LEAST = 2
HEADINGS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


@click.command("compare")
@click.argument("places", metavar="RECORD RECORD...", nargs=-1, type=click.Path(path_type=Path))
@picture_option(f"Where the picture goes; default: {DEFAULT_PICTURE} here, with --json none.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, and nothing else.")
def command(places: tuple[Path, ...], picture_file: Path | None, *, as_json: bool) -> None:
    """Set records of runs side by side: their figures with the ratios to the first, and their curves in one picture.

    Runs that were stopped are compared as far as they came.
    """
    if not LEAST <= len(places) <= len(HEADINGS):
        raise click.UsageError(f"give {LEAST} to {len(HEADINGS)} records: there are {len(places)}")
    picture = picture_file or (None if as_json else default_picture(DEFAULT_PICTURE))
    records = [open_record(place) for place in places]
    entries = [Entry(name, record.cycles()) for name, record in zip(_names(records), records, strict=True)]
    columns = [figures_of(record) for record in records]
    if picture:
        draw_comparison(entries, f"{len(records)} runs compared", picture)
    if as_json:
        click.echo(json.dumps(_as_object(records, columns), allow_nan=False))
    else:
        _print(records, columns)
        click.echo(f"Picture: {picture}")


def _names(records: Sequence[RecordedRun]) -> list[str]:
    """What each run is called in the picture: its column in the table, its folder, and what it is."""
    return [
        f"{heading}  {record.place.resolve().name}: {_what(record)}"
        for heading, record in zip(HEADINGS, records, strict=False)
    ]


def _what(record: RecordedRun) -> str:
    """What was run, and whether it came to its end."""
    summary = record.summary
    if summary is None:
        return record.ended
    plant = f", {summary.plant}" if summary.plant else ""
    stopped = "" if record.is_done else ", stopped"
    return f"{summary.law}, {motion_in_words(summary.motion)}, {summary.rate_hz:g} Hz{plant}{stopped}"


def _as_object(records: Sequence[RecordedRun], columns: Sequence[Sequence[Figure]]) -> dict[str, object]:
    """The comparison as --json prints it: differences and ratios are to the first record's figures."""
    first = columns[0]
    return {
        "records": [as_object(record) for record in records],
        "differences": [
            {a.name: finite(b.value - a.value) for a, b in zip(first, column, strict=True)} for column in columns
        ],
        "ratios": [
            {a.name: finite(ratio(b.value, a.value)) for a, b in zip(first, column, strict=True)} for column in columns
        ],
        "settings": differing(records),
    }


def _print(records: Sequence[RecordedRun], columns: Sequence[Sequence[Figure]]) -> None:
    """Print the comparison for a person."""
    console = Console(highlight=False)
    for heading, record in zip(HEADINGS, records, strict=False):
        console.print(f"{heading}  {record.place}: {_what(record)}", soft_wrap=True, markup=False)
        if not record.is_done:
            console.print(f"   ended: {record.ended}", soft_wrap=True, markup=False)
    console.print(_figure_table(columns))
    settings = differing(records)
    if settings:
        console.print(_settings_table(settings, len(records)))


def _figure_table(columns: Sequence[Sequence[Figure]]) -> Table:
    """Figures side by side, each but the first with its ratio to the first; of two also the difference."""
    table = Table(title="figures", title_justify="left")
    table.add_column("")
    table.add_column("A", justify="right")
    two = len(columns) == LEAST
    for heading in HEADINGS[1 : len(columns)]:
        for words in (heading, f"{heading} - A", f"{heading} / A") if two else (heading, f"{heading} / A"):
            table.add_column(words, justify="right")
    for row in zip(*columns, strict=True):
        first = row[0]
        cells = [number(first)]
        for figure in row[1:]:
            cells.append(number(figure))
            if two:
                cells.append(number(figure._replace(value=figure.value - first.value)))
            over = ratio(figure.value, first.value)
            cells.append("" if math.isnan(over) else f"{over:.2f}")
        table.add_row(escape(first.words), *cells)
    return table


def _settings_table(settings: dict[str, list[object]], count: int) -> Table:
    """The settings that differ."""
    table = Table(title="settings that differ", title_justify="left")
    table.add_column("")
    for heading in HEADINGS[:count]:
        table.add_column(heading, justify="right", overflow="fold")
    for key, values in settings.items():
        table.add_row(escape(key), *(escape("-" if value is None else write(value)) for value in values))
    return table
