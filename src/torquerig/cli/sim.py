"""`torquerig sim`: the simulated drives as a process."""

from pathlib import Path

import click

from torquerig.cli.options import a_bus_option, config_option, configure, plant_option, record_option
from torquerig.simulator import simulate
from torquerig.stopping import Stopped


@click.command("sim")
@a_bus_option
@plant_option
@config_option
@record_option
def command(bus: str, plant: str | None, config_file: Path | None, record_folder: Path | None) -> None:
    """Be the three simulated drives and their machine on a bus, in real time, until Ctrl-C or SIGTERM.

    The record holds the true torques and states of the machine, and every frame.
    """
    configuration = configure(config_file, bus=bus, plant=plant)
    rig = configuration.rig
    node_ids = ", ".join(str(axis.node_id) for axis in rig.axes.legs)
    try:
        simulate(
            configuration,
            record=record_folder,
            ready=lambda scheduling: click.echo(
                f"simulated drives {node_ids} on {rig.bus.url}, plant {rig.simulator.plant}, under {scheduling};"
                " Ctrl-C ends them"
            ),
        )
    except Stopped:
        if record_folder:
            click.echo(f"Record: {record_folder}")
