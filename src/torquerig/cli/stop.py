"""`torquerig stop`: for a person at the machine."""

from contextlib import ExitStack, closing
from pathlib import Path

import click

from torquerig.assembly import open_rig
from torquerig.axes import axis_settings
from torquerig.buses import bus_urls, homes_of
from torquerig.cli.options import a_bus_option, config_option, configure_on_bus
from torquerig.configuration import Configuration
from torquerig.driver.bus.url import open_bus
from torquerig.driver.errors import BusError, BusUrlError, TorqueRigError
from torquerig.driver.master.stop import stop


@click.command("stop")
@a_bus_option
@config_option
def command(bus: str | None, config_file: Path | None) -> None:
    """Bring all drives to zero torque and disable them, whatever state they are in.

    Of several buses, one that cannot be used does not keep the drives on the others from being stopped. A controller
    that still runs notices that somebody else commands, and stops too.
    """
    configuration = configure_on_bus(config_file, bus)
    with ExitStack() as stack:
        try:
            rig = stack.enter_context(open_rig(configuration))
        except (BusError, BusUrlError):
            if len(bus_urls(configuration.rig)) == 1:
                raise
            _stop_one_by_one(configuration)
            return
        for sentence in stop(rig.bus, axis_settings(configuration)):
            click.echo(sentence)


def _stop_one_by_one(configuration: Configuration) -> None:
    """Stop the drives on each bus by itself.

    Raises:
        TorqueRigError: Of the first bus on which that failed, with what the others said as notes.
    """
    axes, homes, failures = axis_settings(configuration), homes_of(configuration.rig), list[TorqueRigError]()
    for place, url in enumerate(bus_urls(configuration.rig)):
        try:
            with closing(open_bus(url, bitrate=configuration.rig.bus.bitrate)) as bus:
                for sentence in stop(bus, [axis for axis in axes if homes[axis.node_id] == place]):
                    click.echo(sentence)
        except TorqueRigError as error:
            failures.append(error)
    if failures:
        for other in failures[1:]:
            failures[0].add_note(str(other))
        raise failures[0]
