"""`torquerig laws`: the control laws, each as its own file tells it."""

import inspect
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from torquerig.control.law import Law
from torquerig.control.laws import law_named, load_laws

HEADINGS = ("law", "motion", "kp", "kv", "position [mm]", "velocity [m/s]", "running time [ms]")
"""The last three are the thesis': its RMSE, and what the law took on its computer."""


@dataclass(frozen=True, slots=True)
class LawFacts:
    """What a law's file tells of it.

    Attributes:
        name: Its name on the command line.
        equation: The first line of its docstring; of its file where it has none.
        more: The rest of its docstring.
        file: The name of its file.
        rows: A row a test motion, in the order of `HEADINGS`; None where the thesis has nothing.
    """

    name: str
    equation: str
    more: str
    file: str
    rows: tuple[tuple[str | float | None, ...], ...]

    @classmethod
    def of(cls, law: type[Law]) -> "LawFacts":
        """The facts of a law."""
        equation, _, more = _docstring(law).partition("\n")
        return cls(law.name, equation, more.strip(), Path(inspect.getfile(law)).name, tuple(_rows(law)))

    def as_json(self) -> dict[str, Any]:
        """The facts as JSON holds them."""
        keys = ("motion", "kp", "kv", "thesis_position_rmse_mm", "thesis_velocity_rmse_m_s", "thesis_ms")
        motions = [dict(zip(keys, row[1:], strict=True)) for row in self.rows]
        return {"law": self.name, "equation": self.equation, "more": self.more, "file": self.file, "motions": motions}


@click.command("laws")
@click.argument("names", metavar="[NAME...]", nargs=-1)
@click.option("--markdown", is_flag=True, help="Print a page for a documentation, and nothing else.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, and nothing else.")
def command(names: tuple[str, ...], *, markdown: bool, as_json: bool) -> None:
    """List the control laws: equation, gains, and the thesis' results, all of them or those named.

    The list is made from the files in control/laws: a law that is put there is in it.
    """
    if markdown and as_json:
        raise click.UsageError("--markdown and --json are two forms of one list: give one of them")
    laws = [LawFacts.of(law) for law in (map(law_named, names) if names else load_laws().values())]
    if as_json:
        click.echo(json.dumps({"laws": [law.as_json() for law in laws]}, ensure_ascii=False, allow_nan=False))
    elif markdown:
        click.echo("\n".join(_page(laws)))
    else:
        _print(laws, whole=bool(names))


def _docstring(law: type[Law]) -> str:
    """A law's own docstring; where it has none, which is told from the one that dataclass makes, its file's."""
    own = law.__doc__ or ""
    if not own or own.startswith(f"{law.__name__}("):
        own = inspect.getdoc(inspect.getmodule(law)) or ""
    return inspect.cleandoc(own) or "it has no docstring"


def _rows(law: type[Law]) -> Iterator[tuple[str | float | None, ...]]:
    """A row a motion."""
    for motion, (kp, kv) in sorted(law.gains.items()):
        result = law.published.get(motion)
        thesis = (result.position_rmse_mm, result.velocity_rmse_m_s) if result and result.is_of_thesis else (None, None)
        yield (law.name, motion, kp, kv, *thesis, law.thesis_ms())


def _cells(row: Sequence[str | float | None]) -> list[str]:
    """A row as it is shown: a dash for what the thesis does not have."""
    name, motion, kp, kv, position, velocity, ms = row
    results = [f"{value:.{digits}f}" if isinstance(value, float) else "-"
               for value, digits in ((position, 4), (velocity, 4), (ms, 2))]  # fmt: skip
    return [str(name), str(motion), f"{kp:g}", f"{kv:g}", *results]


def _page(laws: Sequence[LawFacts]) -> Iterator[str]:
    """The lines of a page in Markdown."""
    yield "Position and velocity are the RMSE of the thesis, the running time is that on its computer."
    yield ""
    yield f"| {' | '.join(HEADINGS)} |"
    yield f"| --- |{' ---: |' * (len(HEADINGS) - 1)}"
    for law in laws:
        for row in law.rows:
            yield f"| {' | '.join(_cells(row))} |"
    for law in laws:
        yield ""
        yield f"**{law.name}** ({law.file}): `{law.equation}`"
        if law.more:
            yield ""
            yield law.more


def _print(laws: Sequence[LawFacts], *, whole: bool) -> None:
    """Print the laws for a person, with all that their docstrings say where they were asked for."""
    console = Console(highlight=False)
    table = Table(box=SIMPLE_HEAD, padding=0, caption="the thesis' RMSE, and what the law took on its computer")
    for place, heading in enumerate(HEADINGS):
        lines = heading.replace(" [", "\n[")
        table.add_column(escape(lines), justify="right" if place else "left", no_wrap=True)
    for law in laws:
        for row in law.rows:
            table.add_row(*map(escape, _cells(row)))
    console.print(table)
    for law in laws:
        console.print(f"{law.name} ({law.file})\n    {law.equation}", markup=False, soft_wrap=True)
        if whole and law.more:
            console.print(law.more, markup=False, soft_wrap=True)
