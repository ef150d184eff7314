"""`torquerig reset`: for a person at the machine."""

from pathlib import Path

import click

from torquerig.assembly import open_rig
from torquerig.cli.options import a_bus_option, config_option, configure_on_bus
from torquerig.driver.master.stop import reset


@click.command("reset")
@a_bus_option
@config_option
def command(bus: str | None, config_file: Path | None) -> None:
    """Clear the drives' faults and say what they were. No drive is enabled by it."""
    configuration = configure_on_bus(config_file, bus)
    with open_rig(configuration) as rig:
        for sentence in reset(rig.bus, [axis.node_id for axis in configuration.rig.axes.legs]):
            click.echo(sentence)
