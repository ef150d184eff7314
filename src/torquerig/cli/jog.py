"""`torquerig jog`: a small, slow move."""

import json
from pathlib import Path

import click

from torquerig.calibrating.conducting import perform
from torquerig.calibrating.moving import JOG
from torquerig.calibrating.offer import Request
from torquerig.calibrating.task import Task
from torquerig.cli.agreement import agree
from torquerig.cli.calibrate_text import print_estimates
from torquerig.cli.options import bus_option, calibration_option, config_option, configure, plant_option
from torquerig.cli.procedure_bar import ProcedureBar


@click.command("jog")
@click.option("--axis", metavar="N", type=click.IntRange(1, 3), help="The joint to turn, with --by.")
@click.option("--by", metavar="DEG", type=float, help="By how much the joint turns [°], at most 10.")
@click.option("--x", metavar="MM", type=float, help="By how much the end-effector goes along x [mm].")
@click.option("--y", metavar="MM", type=float, help="And along y; at most 20 mm in all.")
@click.option("--hold", metavar="S", type=float, default=0.2, help="How long the end is held [s]. Default: 0.2.")
@click.option("--torque", metavar="NM", type=float, default=0.2, help="The most that is used [N·m]. Default: 0.2.")
@bus_option
@click.option("--yes", is_flag=True, help="Agree to the plan and its limits: for scripts.")
@click.option("--json", "as_json", is_flag=True, help="Print where it went as one JSON object, and nothing else.")
@plant_option
@config_option
@calibration_option
def command(
    *,
    axis: int | None,
    by: float | None,
    x: float | None,
    y: float | None,
    hold: float,
    torque: float,
    yes: bool,
    as_json: bool,
    config_file: Path | None,
    **options: object,
) -> None:
    """Move a joint or the end-effector by a small amount, slowly and under low limits; hold, then let go.

    No joint moves alone: with --axis the end-effector goes by the least that turns the joint so far.
    """
    configuration = configure(config_file, **options)
    wanted = {"by": by, "x": x, "y": y, "hold": hold, "torque": torque}
    task = Task.prepare("jog", JOG, configuration, Request(axis, wanted))
    agree(task.plan, configuration.rig.bus.url, yes=yes, quiet=as_json)
    with ProcedureBar(quiet=as_json) as bar:
        result, notes = perform(task, bar)
    notes += (*result.verdict.reasons, *result.verdict.advice)
    if as_json:
        click.echo(json.dumps({**result.facts, "notes": notes}, allow_nan=False, ensure_ascii=False))
    else:
        print_estimates(result, notes)
