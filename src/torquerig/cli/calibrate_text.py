"""A procedure's plan and outcome, for a person at a terminal."""

import math
from collections.abc import Sequence
from typing import Final

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from torquerig.calibrating.conducting import Outcome
from torquerig.calibration.procedure import Estimate, Grade, Plan, Result, Verdict

_COLOURS: Final = {Grade.OK: "green", Grade.SUSPICIOUS: "yellow", Grade.FAILED: "red"}


def print_plan(plan: Plan, *, err: bool = False) -> None:
    """Print what will be done, and the limits that are to be agreed to."""
    console = Console(stderr=err, highlight=False)
    console.print(f"[bold]{escape(plan.title)}[/bold]")
    for sentence in plan.before:
        console.print(f"Before: {sentence}", markup=False)
    for number, sentence in enumerate(plan.steps, start=1):
        console.print(f"  {number}. {sentence}", markup=False)
    bounds = plan.bounds
    table = Table(title="Limits: beyond any of these the drives stop at zero torque", title_justify="left")
    for name in ("torque", "joint speed", "joint travel", "duration"):
        table.add_column(name, justify="right")
    table.add_row(
        f"{bounds.torque:g} N·m at the motor",
        f"{bounds.speed:g} rad/s",
        f"{bounds.travel:.3g} rad ({math.degrees(bounds.travel):.2g}°)",
        f"{bounds.duration:.1f} s",
    )
    console.print(table)


def print_estimates(result: Result, notes: Sequence[str]) -> None:
    """Print what was measured, and what a person should know."""
    console = Console(highlight=False)
    for note in notes:
        console.print(note, markup=False)
    console.print(_table(result.estimates))


def print_outcome(outcome: Outcome) -> None:
    """Print what a procedure brought, and where it is."""
    console = Console(highlight=False)
    for note in outcome.notes:
        console.print(note, markup=False)
    if outcome.result.estimates:
        console.print(_table(outcome.result.estimates))
    _print_verdict(console, outcome.result.verdict)
    for key, value in outcome.result.settings.items() if outcome.deposit else ():
        console.print(f"  {key} = {value}", markup=False)
    if outcome.deposit:
        console.print(f"Calibration: {outcome.deposit.path}", soft_wrap=True, markup=False)
        if outcome.deposit.kept:
            console.print(f"The old one: {outcome.deposit.kept}", soft_wrap=True, markup=False)
    console.print(f"Raw data:    {outcome.record}", soft_wrap=True, markup=False)
    console.print(f"Figure:      {outcome.picture}", soft_wrap=True, markup=False)


def _table(estimates: tuple[Estimate, ...]) -> Table:
    table = Table()
    table.add_column("")
    for heading in ("value", "95 % interval", "unit"):
        table.add_column(heading, justify="right")
    for each in estimates:
        bounded = not math.isnan(each.low)
        interval = f"{_number(each.low)} … {_number(each.high)}" if bounded else "-"
        table.add_row(escape(each.name), _number(each.value), interval, escape(each.unit))
    return table


def _number(value: float) -> str:
    return f"{value:.5g}"


def _print_verdict(console: Console, verdict: Verdict) -> None:
    console.print(f"Verdict: [{_COLOURS[verdict.grade]}]{verdict.grade.value}[/]")
    for reason in verdict.reasons:
        console.print(f"  {reason}", markup=False)
    for advice in verdict.advice:
        console.print(f"  What to do: {advice}", markup=False)
