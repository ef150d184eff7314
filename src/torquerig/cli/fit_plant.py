"""`torquerig fit-plant`: plant parameters that explain the thesis' sixteen errors best."""

import json
from pathlib import Path
from typing import Final, NamedTuple

import click
from rich.console import Console

from torquerig.cli.options import config_option, configure
from torquerig.cli.progress import ProgressBar
from torquerig.complaints import suggestion
from torquerig.configuration import Configuration
from torquerig.control.comparison import published_runs
from torquerig.errors import ConfigurationError
from torquerig.plant_fit.fit import PlantFit, carry_out
from torquerig.plant_fit.parameters import DEFAULT, MOST, PARAMETERS, PlantParameter, chosen_parameters
from torquerig.plant_fit.plant_file import check_free, check_name, plant_toml, write_plant
from torquerig.plant_fit.problem import Problem, thesis_target
from torquerig.plant_fit.report import as_json, show, verdict
from torquerig.plant_fit.search import Effort
from torquerig.plant_fit.workers import workers
from torquerig.schema_machines import Plant
from torquerig.stopping import Stopped

SEED: Final = 2
"""That of the shipped plant fit5."""
_LIST = "\b\nParameters (unit, bounds):\n" + "\n".join(
    f"  {each.name:<17} {each.lowest:g} .. {each.highest:g} {each.unit}: {each.words}" for each in PARAMETERS.values()
)


class Wanted(NamedTuple):
    """What is to be fitted.

    Attributes:
        parameters: What may move.
        plant: The plant that says everything else.
    """

    parameters: tuple[PlantParameter, ...]
    plant: Plant


class Told(NamedTuple):
    """What a person has asked of the search.

    Attributes:
        seed: Of the screening.
        effort: How much to try.
        stopped: Whether the person stopped it.
    """

    seed: int
    effort: Effort
    stopped: bool


@click.command("fit-plant", epilog=_LIST)
@click.option(
    "--parameters",
    metavar="NAMES",
    default=",".join(DEFAULT),
    show_default=True,
    help=f"What to fit: 1 to {MOST} names of the list below, with commas between.",
)
@click.option(
    "--plant",
    metavar="NAME",
    default="fitted",
    show_default=True,
    help="The plant that says everything else, and where the fit begins.",
)
@click.option(
    "--out",
    metavar="FILE.toml",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Write the plant into this new file, for `torquerig run --config FILE.toml --plant NAME`.",
)
@click.option("--name", metavar="NAME", default="found", show_default=True, help="The plant's name in that file.")
@click.option(
    "--seed", metavar="N", type=click.IntRange(min=0), default=SEED, show_default=True, help="Of the screening."
)
@click.option(
    "--screened", metavar="N", type=click.IntRange(8, 4096), default=Effort().screened, show_default=True,
    help="Plants of the screening, rounded up to a power of two.",
)  # fmt: skip
@click.option(
    "--descents", metavar="N", type=click.IntRange(1, 100), default=Effort().starts, show_default=True,
    help=f"Local searches begun at the screening's best plants; the best {Effort().kept} go to their end.",
)  # fmt: skip
@click.option("--json", "as_object", is_flag=True, help="Print one JSON object, and nothing else.")
@config_option
def command(
    *,
    parameters: str,
    plant: str,
    out: Path | None,
    name: str,
    seed: int,
    screened: int,
    descents: int,
    config_file: Path | None,
    as_object: bool,
) -> None:
    """Find plant parameters that explain the sixteen errors of the thesis' Tables 6.1 and 6.2 best.

    Eight closed loops are run for each plant tried, with the wire's delays but without its frames; the best is run over
    the wire in the end. What comes out is never a validated plant: sixteen numbers do not settle five parameters.
    Ctrl-C ends the search with the best so far.
    """
    base = configure(config_file)
    wanted = _wanted(base, parameters, plant)
    check_name(name)
    if out:
        check_free(out)
    effort = Effort(screened=1 << (screened - 1).bit_length(), starts=descents)
    with ProgressBar(quiet=as_object) as bar:
        fit, stop = _search(base, wanted, effort, seed, bar)
    told = Told(seed, effort, stopped=stop is not None)
    if out and fit.best is not None:
        write_plant(out, _file(fit, plant, name, told))
    if as_object:
        click.echo(json.dumps(as_json(fit, seed, stopped=told.stopped), allow_nan=False))
    else:
        show(fit, Console(highlight=False))
        if out and fit.best is not None:
            click.echo(f"Plant: {out}, to be run by torquerig run --config {out} --plant {name}")
    if stop:
        raise stop


def _wanted(base: Configuration, parameters: str, plant: str) -> Wanted:
    """What to fit, checked."""
    chosen = chosen_parameters([each.strip() for each in parameters.split(",") if each.strip()])
    if plant not in base.rig.plant:
        raise ConfigurationError(f"--plant {plant!r} is not a plant{suggestion(plant, base.rig.plant)}")
    return Wanted(chosen, base.rig.plant[plant])


def _search(
    base: Configuration, wanted: Wanted, effort: Effort, seed: int, bar: ProgressBar
) -> tuple[PlantFit, Stopped | None]:
    """What the search has found until its end, or until somebody stopped it."""
    runs = published_runs()
    bar.phase("starting")
    with workers(base) as helpers:
        fit = PlantFit(Problem(wanted.parameters, wanted.plant, runs, helpers, thesis_target(runs)))
        try:
            carry_out(fit, effort, seed, bar)
        except Stopped as stop:
            return fit, stop
    return fit, None


def _file(fit: PlantFit, base: str, name: str, told: Told) -> str:
    """The plant found as a file."""
    assert fit.best is not None  # noqa: S101  (asked before)
    names = [each.name for each in fit.problem.parameters]
    keys = {"coulomb" if each.startswith("coulomb") else each for each in names}
    if "coulomb" in keys:
        keys.add("breakaway")  # it moves along, so that it holds no less
    head = [
        f"torquerig fit-plant --parameters {','.join(names)} --plant {base} --seed {told.seed}"
        f" --screened {told.effort.screened} --descents {told.effort.starts}{' (stopped)' if told.stopped else ''}",
        f"typical factor {fit.best.factor:.4f} against the thesis' Tables 6.1 and 6.2: {verdict(fit)}",
        f"what is not marked is as in plant.{base}",
    ]
    return plant_toml(name, fit.problem.plant_at(fit.best.point), head, dict.fromkeys(keys, "fitted"))
