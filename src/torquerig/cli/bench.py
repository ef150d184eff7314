"""`torquerig bench`: what the loop, the wire, the laws, the plant and lockstep cost, each beside something else."""

import json
from typing import TYPE_CHECKING, Any, Final

import click
from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from torquerig.benchmarks.loop import LoopTimes, Times

_TURNS: Final = 31
_TURN_S: Final = 0.05
_SAME_RUN: Final = "Medians of turns that alternated; on a busy machine believe the ratios, not the times."

turns_option = click.option(
    "--turns", type=click.IntRange(1, 10_000), default=_TURNS, show_default=True, help="How many turns each has."
)
turn_option = click.option(
    "--turn",
    "turn_s",
    metavar="S",
    type=click.FloatRange(1e-4, 60.0),
    default=_TURN_S,
    show_default=True,
    help="How long a turn lasts, about.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object, and nothing else.")


@click.group("bench")
def command() -> None:
    """Measure the loop, the wire, the laws, the plant or lockstep, each beside something else in the same run."""


@command.command("law")
@turns_option
@turn_option
@json_option
def law(turns: int, turn_s: float, *, as_json: bool) -> None:
    """Time the laws as the loop runs them, beside plain numpy; and four ways to the inverse dynamics."""
    from torquerig.benchmarks.law import measure  # noqa: PLC0415  (imports half the program)

    costs = measure(turns=turns, turn_s=turn_s)
    if as_json:
        _print_json(costs.as_json())
        return
    table = _table("One cycle's mathematics", "", "loop [µs]", "best [µs]", "numpy [µs]", "numpy / loop")
    for name, cost in costs.laws.items():
        _row(table, name, cost.loop_us, cost.loop_best_us, cost.numpy_us, cost.numpy_over_loop)
    ways = _table("Inverse dynamics, compiled", "", "operations", "time [ns]")
    for way in costs.inverse_dynamics:
        ways.add_row(way.method, f"{way.operations}", f"{way.total_ns:.0f}")
    _print(table, ways, _SAME_RUN)


@command.command("plant")
@turns_option
@turn_option
@json_option
def plant(turns: int, turn_s: float, *, as_json: bool) -> None:
    """Time a step of the simulated machine, beside plain numpy and, where it is installed, MuJoCo."""
    from torquerig.benchmarks.plant import measure  # noqa: PLC0415
    from torquerig.benchmarks.plant_mujoco import HOW_TO_GET_IT  # noqa: PLC0415

    cost = measure(turns=turns, turn_s=turn_s)
    if as_json:
        _print_json(cost.as_json())
        return
    table = _table(f"A step of {cost.step_ns / 1000:g} µs", "", "time [µs]", "/ ours", "error in 40 ms [m]")
    table.add_row("ours", f"{cost.ours_us:.2f}", "1", f"{cost.ours_error_m:.1e}")
    table.add_row("numpy RK4", f"{cost.numpy_us:.2f}", f"{cost.numpy_over_ours:.1f}", f"{cost.numpy_error_m:.1e}")
    if cost.mujoco_us is None:
        _print(table, _SAME_RUN, f"MuJoCo is not installed: {HOW_TO_GET_IT}")
        return
    table.add_row("MuJoCo RK4", f"{cost.mujoco_us:.2f}", f"{cost.mujoco_over_ours:.1f}", f"{cost.mujoco_error_m:.1e}")
    _print(table, _SAME_RUN)


@command.command("lockstep")
@click.option("--turns", type=click.IntRange(1, 1000), default=5, show_default=True, help="How many turns each has.")
@click.option(
    "--turn",
    "turn_s",
    metavar="S",
    type=click.FloatRange(1e-3, 60.0),
    default=0.3,
    show_default=True,
    help="How long a turn lasts, about.",
)
@json_option
def lockstep(turns: int, turn_s: float, *, as_json: bool) -> None:
    """Measure how fast simulated time passes, with 3, 12 and 30 drives and with a whole run."""
    from torquerig.benchmarks.lockstep import measure  # noqa: PLC0415

    rows = measure(turns=turns, turn_s=turn_s)
    if as_json:
        _print_json({"lockstep": [row._asdict() for row in rows]})
        return
    table = _table(
        "Simulated seconds a second", "rate [Hz]", "drives", "machine", "wire [Mbit/s]", "median", "best", "µs / drive"
    )
    for row in rows:
        each_us = 1e6 / row.rate_hz / row.drives / row.times_real_time
        figures = (f"{row.bit_rate / 1e6:g}", f"{row.times_real_time:.2f}", f"{row.best:.2f}", f"{each_us:.0f}")
        table.add_row(f"{row.rate_hz:g}", f"{row.drives}", row.machine, *figures)
    _print(table, "µs / drive: of computing, a drive and cycle; the same for all if time grows as the drives do.")


