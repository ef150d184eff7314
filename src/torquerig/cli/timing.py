"""`torquerig timing`: how a record's loop kept its time."""

import json
import math
from pathlib import Path
from typing import Final

import click
import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from torquerig.cli.options import picture_option
from torquerig.cli.places import default_picture
from torquerig.control.log import LoopLog
from torquerig.control.tracking import incomplete_samples, overrun_rows
from torquerig.records import RecordedRun, open_record
from torquerig.timing import NS_PER_S, NS_PER_US, Distribution, Timing, cycle_times, timing_of
from torquerig.timing_picture import draw_timing

DEFAULT_PICTURE = Path("torquerig-timing.png")
SHOWN_OVERRUNS: Final = 10
"""So many overruns are listed for a person; --json has all."""


@click.command("timing")
@click.argument("place", metavar="RECORD", type=click.Path(path_type=Path))
@picture_option(f"Where the histograms go; default: {DEFAULT_PICTURE} here, with --json none.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, and nothing else.")
def command(place: Path, picture_file: Path | None, *, as_json: bool) -> None:
    """Tell how punctual a record's cycles were: lateness, answers, law, torques, and every overrun."""
    asked = picture_file or (None if as_json else default_picture(DEFAULT_PICTURE))
    record = open_record(place)
    log = record.cycles()
    times = cycle_times(log)
    picture = asked if times.lateness.size else None  # of skipped cycles alone there is nothing to draw
    if picture:
        title = f"Timing of {record.place.resolve().name}: {log.rows} cycles, {NS_PER_S / log.period_ns:g} Hz"
        draw_timing(times, log.period_ns / NS_PER_US, title, picture)
    if as_json:
        click.echo(json.dumps(as_object(record, log), allow_nan=False))
        return
    _print(record, log)
    if picture:
        click.echo(f"Picture: {picture}")


def as_object(record: RecordedRun, log: LoopLog) -> dict[str, object]:
    """The timing of a record as --json prints it."""
    return {
        "record": str(record.place),
        "ended": record.ended,
        "period_us": log.period_ns / NS_PER_US,
        "cycles": log.rows,
        "incomplete": incomplete_samples(log),
        "timing": timing_of(log).as_json(),
        "overruns": overruns_of(record, log),
        "real_time": [step._asdict() for step in record.real_time],
    }


def overruns_of(record: RecordedRun, log: LoopLog) -> list[dict[str, object]]:
    """Every overrun: its cycle, when it was due in the loop and as bus.log stamps it, and what was late.

    Args:
        record: The record.
        log: Its cycles.

    Returns:
        One object an overrun; `command_us` is when its torques left after it was due, null where it was skipped.
    """
    stamps_ns = record.stamps_ns()
    return [
        {
            "cycle": k,
            "at_s": int(log.due_ns[k]) / NS_PER_S,
            "stamp_s": int(stamps_ns[k]) / NS_PER_S,
            "skipped": bool(log.skipped[k]),
            "lateness_us": int(log.lateness_ns[k]) / NS_PER_US,
            "command_us": None if log.skipped[k] else int(log.command_ns[k]) / NS_PER_US,
        }
        for k in np.flatnonzero(overrun_rows(log)).tolist()
    ]


def _print(record: RecordedRun, log: LoopLog) -> None:
    """Print the timing for a person."""
    console = Console(highlight=False)

    def say(words: str) -> None:
        console.print(words, soft_wrap=True, markup=False)

    say(f"Record:  {record.place}, {log.rows} cycles of {log.period_ns / NS_PER_US:g} µs")
    if not record.is_done:
        say(f"Ended:   {record.ended}")
    for step in record.real_time:
        say(f"Set-up:  {step.words}" if step.done else f"Set-up:  refused: {step.name} ({step.words})")
    console.print(_table(timing_of(log)))
    if lacking := incomplete_samples(log):
        say(f"Samples that lacked a drive: {lacking}")
    _list_overruns(console, record, log)


def _table(timing: Timing) -> Table:
    """The distributions, one a row."""
    table = Table(title=escape("times [µs]"), title_justify="left")
    table.add_column("")
    for heading in ("p50", "p99", "p99.9", "max"):
        table.add_column(heading, justify="right")

    def add(words: str, spread: Distribution) -> None:
        numbers = (spread.p50, spread.p99, spread.p999, spread.max)
        table.add_row(words, *("-" if math.isnan(number) else f"{number:.1f}" for number in numbers))

    add("lateness of SYNC", timing.lateness_us)
    for place, spread in enumerate(timing.tpdo_us_by_drive, start=1):
        add(f"SYNC to TPDO, drive of axis {place}", spread)
    add("SYNC to last TPDO, as the loop saw it", timing.sync_to_last_tpdo_us)
    add("estimate and law", timing.law_us)
    add("SYNC to last RPDO", timing.sync_to_last_rpdo_us)
    return table


def _list_overruns(console: Console, record: RecordedRun, log: LoopLog) -> None:
    """The first overruns, and how many there are."""
    found = overruns_of(record, log)
    if not found:
        console.print("Overruns: none")
        return
    table = Table(title=f"overruns: {len(found)} of {log.rows} cycles", title_justify="left")
    for heading in ("cycle", "due [s]", "stamp in bus.log [s]", "SYNC late [µs]", "torques after [µs]"):
        table.add_column(escape(heading), justify="right")
    for each in found[:SHOWN_OVERRUNS]:
        torques = "skipped" if each["skipped"] else f"{each['command_us']:.1f}"
        table.add_row(
            f"{each['cycle']}",
            f"{each['at_s']:.6f}",
            f"{each['stamp_s']:.6f}",
            f"{each['lateness_us']:.1f}",
            torques,
        )
    console.print(table)
    if len(found) > SHOWN_OVERRUNS:
        console.print(f"and {len(found) - SHOWN_OVERRUNS} more: --json has them all")
