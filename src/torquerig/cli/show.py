"""`torquerig show`: a record as tables and a picture."""

import json
import math
from pathlib import Path

import click
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from torquerig.cli.options import picture_option
from torquerig.cli.places import default_picture
from torquerig.cli.tables import number, summary_table, title_of
from torquerig.cli.torque_table import parts_as_object, parts_of, parts_table
from torquerig.errors import RecordError
from torquerig.mechanism import MechanismError
from torquerig.picture import draw
from torquerig.record import SIM
from torquerig.record_figures import figures_of
from torquerig.records import RecordedRun, open_record
from torquerig.torque_parts import TorqueParts
from torquerig.torque_picture import draw_with_parts
from torquerig.truth_picture import draw_truth

DEFAULT_PICTURE = Path("torquerig-show.png")


@click.command("show")
@click.argument("place", metavar="RECORD", type=click.Path(path_type=Path))
@picture_option(f"Where the picture goes; default: {DEFAULT_PICTURE} here, with --json none.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, and nothing else.")
def command(place: Path, picture_file: Path | None, *, as_json: bool) -> None:
    """Tabulate and draw a record: of a run, also one that was stopped, or of `torquerig sim`."""
    picture = picture_file or (None if as_json else default_picture(DEFAULT_PICTURE))
    record = open_record(place)
    try:
        parts, lacking = parts_of(record), None
    except (RecordError, MechanismError) as error:
        parts, lacking = None, f"Torque components are not shown: {error}"
    drawn = picture if picture and _draw(record, parts, picture) else None
    if as_json:
        told = as_object(record) | {"torque_components": parts and parts_as_object(parts)}
        click.echo(json.dumps(told, allow_nan=False))
        return
    _print(record, parts)
    if lacking:
        click.echo(lacking)
    if drawn:
        click.echo(f"Picture: {drawn}")


def as_object(record: RecordedRun) -> dict[str, object]:
    """A record as --json prints it, but for its torque components."""
    return {
        "record": str(record.place),
        "kind": record.kind,
        "started": record.started.isoformat(),
        "ended": record.ended,
        "planned_cycles": record.planned_cycles,
        "notes": list(record.notes),
        "summary": record.summary and record.summary.as_json(),
        "figures": {figure.name: None if math.isnan(figure.value) else figure.value for figure in figures_of(record)},
        "counters": record.counters,
        "sources": record.sources,
    }


def _draw(record: RecordedRun, parts: TorqueParts | None, picture: Path) -> bool:
    """Draw what there is; False when there is nothing."""
    if record.summary is not None and record.log is not None and record.log.rows:
        title = title_of(record.summary) + ("" if record.is_done else ", stopped")
        if parts is None:
            draw(record.log, title, picture, record.true_positions())
        else:
            draw_with_parts(record.log, parts, title, picture, record.true_positions())
    elif record.truth is not None and len(record.truth.at_ns) > 1:
        draw_truth(record.truth, f"simulated machine, plant {record.configuration['simulator']['plant']}", picture)
    else:
        return False
    return True


def _print(record: RecordedRun, parts: TorqueParts | None) -> None:
    """Print a record for a person."""
    console = Console(highlight=False)

    def say(words: str) -> None:
        console.print(words, soft_wrap=True, markup=False)

    what = "simulated drives" if record.kind == SIM else "a run"
    say(f"Record:  {record.place}, of {what} that began {record.started:%Y-%m-%d %H:%M:%S %Z}")
    say(f"Ended:   {record.ended}{_how_far(record)}")
    for note in record.notes:
        say(f"Note:    {note}")
    if record.sources:
        say("Changed: " + ", ".join(f"{key} ({source})" for key, source in record.sources.items()))
    figures = figures_of(record)
    if record.summary is not None:
        table = summary_table(record.summary)
        known = set(record.summary.as_json()) | {"late_cycles", "work_us"}
        figures = [figure for figure in figures if figure.name not in known]
    else:
        table = Table("", "", title="what the simulated machine did", title_justify="left", show_header=False)
    for figure in figures:
        table.add_row(escape(figure.words), number(figure))
    if figures:
        console.print(table)
    if parts is not None:
        console.print(parts_table(parts))


def _how_far(record: RecordedRun) -> str:
    """How far a run came that did not come to its end."""
    if record.is_done or record.kind == SIM:
        return ""
    return f", after {record.log.rows if record.log else 0} of {record.planned_cycles or 'its'} cycles"
