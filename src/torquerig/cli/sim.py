"""`torquerig sim`: the simulated drives as a process."""

from pathlib import Path

import click

from torquerig.cli.options import config_option, configure, plant_option, record_option
from torquerig.driver.bus.url import SLCAN_ADAPTER
from torquerig.simulator import simulate
from torquerig.stopping import Stopped


@click.command("sim")
@click.option("--bus", metavar="URL", help="unix:FOLDER, socketcan:vcan0, or INTERFACE:CHANNEL of python-can.")
@click.option(
    "--slcan",
    metavar="LINK",
    help="Instead of a bus, play a serial CAN adapter: LINK becomes the serial port that slcand or python-can opens.",
)
@plant_option
@config_option
@record_option
def command(
    bus: str | None, slcan: str | None, plant: str | None, config_file: Path | None, record_folder: Path | None
) -> None:
    """Be the three simulated drives and their machine on a bus, in real time, until Ctrl-C or SIGTERM.

    The record holds the true torques and states of the machine, and every frame.
    """
    if (bus is None) == (slcan is None):
        raise click.UsageError("give either --bus URL or --slcan LINK")
    configuration = configure(config_file, bus=bus or f"{SLCAN_ADAPTER}:{slcan}", plant=plant)
    rig = configuration.rig

    def place() -> str:
        return rig.bus.url if slcan is None else f"the serial port {slcan}, which is {Path(slcan).resolve()}"

    node_ids = ", ".join(str(axis.node_id) for axis in rig.axes.legs)
    try:
        simulate(
            configuration,
            record=record_folder,
            ready=lambda scheduling: click.echo(
                f"simulated drives {node_ids} on {place()}, plant {rig.simulator.plant}, under {scheduling};"
                " Ctrl-C ends them"
            ),
            tell=click.echo,
        )
    except Stopped:
        if record_folder:
            click.echo(f"Record: {record_folder}")