@command.command("wire")
@click.option(
    "--bus",
    metavar="URL",
    default="unix:",
    show_default=True,
    help="unix: (in a folder of its own), pair: (the kernel CAN's code over pairs of Unix sockets), socketcan:vcan0.",
)
@turns_option
@turn_option
@json_option
def wire(bus: str, turns: int, turn_s: float, *, as_json: bool) -> None:
    """Time a cycle's frames: ours, python-can, canopen, and a bare socket as the floor."""
    from torquerig.benchmarks.wire import measure  # noqa: PLC0415

    cost = measure(bus, turns=turns, turn_s=turn_s)
    if as_json:
        _print_json(cost.as_json())
        return
    table = _table(f"SYNC, 3 TPDOs, 3 RPDOs over {cost.bus}", "", "time [µs]")
    for name, us in (
        ("bare socket and struct", cost.floor_us),
        ("ours", cost.ours_us),
        ("python-can and struct", cost.python_can_us),
        ("canopen's PDO objects", cost.canopen_us),
    ):
        _row(table, name, us)
    ratios = (
        f"Ours is {cost.ours_over_floor:.2f} times the floor; python-can is {cost.python_can_over_ours:.2f} times ours,"
        f" canopen {cost.canopen_over_ours:.2f} times."
    )
    _print(table, ratios, _SAME_RUN)


@command.command("loop")
@click.option("--bus", metavar="URL", help="Of a real-time bus; default: a unix bus in a temporary folder.")
@click.option(
    "--seconds",
    metavar="S",
    type=click.FloatRange(0.1, 3600.0),
    default=10.0,
    show_default=True,
    help="How long at each rate.",
)
@click.option(
    "--rate",
    "rates_hz",
    metavar="HZ",
    type=click.FloatRange(10.0, 10_000.0),
    multiple=True,
    help="A rate; may be given again. Default: 250, 500, 1000, 2000 and 4000.",
)
@json_option
def loop(bus: str | None, seconds: float, rates_hz: tuple[float, ...], *, as_json: bool) -> None:
    """Run the loop in real time at several rates, the simulated drives in a process of their own."""
    from torquerig.benchmarks.loop import RATES_HZ, measure  # noqa: PLC0415

    tell = (lambda _words: None) if as_json else (lambda words: click.echo(words, err=True))
    times = measure(bus, seconds=seconds, rates_hz=rates_hz or RATES_HZ, tell=tell)
    if as_json:
        _print_json(times.as_json())
    else:
        _print_loop(times)


def _print_loop(times: "LoopTimes") -> None:
    """Print the rates for a person."""
    headings = ("rate [Hz]", "cycles", "overruns", "SYNC late [µs]", "SYNC to RPDOs [µs]", "bare timer late [µs]")
    table = _table(f"The loop over {times.bus}: p50 / p99 / p99.9 / max", *headings)
    stopped = []
    for row in times.rates:
        timer = row.cyclictest_us
        bare = "-" if timer is None else f"{timer.mean:.0f} mean / {timer.max:.0f} max"
        late = "-" if row.overruns is None else f"{row.overruns}"
        table.add_row(f"{row.rate_hz:g}", f"{row.cycles}", late, _times(row.lateness_us), _times(row.latency_us), bare)
        if row.stopped:
            stopped.append(f"{row.rate_hz:g} Hz was stopped: {row.stopped}")
    hint = [] if any(row.cyclictest_us for row in times.rates) else ["cyclictest is not installed: package rt-tests"]
    _print(table, *stopped, *filter(None, [times.scheduling]), *hint)


def _times(times: "Times | None") -> str:
    if times is None:
        return "-"
    return f"{times.p50:.0f} / {times.p99:.0f} / {times.p999:.0f} / {times.max:.0f}"


def _table(title: str, *headings: str) -> Table:
    """An empty table: words to the left, numbers to the right."""
    table = Table(title=title, title_justify="left")
    for number, heading in enumerate(headings):
        table.add_column(heading, justify="right" if number else "left", no_wrap=not number)
    return table


def _row(table: Table, name: str, *numbers: float) -> None:
    table.add_row(name, *(f"{number:.1f}" for number in numbers))


def _print(*parts: Table | str) -> None:
    console = Console(highlight=False)
    for part in parts:
        console.print(part, soft_wrap=isinstance(part, str), markup=False)


def _print_json(figures: dict[str, Any]) -> None:
    click.echo(json.dumps(figures, allow_nan=False))
