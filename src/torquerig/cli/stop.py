"""`torquerig stop`: for a person at the machine."""

from pathlib import Path

import click

from torquerig.assembly import open_rig
from torquerig.axes import axis_settings
from torquerig.cli.options import a_bus_option, config_option, configure
from torquerig.driver.master.stop import stop


@click.command("stop")
@a_bus_option
@config_option
def command(bus: str, config_file: Path | None) -> None:
    """Bring all drives to zero torque and disable them, whatever state they are in.

    A controller that still runs notices that somebody else commands, and stops too.
    """
    configuration = configure(config_file, bus=bus)
    with open_rig(configuration) as rig:
        for sentence in stop(rig.bus, axis_settings(configuration)):
            click.echo(sentence)
