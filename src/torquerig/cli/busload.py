"""`torquerig busload`: what fits on a bus."""

import json
from collections import Counter

import click
from rich.console import Console
from rich.table import Table

from torquerig.bus_trial import Trial, attempt
from torquerig.busload import HIGHEST_LOAD, RPDO_BYTES, SHORT_TPDO_BYTES, TPDO_BYTES, Budget, Plan, budget, budgets


@click.command("busload")
@click.option("--drives", type=click.IntRange(1, 127), default=3, show_default=True)
@click.option("--rate", "rate_hz", metavar="HZ", type=click.FloatRange(1, 20_000), default=250.0, show_default=True)
@click.option(
    "--bitrate",
    "bit_rate",
    metavar="BIT/S",
    type=click.IntRange(10_000, 1_000_000),
    default=1_000_000,
    show_default=True,
)
@click.option(
    "--buses", type=click.IntRange(1, 127), default=1, show_default=True, help="Spread the drives over so many."
)
@click.option(
    "--tpdo", "tpdo_bytes", metavar="BYTES", type=click.IntRange(0, 8), help=f"Of TPDO1; default {TPDO_BYTES}."
)
@click.option("--rpdo", "rpdo_bytes", metavar="BYTES", type=click.IntRange(0, 8), default=RPDO_BYTES, show_default=True)
@click.option(
    "--group-rpdo", is_flag=True, help=f"One RPDO carries up to four torques, and TPDO1 {SHORT_TPDO_BYTES} bytes."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, and nothing else.")
def command(*, tpdo_bytes: int | None, group_rpdo: bool, as_json: bool, **numbers: float) -> None:
    """Tell what SYNC, TPDOs and RPDOs take of a bus, how fast they can go, and what happens beyond that."""
    usual = SHORT_TPDO_BYTES if group_rpdo else TPDO_BYTES
    length = usual if tpdo_bytes is None else tpdo_bytes
    try:
        plan = Plan(tpdo_bytes=length, group_rpdo=group_rpdo, **numbers)  # type: ignore[arg-type]  # by click's types
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    taken, trial = budget(plan), attempt(plan)
    if as_json:
        click.echo(json.dumps(_as_json(taken, trial), allow_nan=False))
    else:
        _print(taken, trial)


def _as_json(taken: Budget, trial: Trial) -> dict[str, object]:
    return {
        "drives": taken.plan.drives,
        "buses": taken.plan.buses,
        "rate_hz": taken.plan.rate_hz,
        "bitrate": taken.plan.bit_rate,
        "frames": [row._asdict() for row in taken.rows],
        "cycle_bits": taken.cycle_bits,
        "cyclic_load": taken.cyclic_load,
        "load": taken.load,
        "fits": taken.fits,
        "fastest_hz": taken.fastest_hz,
        "roomy_hz": taken.roomy_hz,
        "answered_hz": taken.answered_hz,
        "limit_hz": taken.limit_hz,
        "each_bus": [
            {"drives": drives, "cyclic_load": each.cyclic_load, "load": each.load}
            for drives, each in zip(taken.plan.spread, budgets(taken.plan), strict=True)
        ],
        "trial": trial._asdict(),
    }


def _print(taken: Budget, trial: Trial) -> None:
    plan, console = taken.plan, Console(highlight=False)
    where = (
        "the bus"
        if plan.buses == 1
        else f"the fullest of {plan.buses} buses, which has {plan.drives_on_fullest} of them"
    )
    table = Table(
        title=f"{plan.drives} drives at {plan.rate_hz:g} Hz, {where}, {plan.bit_rate} bit/s", title_justify="left"
    )
    table.add_column("frame")
    for heading in ("bytes", "bits at worst", "1/s", "load %"):
        table.add_column(heading, justify="right")
    for row in taken.rows:
        load = 100 * row.bits * row.per_second / plan.bit_rate
        table.add_row(row.name, f"{row.data_bytes}", f"{row.bits}", f"{row.per_second:.0f}", f"{load:.1f}")
    table.add_row("all", "", f"{taken.cycle_bits:.0f} a cycle", "", f"{100 * taken.load:.1f}")
    console.print(table)
    if plan.buses > 1:
        loads = Counter((drives, each.load) for drives, each in zip(plan.spread, budgets(plan), strict=True))
        words = [f"{many} with {drives} drives {100 * load:.1f} %" for (drives, load), many in loads.items()]
        console.print(f"Load of the buses: {'; '.join(words)}.", soft_wrap=True)
    tpdo_us, rpdo_us = taken.tpdo_ns / 1000, taken.rpdo_ns / 1000
    console.print(
        f"SYNC to last TPDO {tpdo_us:.0f} µs, RPDOs {rpdo_us:.0f} µs on an otherwise idle bus.", soft_wrap=True
    )
    console.print(
        f"{_verdict(taken)}: up to {taken.roomy_hz:.0f} Hz leave {100 * (1 - HIGHEST_LOAD):.0f} % for heartbeats,"
        f" SDO and EMCY, up to {taken.answered_hz:.0f} Hz bring every TPDO within half a period, for which the driver"
        f" waits; at {taken.limit_hz:.0f} Hz the bus is full.",
        soft_wrap=True,
    )
    console.print(_tried(trial, plan.buses), soft_wrap=True)


def _verdict(taken: Budget) -> str:
    if taken.fits:
        return "It fits"
    if taken.cyclic_load > 1 or taken.plan.rate_hz > taken.answered_hz:
        return "It does not fit"
    return "It fits, without room to spare"


def _tried(trial: Trial, buses: int) -> str:
    wires = "wire" if buses == 1 else "wires"
    words = f"On the simulated {wires} {trial.late} of {trial.cycles} cycles were late"
    if trial.tpdo_us is None:
        words += ", in none were all TPDOs there within half a period"
    if trial.waiting:
        return f"{words}, and {trial.waiting} frames still waited at the end."
    return f"{words}; the last RPDO was through {trial.rpdo_us or 0:.0f} µs after SYNC was due, at worst."
