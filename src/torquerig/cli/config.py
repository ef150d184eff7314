"""`torquerig config`: the effective configuration."""

import re
from itertools import groupby
from pathlib import Path

import click

from torquerig.cli.options import configure, run_options
from torquerig.configuration import DEFAULT, Setting
from torquerig.toml_text import write

_HEAD = """\
# The effective configuration of torquerig. Behind each value: who set it, then its unit, meaning and source.
# Write only the lines that are to differ into a file of your own, under their [table], and name it:
#     torquerig run --config my.toml
# Options of the command line win over the file, the file over the defaults. [laws.NAME.motion1] takes kp and kv.
"""
_COMMENT_COLUMN = 44


@click.command("config")
@run_options
def command(config_file: Path | None, **options: object) -> None:
    """Print the effective configuration, every value with its source.

    What is printed is a valid configuration file itself. Options of `run` may be given to see what they change.
    """
    configuration = configure(config_file, **options)
    click.echo(_HEAD)
    for table, members in groupby(configuration.settings, lambda setting: setting.key.rpartition(".")[0]):
        click.echo(f"[{_header(table)}]")
        for setting in members:
            click.echo(_line(setting))
        click.echo()


def _line(setting: Setting) -> str:
    """One value as TOML, its source and its note behind it."""
    assignment = f"{setting.key.rpartition('.')[2]} = {write(setting.value)}"
    source = setting.source
    if setting.source != DEFAULT and setting.default is not None:
        source += f" (default {write(setting.default)})"
    return f"{assignment:<{_COMMENT_COLUMN}}# {source}{': ' if setting.note else ''}{setting.note}"


def _header(table: str) -> str:
    """A table's name as TOML writes it: parts that are no bare keys in quotes."""
    return ".".join(part if re.fullmatch(r"[\w-]+", part, re.ASCII) else write(part) for part in table.split("."))
