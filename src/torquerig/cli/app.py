"""The group of commands. Each command's module is imported only when it is called: --help answers at once."""

import importlib
import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import Final, NamedTuple

import click

from torquerig.cli.failures import EXIT_CODES, Failure, sentence_of, show, told
from torquerig.stopping import Stopped, orderly_stop


class Entry(NamedTuple):
    """A command that is not imported yet.

    Attributes:
        module: The module whose `command` it is.
        help: What it does, in one line.
    """

    module: str
    help: str


COMMANDS: Final = {
    "run": Entry("torquerig.cli.run", "Run the closed loop once; with no options the thesis' experiment, simulated."),
    "sim": Entry("torquerig.cli.sim", "Be the three simulated drives and their machine on a bus, until Ctrl-C."),
    "show": Entry("torquerig.cli.show", "Tabulate and draw a record."),
    "timing": Entry("torquerig.cli.timing", "Tell how punctual a record's cycles were, and how long each part took."),
    "compare": Entry("torquerig.cli.compare", "Set several records side by side: figures, ratios, and a picture."),
    "nodes": Entry("torquerig.cli.nodes", "Scan a bus: node-id, state, identity and device name."),
    "stop": Entry("torquerig.cli.stop", "Bring all drives to zero torque and disable them."),
    "reset": Entry("torquerig.cli.reset", "Clear the drives' faults."),
    "sdo": Entry("torquerig.cli.sdo", "Read or write one object of a drive."),
    "maps": Entry("torquerig.cli.maps", "Draw stiffness, force transmission and singularities over the workspace."),
    "reproduce": Entry("torquerig.cli.reproduce", "Run all experiments of the thesis and write a report on them."),
    "fit-plant": Entry("torquerig.cli.fit_plant", "Fit a simulated plant to the thesis' sixteen errors."),
    "estimators": Entry("torquerig.cli.estimators", "Compare the estimators of joint rates: noise, delay, the loop."),
    "laws": Entry("torquerig.cli.laws", "List the control laws: equations, gains, and the thesis' results."),
    "dbc": Entry("torquerig.cli.dbc", "Write a DBC of all frames on the rig's bus."),
    "pcap": Entry("torquerig.cli.pcap", "Convert a record's bus.log into a pcap file for Wireshark."),
    "calibrate": Entry("torquerig.cli.calibrate", "Measure the rig: signs, home, torque, friction, delays, model."),
    "bench": Entry("torquerig.cli.bench", "Measure loop, wire, laws, plant and lockstep, each beside something else."),
    "busload": Entry("torquerig.cli.busload", "Tell what fits on a bus: drives, PDOs, rate and bit rate."),
    "jog": Entry("torquerig.cli.jog", "Move a joint or the end-effector by a small amount, under low limits."),
    "hold": Entry("torquerig.cli.hold", "Hold the machine where it stands, under low limits."),
    "config": Entry("torquerig.cli.config", "Print the effective configuration, every value with its source."),
}


class Commands(click.Group):
    """A group that knows its commands by name and imports them when they are called."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002  (click's signature)
        """The names, in the order of the help."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of this name, imported now."""
        entry = COMMANDS.get(cmd_name)
        if entry is None:
            return super().get_command(ctx, cmd_name)
        command: click.Command = importlib.import_module(entry.module).command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write the commands into the help without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, entry.help) for name, entry in COMMANDS.items()])

    def invoke(self, ctx: click.Context) -> object:
        """Run the command; errors that a person can do something about become one sentence and an exit code."""
        with told():
            return super().invoke(ctx)


@click.group(
    cls=Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog=EXIT_CODES,
)
@click.version_option(version("torquerig"), message="torquerig %(version)s")
@click.pass_context
def app(ctx: click.Context) -> None:
    """Torque-mode servo loops over CANopen: the driver, the simulated drives and the machine behind them."""
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: What follows the program's name; the process' own when None.

    Returns:
        The exit code.
    """
    try:
        with orderly_stop():
            code = app.main(arguments, prog_name="torquerig", standalone_mode=False)
    except click.ClickException as error:
        show(error)
        return error.exit_code
    except click.Abort:
        return 130
    except Stopped as stop:
        show(Failure(sentence_of(stop), stop.exit_code))
        return stop.exit_code
    except BrokenPipeError:
        sys.stderr.close()
        return 0
    return code if isinstance(code, int) else 0
