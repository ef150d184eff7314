"""`torquerig calibrate`: procedures that measure the rig, each a command that is imported when it is called."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import click

from torquerig.calibrating.catalogue import PROCEDURES, offer
from torquerig.calibrating.conducting import Outcome, Terms, conduct
from torquerig.calibrating.deposit import target_of
from torquerig.calibrating.offer import Option, Request
from torquerig.calibrating.task import Task
from torquerig.calibration.procedure import Estimate, Grade, Plan
from torquerig.cli.agreement import agree
from torquerig.cli.calibrate_text import print_outcome, print_plan
from torquerig.cli.failures import MACHINE, Failure
from torquerig.cli.options import bus_option, calibration_option, config_option, configure, plant_option
from torquerig.cli.places import check_folder
from torquerig.cli.procedure_bar import ProcedureBar
from torquerig.configuration import Configuration
from torquerig.errors import ConfigurationError

_SHARED: Final = (
    click.option("--axis", metavar="N", type=click.IntRange(1, 3), help="This axis only; default: all."),
    bus_option,
    click.option("--dry-run", is_flag=True, help="Show what would be done and its limits; open no bus, move nothing."),
    click.option("--yes", is_flag=True, help="Agree to the plan and its limits: for scripts."),
    click.option("--json", "as_json", is_flag=True, help="Print the result as one JSON object, and nothing else."),
    click.option(
        "--out",
        "place",
        metavar="DIR",
        type=click.Path(path_type=Path, file_okay=False),
        help="Where calibration.toml and its raw data go; default: where --calibration is, or here.",
    ),
    click.option("--accept", is_flag=True, help="Write a suspicious result into calibration.toml too."),
    click.option("--replace", is_flag=True, help="Begin a new calibration.toml; the old one is kept beside it."),
    click.option(
        "--seed", metavar="N", type=click.IntRange(0), default=0, help="Of the procedure's chance; default: 0."
    ),
    plant_option,
    config_option,
    calibration_option,
)


class Procedures(click.Group):
    """A group that knows its commands by name and makes them when they are called."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002  (click's signature)
        """The names, in the order of the help."""
        return list(PROCEDURES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of this procedure, made now."""
        return _command(cmd_name) if cmd_name in PROCEDURES else super().get_command(ctx, cmd_name)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write the procedures into the help without importing them."""
        with formatter.section("Procedures"):
            formatter.write_dl([(name, entry.help) for name, entry in PROCEDURES.items()])


@click.group("calibrate", cls=Procedures)
def command() -> None:
    """Measure the rig: guided procedures whose results the loop loads.

    Each shows its plan and limits and asks before anything moves, can be aborted at any moment (the drives end at zero
    torque, the old calibration stays), and writes a figure, raw data and calibration.toml. Do them in the order of the
    list. docs/calibration.md tells what each does.
    """


def _command(name: str) -> click.Command:
    """The command of a procedure, with its own options before those of all."""
    own = offer(name).options
    options = [_option(each) for each in own]

    def run(**values: Any) -> None:  # noqa: ANN401  (values of any option)
        mine = {each.name.replace("-", "_"): values.pop(each.name.replace("-", "_")) for each in own}
        _run(name, mine, **values)

    called: Callable[..., Any] = run
    for decorate in reversed([*options, *_SHARED]):
        called = decorate(called)
    return click.command(name, help=PROCEDURES[name].help)(called)


def _option(option: Option) -> Callable[..., Any]:
    """An option as click has it."""
    if option.kind is bool:
        return click.option(f"--{option.name}", is_flag=True, default=option.default, help=option.help)
    kind = click.Path(path_type=Path, dir_okay=False) if option.kind is Path else option.kind
    words = option.help if option.default is None else f"{option.help} Default: {option.default}."
    return click.option(f"--{option.name}", type=kind, default=option.default, metavar=option.metavar, help=words)


def _run(
    name: str,
    own: dict[str, Any],
    *,
    axis: int | None,
    place: Path | None,
    seed: int,
    dry_run: bool,
    yes: bool,
    as_json: bool,
    accept: bool,
    replace: bool,
    config_file: Path | None,
    **options: object,
) -> None:
    """Plan, agree, conduct, and tell."""
    if place is not None:
        check_folder(place)
    configuration = _configured(config_file, place, options, replace=replace)
    task = Task.prepare(name, offer(name), configuration, Request(axis, own))
    if dry_run:
        _show_plan(task.plan, as_json=as_json)
        return
    consent = agree(task.plan, configuration.rig.bus.url, yes=yes, quiet=as_json, moves=task.recorded is None)
    with ProcedureBar(quiet=as_json) as bar:
        outcome = conduct(task, place, consent, bar, Terms(seed, accept, replace))
    if as_json:
        click.echo(json.dumps(_as_json(name, outcome), allow_nan=False, ensure_ascii=False))
    else:
        print_outcome(outcome)
    verdict = outcome.result.verdict
    if outcome.deposit is None:
        because = "; ".join(reason.rstrip(".") for reason in verdict.reasons)
        raise Failure(f"{name}: {verdict.grade.value}: {because}; calibration.toml is as it was", MACHINE)


def _configured(
    config_file: Path | None, place: Path | None, options: dict[str, object], *, replace: bool
) -> Configuration:
    """The configuration, with the calibration in force that the result will be added to.

    Raises:
        ConfigurationError: It names another one.
    """
    configuration = configure(config_file, **options)
    there = target_of(configuration, place)
    if replace or not there.exists():
        return configuration
    named = configuration.calibration
    if named is None:
        return configure(config_file, **{**options, "calibration": str(there)})
    if not there.samefile(named):
        raise ConfigurationError(
            f"with the calibration {named} in force a result cannot be added to {there}, whose values were measured"
            " with others: leave one of the two out, or --replace starts a new file there"
        )
    return configuration


def _show_plan(plan: Plan, *, as_json: bool) -> None:
    if not as_json:
        print_plan(plan)
        return
    bounds = plan.bounds
    limits = {
        "torque_nm": bounds.torque,
        "speed_rad_s": bounds.speed,
        "travel_rad": bounds.travel,
        "duration_s": bounds.duration,
    }
    shown = {"title": plan.title, "before": plan.before, "steps": plan.steps, "limits": limits}
    click.echo(json.dumps(shown, ensure_ascii=False))


def _as_json(name: str, outcome: Outcome) -> dict[str, Any]:
    """A result as one object: the procedure's own facts first."""
    verdict = outcome.result.verdict
    written = outcome.deposit
    return {
        "procedure": name,
        **outcome.result.facts,
        "verdict": verdict.grade.value,
        "reasons": verdict.reasons,
        "advice": verdict.advice,
        "estimates": [_estimate(each) for each in outcome.result.estimates],
        "settings": {} if verdict.grade is Grade.FAILED else dict(outcome.result.settings),
        "truth": outcome.truth,
        "notes": outcome.notes,
        "calibration": str(written.path) if written else None,
        "kept": str(written.kept) if written and written.kept else None,
        "record": str(outcome.record),
        "picture": str(outcome.picture),
    }


def _estimate(estimate: Estimate) -> dict[str, Any]:
    ends = {name: None if math.isnan(end) else end for name, end in (("low", estimate.low), ("high", estimate.high))}
    return {"name": estimate.name, "value": estimate.value, **ends, "unit": estimate.unit}
