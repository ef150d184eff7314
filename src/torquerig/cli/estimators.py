"""`torquerig estimators`: noise, delay and effect on the loop of each estimator of joint rates."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from torquerig.cli.options import configure, simulation_options
from torquerig.cli.places import PictureFile, default_picture
from torquerig.cli.progress import ProgressBar

if TYPE_CHECKING:
    from torquerig.estimator_study import Finding, Study
    from torquerig.records import RecordedRun
    from torquerig.schema import Rig

DEFAULT_PICTURE = Path("torquerig-estimators.png")
_NOT_SIMULATED = ("bus.url", "axes.1.bus", "axes.2.bus", "axes.3.bus", "calibration.file")
"""Settings of a record that are not taken over: the loops are simulated, and what was calibrated is in the rest."""


@click.command("estimators")
@simulation_options
@click.option(
    "--record",
    "record_folder",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Replay the joint angles of this record, and take its settings, instead of a simulated run.",
)
@click.option(
    "--out",
    "picture",
    metavar="FILE",
    type=PictureFile(),
    help=f"Where the picture goes; default: {DEFAULT_PICTURE} here; with --json none.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, and nothing else.")
def command(
    config_file: Path | None, record_folder: Path | None, picture: Path | None, *, as_json: bool, **options: object
) -> None:
    """Compare the estimators of joint rates: noise, delay, cost, and the loop that runs with each.

    All estimators get the same joint angles, those of a simulated run with loop.estimator or of a record, and are
    judged by the true rates. Then the loop runs once with each, simulated.
    """
    # after the options: a wrong one is told at once
    from torquerig.estimator_study import study  # noqa: PLC0415
    from torquerig.records import open_record  # noqa: PLC0415

    place = picture or (None if as_json else default_picture(DEFAULT_PICTURE, "--out"))
    record = open_record(record_folder) if record_folder else None
    configuration = configure(config_file, _settings_of(record) if record else None, **options)
    with ProgressBar(quiet=as_json) as bar:
        outcome = study(configuration, record, bar)
    title = _title(configuration.rig, record_folder)
    if place:
        _save(outcome, title, place)
    if as_json:
        loop = configuration.rig.loop
        conditions = {"law": loop.law, "motion": loop.motion, "plant": configuration.rig.simulator.plant}
        record_name = str(record_folder) if record_folder else None
        click.echo(json.dumps({**conditions, "record": record_name, **outcome.as_json()}, allow_nan=False))
    else:
        _print(outcome, title, place)


def _settings_of(record: "RecordedRun") -> dict[str, object]:
    """What somebody set in a recorded run, by dotted key."""
    found: dict[str, object] = {}
    for key in set(record.sources) - set(_NOT_SIMULATED):
        value: Any = record.configuration
        for part in key.split("."):
            value = value.get(part) if isinstance(value, dict) else None
        if value is not None:
            found[key] = value
    return found


def _title(rig: "Rig", record_folder: Path | None) -> str:
    """What was compared."""
    conditions = f"{rig.loop.law}, motion {rig.loop.motion}, {rig.loop.rate_hz:g} Hz, plant {rig.simulator.plant}"
    return f"Estimators of joint rates: {conditions}" + (f"; angles of {record_folder}" if record_folder else "")


def _save(outcome: "Study", title: str, place: Path) -> None:
    """Write the picture."""
    from torquerig.estimator_picture import estimator_figure  # noqa: PLC0415
    from torquerig.picture import save  # noqa: PLC0415

    save(estimator_figure(outcome, title), place)


def _print(outcome: "Study", title: str, picture: Path | None) -> None:
    """Print both tables for a person."""
    console = Console(highlight=False)
    console.print(title, markup=False, style="bold")
    console.print(_estimates(outcome))
    console.print(
        "T: sampling period. Delay: as told, at low frequency. Seen: the shift at which the estimate agrees best with"
        f" the true rates in this motion. Noise: from the encoder's counts. True rates: {outcome.replay.reference}.",
        markup=False,
    )
    console.print(_loops(outcome.findings))
    for finding in outcome.findings:
        if finding.loop.stopped:
            console.print(f"{finding.name}: the run was stopped by the {finding.loop.stopped}", markup=False)
    if picture:
        console.print(f"Picture: {picture}", soft_wrap=True, markup=False)


def _estimates(outcome: "Study") -> Table:
    """What each makes of the same angles."""
    headings = ("delay\n[T]", "seen\n[T]", "noise\ngain", "noise\n[mrad/s]", "error\n[mrad/s]", "update\n[µs]")
    table = _table("The same angles", headings)
    for each in outcome.findings:
        numbers = (each.told_delay, each.delay, each.noise_gain, 1e3 * each.noise, 1e3 * each.error, each.update_us)
        cells = (f"{number:.{digits}f}" for number, digits in zip(numbers, (2, 2, 2, 2, 1, 1), strict=True))
        table.add_row(escape(each.name), *cells)
    return table


def _loops(findings: "tuple[Finding, ...]") -> Table:
    """What becomes of the loop with each."""
    headings = ("true position\nRMSE [mm]", "velocity\nRMSE [m/s]", "rms torque\n[N·m]", "chatter\n[mN·m]")
    table = _table("The loop, simulated", headings)
    for each in findings:
        loop = each.loop
        numbers = (loop.position_rmse_mm, loop.velocity_rmse_m_s, loop.rms_torque_nm, 1e3 * loop.torque_chatter_nm)
        cells = (
            "-" if math.isnan(number) else f"{number:.{digits}f}"
            for number, digits in zip(numbers, (3, 4, 4, 1), strict=True)
        )
        table.add_row(escape(each.name), *cells)
    return table


def _table(title: str, headings: tuple[str, ...]) -> Table:
    """An empty table with a row an estimator."""
    table = Table(title=title, title_justify="left")
    table.add_column("", no_wrap=True)
    for heading in headings:
        table.add_column(escape(heading), justify="right")
    return table
