"""Options that several commands share, and the configuration they give."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

import click

from torquerig.cli.places import PictureFile
from torquerig.configuration import DEFAULT, Configuration, load_configuration
from torquerig.control.laws import load_laws

Command = TypeVar("Command", bound=Callable[..., Any])

_KEYS: Final = {
    "bus": "bus.url",
    "calibration": "calibration.file",
    "law": "loop.law",
    "motion": "loop.motion",
    "trajectory": "loop.motion",
    "plant": "simulator.plant",
    "estimator": "loop.estimator",
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
    "--bus",
    metavar="URL",
    help="unix:FOLDER, socketcan:vcan0, or INTERFACE:CHANNEL of python-can; else bus.url of --config.",
)
calibration_option = click.option(
    "--calibration", metavar="FILE", help="A calibration.toml of `torquerig calibrate`, whose values win over --config."
)
plant_option = click.option(
    "--plant", metavar="NAME", help="The simulator's true machine: ideal, identified, fitted, fit5, or one of your own."
)
estimator_option = click.option(
    "--estimator", metavar="NAME", help="How joint rates are estimated: see `torquerig estimators`."
)
record_option = click.option(
    "--record",
    "record_folder",
    metavar="DIR",
    type=click.Path(path_type=Path, file_okay=False),
    help="Write a record into this new or empty folder.",
)


def _motion(_context: click.Context, _parameter: click.Parameter, value: str | None) -> int | str | None:
    """The value of --motion: a number where it is one."""
    return int(value) if value is not None and value.isdecimal() else value


class _LawOption(click.Option):
    """--law, whose help lists the laws that there are when somebody asks for it."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Name and help."""
        self.help = f"The control law: {', '.join(load_laws())}."
        return super().get_help_record(ctx)


_RUN_OPTIONS: Final = (
    bus_option,
    click.option("--law", cls=_LawOption, metavar="NAME"),
    click.option(
        "--motion",
        metavar="1|2|circle|corner",
        callback=_motion,
        help="Test motion of the thesis, or a built-in one: [motion.circle], [motion.corner].",
    ),
    click.option(
        "--trajectory",
        metavar="FILE.csv",
        help="Instead of a motion, a file with the columns time,x,y [s, m]; see docs/motions.md.",
    ),
    plant_option,
    estimator_option,
    click.option("--rate", metavar="HZ", type=float, help="Cycles a second."),
    click.option("--repeat", metavar="N", type=int, help="How often the motion is run."),
    click.option(
        "--friction-feedforward/--no-friction-feedforward",
        "friction_feedforward",
        default=None,
        help="Feed the model's viscous friction forward, or not; default: as the law has it.",
    ),
    config_option,
    calibration_option,
)


def picture_option(words: str) -> Callable[[Command], Command]:
    """The option that says where the picture goes, with its help."""
    return click.option("--picture", "picture_file", metavar="FILE", type=PictureFile(), help=words)


def run_options(command: Command) -> Command:
    """Add the options that change the configuration of a run."""
    for option in reversed(_RUN_OPTIONS):
        command = option(command)
    return command


def simulation_options(command: Command) -> Command:
    """Add the options that change the configuration of a simulated run: all but the bus."""
    for option in reversed([each for each in _RUN_OPTIONS if each is not bus_option]):
        command = option(command)
    return command


def configure(
    config_file: Path | None, beneath: Mapping[str, object] | None = None, /, **options: object
) -> Configuration:
    """The effective configuration: defaults, then the file, then the options.

    Args:
        config_file: The file of --config.
        beneath: Values by dotted key that win over the file, but not over the options.
        options: Values by option name; None where the option was not given.

    Returns:
        The configuration, checked.

    Raises:
        ConfigurationError: If it cannot be used.
        click.UsageError: If two options say the same.
    """
    if options.get("motion") is not None and options.get("trajectory") is not None:
        raise click.UsageError("give either --motion or --trajectory")
    given = {_KEYS[name]: value for name, value in options.items() if value is not None}
    return load_configuration(config_file, {**(beneath or {}), **given}, origin="command line")


def configure_on_bus(config_file: Path | None, bus: str | None) -> Configuration:
    """The effective configuration for a command that needs a bus to be named: by --bus, or by the file.

    Raises:
        ConfigurationError: If it cannot be used.
        click.UsageError: If no bus is named.
    """
    if bus is None and config_file is None:
        raise click.UsageError("Missing option '--bus'.")
    configuration = configure(config_file, bus=bus)
    if bus is None and not any(each.key == "bus.url" and each.source != DEFAULT for each in configuration.settings):
        raise click.UsageError(f"{config_file} names no bus (bus.url): give --bus URL")
    return configuration
