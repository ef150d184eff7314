"""`torquerig reproduce`: all experiments of the thesis, and a report on them."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import click
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from torquerig.cli.failures import Failure
from torquerig.cli.options import config_option
from torquerig.cli.progress import ProgressBar
from torquerig.reproduction.experiments import PLANTS, planned, run_all
from torquerig.reproduction.report import RECORDS, claim_folder, put_away, write_report
from torquerig.reproduction.settings import Departures, departures
from torquerig.reproduction.tables import PlantReport, as_json, report_on
from torquerig.stopping import Stopped


@click.command("reproduce")
@click.option(
    "--plant",
    "plants",
    metavar="NAME",
    multiple=True,
    help=f"Only this true machine, by default {' and '.join(PLANTS)}; may be given again.",
)
@click.option(
    "--out",
    "out",
    metavar="DIR",
    type=click.Path(path_type=Path, file_okay=False),
    help="A new or empty folder for the report; default: torquerig-reproduction[-2, ...]; with --json none.",
)
@config_option
@click.option("--json", "is_json", is_flag=True, help="Print the numbers as one JSON object, and nothing else.")
def command(plants: tuple[str, ...], out: Path | None, config_file: Path | None, *, is_json: bool) -> None:
    """Reproduce the thesis: every law in both test motions, simulated over real CANopen frames.

    The report is one HTML file that stands alone: Tables 6.1 and 6.2, Figures 2.2, 2.3 and 6.2 to 6.10, the findings
    with verdicts, and the misprints. The pictures and the records of the runs stand beside it.
    """
    experiments = planned(plants or PLANTS, config_file)
    departed = departures(config_file)
    place = None if is_json and out is None else claim_folder(out)
    with _put_away_when_stopped(place), ProgressBar(quiet=is_json) as bar:
        reports = report_on(run_all(experiments, bar, None if place is None else place / RECORDS))
        report = None if place is None else write_report(reports, departed, place, bar.phase)
    if is_json:
        click.echo(json.dumps(as_json(reports, departed), allow_nan=False))
    else:
        _print(reports, departed, report)


@contextmanager
def _put_away_when_stopped(place: Path | None) -> Iterator[None]:
    """Leave no empty folder behind, and say what is left.

    Yields:
        Nothing.

    Raises:
        Failure: When somebody has stopped it, with what is left.
    """
    try:
        yield
    except Stopped as stop:
        kept = 0 if place is None else put_away(place)
        left = f"; {place} keeps {kept} records and no report" if kept else ""
        raise Failure(f"{stop}{left}", stop.exit_code) from stop
    except BaseException:
        if place is not None:
            put_away(place)
        raise


def _print(reports: Sequence[PlantReport], departed: Departures, report: Path | None) -> None:
    """Print what came out for a person."""
    console = Console(highlight=False)
    for words, settings in (("not as shipped", departed.changed), ("put aside", departed.put_aside)):
        if settings:
            told = ", ".join(f"{each.key} = {each.value}" for each in settings)
            console.print(f"Settings {words}: {told}", soft_wrap=True, markup=False)
    for each in reports:
        console.print(_table(each))
        for run in each.runs.runs:
            if run.summary is None:
                console.print(f"  stopped: {run.law}, motion {run.motion}: {run.ended}", soft_wrap=True, markup=False)
        for finding in each.findings:
            if finding.reproduced is not True:
                number = "" if finding.number is None else f": {finding.number:.3g} {finding.unit}, not {finding.bound}"
                where = f"motion {finding.motion}" if finding.motion else "both motions"
                line = f"  {finding.verdict}: {finding.claim} ({where}{number.replace(' 1,', ',')})"
                console.print(line + (f"; {finding.note}" if finding.note else ""), soft_wrap=True, markup=False)
    if report is not None:
        console.print(f"Report: {report}", soft_wrap=True, markup=False)


def _table(report: PlantReport) -> Table:
    """The runs of one plant beside the thesis'."""
    title = f"{report.plant}: {report.factor_in_words}, {report.reproduced} of {report.refutable} findings reproduced"
    table = Table(title=escape(title), title_justify="left", box=SIMPLE_HEAD, padding=0)
    table.add_column("law", no_wrap=True)
    for heading in (
        "motion",
        "position\n[mm]",
        "ratio",
        "velocity\n[m/s]",
        "ratio",
        "peak\n[N·m]",
        "rms\n[N·m]",
        "law\n[µs]",
        "thesis\n[ms]",
    ):
        table.add_column(escape(heading), justify="right", no_wrap=True)
    for run in report.runs.runs:
        if run.summary is None:
            table.add_row(run.law, str(run.motion), "stopped")
            continue
        position, velocity = (f"{ratio:.2f}" for ratio in run.ratios) if run.ratios else ("-", "-")
        table.add_row(
            run.law,
            str(run.motion),
            f"{run.summary.position_rmse_mm:.4f}",
            position,
            f"{run.summary.velocity_rmse_m_s:.4f}",
            velocity,
            f"{run.summary.peak_torque_nm:.3f}",
            f"{run.summary.rms_torque_nm:.3f}",
            f"{run.law_us:.0f}",
            "-" if run.thesis_ms is None else f"{run.thesis_ms:.2f}",
        )
    return table
