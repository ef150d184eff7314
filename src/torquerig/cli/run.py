"""`torquerig run`: the closed loop, once."""

import json
import math
from pathlib import Path

import click
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from torquerig.cli.options import configure, record_option, run_options
from torquerig.cli.progress import ProgressBar
from torquerig.experiment import Outcome, run_experiment
from torquerig.picture import draw
from torquerig.record import PICTURE_FILE
from torquerig.summary import Summary

DEFAULT_PICTURE = Path("torquerig-run.png")


@click.command("run")
@run_options
@record_option
@click.option(
    "--picture",
    "picture_file",
    metavar="FILE",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Where the picture goes; default: run.png in the record, or torquerig-run.png here; with --json none.",
)
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
    configuration = configure(config_file, **options)
    with ProgressBar(quiet=as_json) as bar:
        outcome = run_experiment(configuration, record=record_folder, watcher=bar)
    place = picture_file or _default_picture(record_folder, as_json=as_json)
    if place:
        draw(outcome.log, _title(outcome.summary), place, outcome.truth)
    if as_json:
        click.echo(json.dumps(outcome.summary.as_json(), allow_nan=False))
    else:
        _print(outcome, place)


def _default_picture(record_folder: Path | None, *, as_json: bool) -> Path | None:
    """Where the picture goes when nobody says it; None for no picture."""
    if record_folder:
        return record_folder / PICTURE_FILE
    return None if as_json else DEFAULT_PICTURE


def _title(summary: Summary) -> str:
    """What the picture is a picture of."""
    plant = f", plant {summary.plant}" if summary.plant else ""
    return f"{summary.law}, motion {summary.motion}, {summary.rate_hz:g} Hz{plant}"


def _print(outcome: Outcome, picture: Path | None) -> None:
    """Print the summary for a person."""
    console = Console(highlight=False)
    for note in outcome.notes:
        console.print(note, markup=False)
    console.print(_table(outcome.summary))
    if outcome.record:
        console.print(f"Record:  {outcome.record}", soft_wrap=True, markup=False)
    if picture:
        console.print(f"Picture: {picture}", soft_wrap=True, markup=False)


def _table(summary: Summary) -> Table:
    """The summary beside the thesis' row."""
    table = Table(title=escape(_title(summary)), title_justify="left")
    table.add_column("")
    for heading in ("this run", "thesis", "ratio"):
        table.add_column(heading, justify="right")
    thesis = summary.thesis
    _compare(table, "position RMSE [mm]", summary.position_rmse_mm, thesis and thesis.position_rmse_mm)
    if summary.true_position_rmse_mm is not None:
        _compare(table, "true position RMSE [mm]", summary.true_position_rmse_mm, None)
    _compare(table, "velocity RMSE [m/s]", summary.velocity_rmse_m_s, thesis and thesis.velocity_rmse_m_s)
    _compare(table, "peak torque [N·m]", summary.peak_torque_nm, None)
    _compare(table, "rms torque [N·m]", summary.rms_torque_nm, None)
    cycle = summary.cycle_us
    table.add_row("late cycles", f"{summary.overruns} of {summary.cycles}")
    table.add_row("bus load", f"{100 * summary.bus_load:.1f} %")
    table.add_row(escape("work a cycle [µs]: p50, p99, max"), f"{cycle.p50:.0f}, {cycle.p99:.0f}, {cycle.max:.0f}")
    return table


def _compare(table: Table, words: str, ours: float, theirs: float | None) -> None:
    """Add a row with our number, the thesis' and their ratio."""
    shown = "-" if math.isnan(ours) else f"{ours:.4f}"
    if theirs is None:
        table.add_row(escape(words), shown)
    else:
        table.add_row(escape(words), shown, f"{theirs:.4f}", f"{ours / theirs:.2f}")
