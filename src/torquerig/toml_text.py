"""TOML as text: where a key stands in a file and what its comment says, and how a value is written.

tomllib gives values without places. Messages and `torquerig config` name the line.
"""

import json
import re
from typing import Final, NamedTuple

_HEADER: Final = re.compile(r"""^\s*\[\s*(?P<table>[\w."'\s-]+?)\s*\]\s*(#.*)?$""")
_ENTRY: Final = re.compile(r"""^\s*(?P<key>[\w."'\s-]+?)\s*=\s*(?P<rest>.*)$""")
_COMMENT: Final = re.compile(r"""^(?:[^"'#]|"(?:[^"\\]|\\.)*"|'[^']*')*#\s*(?P<comment>.*?)\s*$""")


class Place(NamedTuple):
    """Where a key stands.

    Attributes:
        line: Its line, from 1.
        comment: The comment behind its value, empty without one.
    """

    line: int
    comment: str


def places(text: str) -> dict[str, Place]:
    """Where each key and table of a TOML text stands.

    Lines inside multi-line values may be taken for entries; their keys are no one's and do no harm.

    Args:
        text: A valid TOML document.

    Returns:
        The place of every `table.key`, and of every `table`.
    """
    found: dict[str, Place] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = _bare(header["table"])
            found.setdefault(table, Place(number, _comment_of(line)))
        elif entry := _ENTRY.match(line):
            key = _bare(entry["key"])
            found.setdefault(f"{table}.{key}" if table else key, Place(number, _comment_of(entry["rest"])))
    return found


def write(value: object) -> str:
    """A value as TOML writes it.

    Args:
        value: A truth value, number, string, or (nested) list of these.

    Returns:
        One line of TOML.
    """
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return json.dumps(value, ensure_ascii=False)
        case list() | tuple():
            return f"[{', '.join(map(write, value))}]"
        case _:
            return repr(value)


def _bare(dotted: str) -> str:
    """A dotted key without quotes and blanks."""
    return ".".join(part.strip().strip("\"'") for part in dotted.split("."))


def _comment_of(rest: str) -> str:
    """The comment at the end of a line, empty without one."""
    match = _COMMENT.match(rest)
    return match["comment"] if match else ""
