"""What the suite proves: a fact for each test, less the bus, and the table of them all in docs/conformance.md."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import Final, NamedTuple

import pytest

# buses by the words of a test's parameter, in the order of the table's columns
BUSES: Final = {"wire": "simulated wire", "unix": "unix", "vcan": "vcan (kernel)", "bench": "virtual time"}
JUDGES: Final = ("golden bytes", "golden bytes at exact times", "canopen", "node-canopen")

INTRODUCTION: Final = """\
# Conformance

What other people's rules and programs find when they meet the simulated drives. This page is written by the suite:

    pytest tests/conformance --collect-only -q --conformance-table docs/conformance.md

A test holds it against the suite, which runs with all others (`make test`). Every fact below is one test on each of the
buses named, and none of them imports a codec of ours.

- **golden bytes**: conversations typed from CiA 301 and CiA 402, byte by byte. Node 1 must say what is expected, and
  nothing else. Held over a simulated wire in virtual time, over the unix bus and over the kernel's vcan.
- **golden bytes at exact times**: the same in virtual time, every frame at its nanosecond: inhibit times, event timers,
  heartbeats, watchdogs, ramps. Real time proves order and content only.
- **canopen**: the Python library (another project's) as the master, over the unix bus and vcan.
- **node-canopen**: the npm package `canopen` (yet another one's) as the master, over the unix bus and vcan.

Not shown, because the drives have none of it: generation of SYNC, the SYNC start value of TPDOs (18xx:6), TIME, LSS,
multiplexed PDOs, an SDO client. Abort codes that no object of theirs has a cause for: 0601 0000, 0604 0047, 0606 0000,
0607 0010, 0609 0036, 060A 0023, 0800 0000, 0800 0021, 0800 0023.
"""


class Check(NamedTuple):
    """One test: a fact, and where it is shown."""

    section: str
    judge: str
    text: str
    bus: str


def check_of(item: pytest.Item) -> Check | None:
    """Return what a test shows, or None for one that is not about conformance."""
    marker = item.get_closest_marker("conformance")
    if marker is None:
        return None
    parameters = dict(item.callspec.params) if hasattr(item, "callspec") else {}
    bus = parameters.pop("bus", marker.kwargs.get("bus"))
    if "golden" in parameters:
        parameters["golden"] = parameters["golden"].title
    words = item.originalname.removeprefix("test_").replace("_", " ")
    text = ": ".join([words, *map(str, parameters.values())])
    section, judge = marker.args
    return Check(section, judge, text, bus)


def table(checks: Iterable[Check]) -> str:
    """Return the whole page.

    Raises:
        ValueError: Two tests show the same.
    """
    found = list(checks)
    twice = [check for check, count in Counter(found).items() if count > 1]
    if twice:
        raise ValueError(f"shown by several tests: {twice}")
    texts = {text: place for place, text in enumerate(dict.fromkeys(check.text for check in found))}
    buses = list(BUSES)
    found.sort(key=lambda c: (c.section, JUDGES.index(c.judge), texts[c.text], buses.index(c.bus)))
    sections = groupby(found, key=lambda check: check.section)
    return INTRODUCTION + _totals(found) + "".join(_section(name, list(those)) for name, those in sections)


def summary(outcomes: Mapping[Check, str]) -> list[str]:
    """Return lines that tell how many facts held, by judge and bus, and how many did not or were not tried."""
    held = {check for check, outcome in outcomes.items() if outcome == "passed"}
    others = Counter(outcome for outcome in outcomes.values() if outcome != "passed")
    rest = "".join(f", {count} {outcome}" for outcome, count in sorted(others.items()))
    lines = [f"{len(_facts(held))} conformance facts in {len(held)} checks{rest}"]
    for judge in JUDGES:
        counts = Counter(check.bus for check in held if check.judge == judge)
        if counts:
            buses = ", ".join(f"{counts[bus]} {words}" for bus, words in BUSES.items() if counts[bus])
            lines.append(f"  by {judge}: {buses}")
    return lines


def _facts(checks: Iterable[Check]) -> set[tuple[str, str, str]]:
    return {(check.section, check.judge, check.text) for check in checks}


def _totals(checks: Sequence[Check]) -> str:
    head = ["judge", "facts", *BUSES.values()]
    rows = [
        [judge, len(_facts(own)), *(sum(check.bus == bus for check in own) or "" for bus in BUSES)]
        for judge in JUDGES
        if (own := [check for check in checks if check.judge == judge])
    ]
    total = ["**all**", len(_facts(checks)), *(sum(check.bus == bus for check in checks) for bus in BUSES)]
    return f"\n## How many\n\n{len(_facts(checks))} facts in {len(checks)} checks.\n\n" + _grid(head, [*rows, total])


def _section(name: str, checks: Sequence[Check]) -> str:
    rows = []
    for (judge, text), same in groupby(checks, key=lambda check: (check.judge, check.text)):
        rows.append([text, judge, ", ".join(BUSES[check.bus] for check in same)])
    return f"\n## {name}\n\n" + _grid(["fact", "judge", "shown on"], rows)


def _grid(head: Sequence[object], rows: Sequence[Sequence[object]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |\n" for line in lines)
