"""`torquerig sdo`: one object of a drive, read or written, typed by its EDS."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import click

from torquerig.assembly import open_rig
from torquerig.axes import profile_of
from torquerig.cli.options import a_bus_option, config_option, configure_on_bus
from torquerig.configuration import Configuration
from torquerig.driver.master.objects import DriveObjects, Value
from torquerig.driver.master.profile import ObjectAddress, load_profile, parse_address
from torquerig.driver.master.pump import Pump
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.master.sdo_jobs import SdoService
from torquerig.errors import ConfigurationError


class Conversation(NamedTuple):
    """A way to one drive's objects.

    Attributes:
        objects: What its EDS says of them.
        service: Reaches them.
    """

    objects: DriveObjects
    service: SdoService


@click.group("sdo")
def command() -> None:
    """Read or write one object of a drive, typed by its EDS.

    INDEX and SUB are hexadecimal, as in 6076 or 1018:4.
    """


@command.command("read")
@a_bus_option
@config_option
@click.argument("node", type=click.IntRange(1, 127))
@click.argument("index", metavar="INDEX[:SUB]")
def read(bus: str | None, config_file: Path | None, node: int, index: str) -> None:
    """Print the value of an object."""
    configuration = configure_on_bus(config_file, bus)
    address = _address(index)
    with _conversation(configuration, node) as drive:
        value = drive.service.run({node: drive.objects.read(*address)})[node]
        click.echo(f"{drive.objects.title(*address)} = {_shown(value)}")


@command.command("write", context_settings={"ignore_unknown_options": True})
@a_bus_option
@config_option
@click.argument("node", type=click.IntRange(1, 127))
@click.argument("index", metavar="INDEX[:SUB]")
@click.argument("value")
def write(bus: str | None, config_file: Path | None, node: int, index: str, value: str) -> None:
    """Write an object, and print what it holds then. VALUE is a number (0x for hexadecimal) or a text."""
    configuration = configure_on_bus(config_file, bus)
    address = _address(index)
    with _conversation(configuration, node) as drive:
        try:
            job = drive.objects.write(*address, _number_or_text(value))
            drive.service.run({node: job})
        except ValueError as error:
            raise ConfigurationError(str(error)) from error
        held = drive.service.run({node: drive.objects.read(*address)})[node]
        click.echo(f"{drive.objects.title(*address)} = {_shown(held)}")


@contextmanager
def _conversation(configuration: Configuration, node: int) -> Iterator[Conversation]:
    """The bus opened for talking to one drive."""
    axes = {axis.node_id: axis for axis in configuration.rig.axes.legs}
    profile = profile_of(axes[node]) if node in axes else load_profile()
    objects = DriveObjects(node, AxisSettings(node, profile).eds_path)
    with open_rig(configuration) as rig:
        yield Conversation(objects, SdoService(Pump(rig.bus)))


def _address(text: str) -> ObjectAddress:
    """The object's address."""
    try:
        return parse_address(text)
    except ValueError as error:
        raise ConfigurationError(str(error)) from error


def _number_or_text(text: str) -> Value:
    """A number if the text is one, else the text."""
    for kind in (lambda: int(text, 0), lambda: float(text)):
        try:
            return kind()
        except ValueError:
            continue
    return text


def _shown(value: Value) -> str:
    """A value for a person: whole numbers also in hexadecimal."""
    match value:
        case int() if not -10 < value < 10:
            return f"{value} (0x{value:X})" if value >= 0 else str(value)
        case bytes():
            return value.hex(" ").upper() or "(empty)"
        case _:
            return str(value)
