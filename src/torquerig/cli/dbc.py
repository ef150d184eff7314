"""`torquerig dbc`: what the frames on the bus mean, for programs that read DBC."""

from pathlib import Path

import click

from torquerig.axes import axis_settings
from torquerig.bench import transducer_settings
from torquerig.cli.options import config_option, configure
from torquerig.configuration import DEFAULT
from torquerig.exports.dbc import dbc_text
from torquerig.exports.drives import PdoSource, rig_messages


@click.command("dbc")
@config_option
@click.option(
    "--pdos",
    "source",
    type=click.Choice([each.value for each in PdoSource]),
    default=PdoSource.DRIVER.value,
    show_default=True,
    help="Which PDOs: those that the driver configures, or those that the drives' EDS ships.",
)
@click.option(
    "--bench",
    is_flag=True,
    help="With the transducer of the torque bench; default: if the configuration's file has a table [bench].",
)
@click.option(
    "--output",
    metavar="FILE",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Where it goes; default: standard output.",
)
def command(config_file: Path | None, source: str, output: Path | None, *, bench: bool) -> None:
    """Write a DBC of all frames on the rig's bus, in rad and Nm by the axes' settings.

    With the configuration of a run it decodes the run's bus.log to the numbers in its cycles.parquet.
    """
    configuration = configure(config_file)
    has_bench = bench or any(
        each.key.startswith("bench.") and each.source != DEFAULT for each in configuration.settings
    )
    transducer = transducer_settings(configuration.rig) if has_bench else None
    axes, master_id = axis_settings(configuration), configuration.rig.master.node_id
    messages = rig_messages(axes, master_id, PdoSource(source), transducer)
    text = dbc_text(messages)
    if output is None:
        click.echo(text, nl=False)
        return
    try:
        output.write_text(text, encoding="ascii", newline="\n")
    except OSError as error:
        raise click.BadParameter(f"{output} cannot be written: {error.strerror}", param_hint="--output") from error
