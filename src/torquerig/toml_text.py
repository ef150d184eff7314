"""TOML as text: where a key stands in a file and what its comment says, and how a value is written.

tomllib gives values without places. Messages and `torquerig config` name the line.
"""

import json
import re
from collections.abc import Mapping
from datetime import date, datetime, time
from typing import Final, NamedTuple

_BARE_KEY: Final = re.compile(r"[A-Za-z0-9_-]+")
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
        value: A truth value, number, string, date, time, or (nested) list or table of these.

    Returns:
        One line of TOML; of another value, its Python text, for people.
    """
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            # JSON's escapes are TOML's, which wants DEL escaped too
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
        case datetime() | date() | time():
            return value.isoformat()
        case list() | tuple():
            return f"[{', '.join(map(write, value))}]"
        case Mapping():
            return f"{{{', '.join(f'{write_key(str(key))} = {write(each)}' for key, each in value.items())}}}"
        case _:
            return repr(value)


def write_key(key: str) -> str:
    """A key as TOML writes it, in quotes where it must be."""
    return key if _BARE_KEY.fullmatch(key) else write(key)


def _bare(dotted: str) -> str:
    """A dotted key without quotes and blanks."""
    return ".".join(part.strip().strip("\"'") for part in dotted.split("."))


def _comment_of(rest: str) -> str:
    """The comment at the end of a line, empty without one."""
    match = _COMMENT.match(rest)
    return match["comment"] if match else ""
