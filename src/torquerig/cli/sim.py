"""`torquerig sim`: the simulated drives as a process."""

from functools import partial
from pathlib import Path

import click

from torquerig.assembly import Build, build_simulation
from torquerig.bench import build_bench
from torquerig.buses import bus_urls, words_for
from torquerig.cli.options import config_option, configure, plant_option, record_option
from torquerig.driver.bus.url import SLCAN_ADAPTER
from torquerig.simulator import simulate
from torquerig.stopping import Stopped


@click.command("sim")
@click.option(
    "--bus",
    metavar="URL",
    help="unix:FOLDER, socketcan:vcan0, or INTERFACE:CHANNEL of python-can; else bus.url of --config.",
)
@click.option(
    "--slcan",
    metavar="LINK",
    help="Instead of a bus, play a serial CAN adapter: LINK becomes the serial port that slcand or python-can opens.",
)
@click.option(
    "--bench",
    metavar="AXIS",
    type=click.IntRange(1, 3),
    help="Be the torque calibration bench instead: this axis' rotor locked, and a torque transducer on the bus.",
)
@plant_option
@config_option
@record_option
def command(
    *,
    bus: str | None,
    slcan: str | None,
    bench: int | None,
    plant: str | None,
    config_file: Path | None,
    record_folder: Path | None,
) -> None:
    """Be the three simulated drives and their machine on a bus, in real time, until Ctrl-C or SIGTERM.

    The record holds the true torques and states of the machine, and every frame.
    """
    if (bus is None and config_file is None) if slcan is None else (bus is not None):
        raise click.UsageError("give either --bus URL or --slcan LINK")
    configuration = configure(config_file, bus=bus if slcan is None else f"{SLCAN_ADAPTER}:{slcan}", plant=plant)
    rig = configuration.rig

    def place() -> str:
        if slcan is None:
            return words_for(bus_urls(rig))
        return f"the serial port {slcan}, which is {Path(slcan).resolve()}"

    node_ids = ", ".join(str(axis.node_id) for axis in rig.axes.legs)
    machine = f"plant {rig.simulator.plant}"
    build: Build = build_simulation
    if bench is not None:
        machine = f"axis {bench} locked against the torque transducer, node {rig.bench.node_id}"
        build = partial(build_bench, axes=(bench,))
    try:
        simulate(
            configuration,
            record=record_folder,
            ready=lambda scheduling: click.echo(
                f"simulated drives {node_ids} on {place()}, {machine}, under {scheduling}; Ctrl-C ends them"
            ),
            tell=click.echo,
            build=build,
        )
    except Stopped:
        if record_folder:
            click.echo(f"Record: {record_folder}")
