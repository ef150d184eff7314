"""Options that several commands share, and the configuration they give."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar

import click

from torquerig.configuration import Configuration, load_configuration

Command = TypeVar("Command", bound=Callable[..., Any])

_KEYS: Final = {
    "bus": "bus.url",
    "law": "loop.law",
    "motion": "loop.motion",
    "plant": "simulator.plant",
    "rate": "loop.rate_hz",
    "repeat": "loop.repeat",
    "friction_feedforward": "loop.friction_feedforward",
}
"""Which key of the configuration an option sets."""

config_option = click.option(
    "--config",
    "config_file",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="A TOML file with what differs from the shipped configuration; see `torquerig config`.",
)
bus_option = click.option(
    "--bus",
    metavar="URL",
    help="lockstep: (simulated, in this process), unix:FOLDER, socketcan:vcan0, or INTERFACE:CHANNEL of python-can.",
)
a_bus_option = click.option(
    "--bus", metavar="URL", required=True, help="unix:FOLDER, socketcan:vcan0, or INTERFACE:CHANNEL of python-can."
)
plant_option = click.option(
    "--plant", metavar="NAME", help="The simulator's true machine: ideal, identified, fitted, or one of your own."
)
record_option = click.option(
    "--record",
    "record_folder",
    metavar="DIR",
    type=click.Path(path_type=Path, file_okay=False),
    help="Write a record into this new or empty folder.",
)

_RUN_OPTIONS: Final = (
    bus_option,
    click.option("--law", metavar="NAME", help="decoupled-pd, coupled-pd, augmented-pd or computed-torque."),
    click.option("--motion", metavar="1|2", type=int, help="Test motion of the thesis."),
    plant_option,
    click.option("--rate", metavar="HZ", type=float, help="Cycles a second."),
    click.option("--repeat", metavar="N", type=int, help="How often the motion is run."),
    click.option(
        "--friction-feedforward/--no-friction-feedforward",
        "friction_feedforward",
        default=None,
        help="Feed the model's viscous friction forward, or not; default: as the law has it.",
    ),
    config_option,
)


def run_options(command: Command) -> Command:
    """Add the options that change the configuration of a run."""
    for option in reversed(_RUN_OPTIONS):
        command = option(command)
    return command


def configure(config_file: Path | None, **options: object) -> Configuration:
    """The effective configuration: defaults, then the file, then the options.

    Args:
        config_file: The file of --config.
        options: Values by option name; None where the option was not given.

    Returns:
        The configuration, checked.

    Raises:
        ConfigurationError: If it cannot be used.
    """
    given = {_KEYS[name]: value for name, value in options.items() if value is not None}
    return load_configuration(config_file, given, origin="command line")
