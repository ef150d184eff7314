"""`torquerig run`: the closed loop, once."""

import json
from pathlib import Path

import click
from rich.console import Console

from torquerig.cli.options import configure, picture_option, record_option, run_options
from torquerig.cli.places import default_picture
from torquerig.cli.progress import ProgressBar
from torquerig.cli.tables import summary_table, title_of
from torquerig.experiment import Outcome, run_experiment
from torquerig.picture import draw
from torquerig.record import PICTURE_FILE

DEFAULT_PICTURE = Path("torquerig-run.png")


@click.command("run")
@run_options
@record_option
@picture_option("Where the picture goes; default: run.png in the record, or torquerig-run.png here; with --json none.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as one JSON object, and nothing else.")
def command(
    config_file: Path | None,
    record_folder: Path | None,
    picture_file: Path | None,
    *,
    as_json: bool,
    **options: object,
) -> None:
    """Run the closed loop once: enable the drives, approach, run the motion, hold, disable.

    With no options this is the thesis' experiment, simulated: motion 1 under computed torque at 250 Hz, over real
    CANopen frames.
    """
    place = picture_file or _default_picture(record_folder, as_json=as_json)
    configuration = configure(config_file, **options)
    with ProgressBar(quiet=as_json) as bar:
        outcome = run_experiment(configuration, record=record_folder, watcher=bar)
    if place:
        draw(outcome.log, title_of(outcome.summary), place, outcome.truth)
    if as_json:
        click.echo(json.dumps(outcome.summary.as_json(), allow_nan=False))
    else:
        _print(outcome, place)


def _default_picture(record_folder: Path | None, *, as_json: bool) -> Path | None:
    """Where the picture goes when nobody says it; None for no picture."""
    if record_folder:
        return record_folder / PICTURE_FILE
    return None if as_json else default_picture(DEFAULT_PICTURE)


def _print(outcome: Outcome, picture: Path | None) -> None:
    """Print the summary for a person."""
    console = Console(highlight=False)
    for note in outcome.notes:
        console.print(note, markup=False)
    console.print(summary_table(outcome.summary))
    if outcome.record:
        console.print(f"Record:  {outcome.record}", soft_wrap=True, markup=False)
    if picture:
        console.print(f"Picture: {picture}", soft_wrap=True, markup=False)
