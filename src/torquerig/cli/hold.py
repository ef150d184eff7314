"""`torquerig hold`: the machine stays where it stands."""

import json
from pathlib import Path
from typing import Final

import click

from torquerig.calibrating.conducting import perform
from torquerig.calibrating.moving import HOLD
from torquerig.calibrating.offer import Request
from torquerig.calibrating.task import Task
from torquerig.cli.agreement import agree
from torquerig.cli.calibrate_text import print_estimates
from torquerig.cli.failures import MACHINE, USAGE, Failure, sentence_of
from torquerig.cli.options import bus_option, calibration_option, config_option, configure, plant_option
from torquerig.cli.procedure_bar import ProcedureBar
from torquerig.driver.bus.url import LOCKSTEP
from torquerig.stopping import Stopped

A_DAY: Final = 86400.0


@click.command("hold")
@click.option("--seconds", metavar="S", type=float, help="How long [s]; default: until Ctrl-C.")
@click.option("--torque", metavar="NM", type=float, default=0.2, help="The most that is used [N·m]. Default: 0.2.")
@bus_option
@click.option("--yes", is_flag=True, help="Agree to the plan and its limits: for scripts.")
@click.option("--json", "as_json", is_flag=True, help="Print what it took as one JSON object, and nothing else.")
@plant_option
@config_option
@calibration_option
def command(
    *, seconds: float | None, torque: float, yes: bool, as_json: bool, config_file: Path | None, **options: object
) -> None:
    """Hold every joint where it stands, under low limits; then let go, drives disabled.

    Nothing has to be homed. Ctrl-C and SIGTERM are its ordinary end.
    """
    configuration = configure(config_file, **options)
    url = configuration.rig.bus.url
    if seconds is None and url.partition(":")[0] == LOCKSTEP:
        raise Failure("simulated time passes faster than anybody presses Ctrl-C: say how long with --seconds", USAGE)
    wanted = {"seconds": A_DAY if seconds is None else seconds, "torque": torque}
    task = Task.prepare("hold", HOLD, configuration, Request(None, wanted))
    agree(task.plan, url, yes=yes, quiet=as_json)
    try:
        with ProcedureBar(quiet=as_json) as bar:
            result, notes = perform(task, bar)
    except Stopped as stop:
        if hasattr(stop, "__notes__"):
            raise Failure(sentence_of(stop), MACHINE) from stop
        click.echo(json.dumps({"ended": str(stop)}) if as_json else f"{stop}: let go, drives disabled")
        return
    if as_json:
        click.echo(json.dumps({**result.facts, "notes": notes}, allow_nan=False, ensure_ascii=False))
    else:
        print_estimates(result, notes)
