"""`torquerig nodes`: who is on a bus, or on each bus of a rig, and what each did not take from it."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path

import click

from torquerig.assembly import open_rig
from torquerig.axes import profile_of
from torquerig.buses import bus_urls, words_for
from torquerig.cli.options import a_bus_option, config_option, configure_on_bus
from torquerig.configuration import Configuration
from torquerig.driver.bus.interface import Bus
from torquerig.driver.errors import NoAnswer
from torquerig.driver.master.objects import DriveObjects
from torquerig.driver.master.profile import load_profile
from torquerig.driver.master.pump import Pump, PumpCounts
from torquerig.driver.master.refusals import RefusalCounters, read_refusals
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.master.scan import ScannedNode, scan_with
from torquerig.driver.master.sdo_jobs import SdoService

UNKNOWN = "-"
HEADINGS = ("node-id", "state", "device type", "vendor", "product", "revision", "serial", "device name")

Refusals = Mapping[int, Mapping[str, int] | None]


@click.command("nodes")
@a_bus_option
@config_option
@click.option("--counters", is_flag=True, help="Print also what each node did not take from the bus since power-on.")
def command(bus: str | None, config_file: Path | None, *, counters: bool) -> None:
    """Scan a bus, or each of several: node-id, state, identity and device name of each node."""
    configuration = configure_on_bus(config_file, bus)
    urls = bus_urls(configuration.rig)
    with open_rig(configuration) as rig:
        lines = [list(_scanned(member, configuration, counters=counters)) for member in rig.members]
    if not any(lines):
        where = words_for(urls)
        raise NoAnswer(f"no node answers on {where}: none of the node-ids 1 to 127 within 0.2 s each")
    if len(urls) > 1:
        lines = [[f"{url}:", *(found or ["no node answers"]), ""] for url, found in zip(urls, lines, strict=True)]
    click.echo("\n".join(chain.from_iterable(lines)).rstrip())


def _scanned(bus: Bus, configuration: Configuration, *, counters: bool) -> Iterator[str]:
    """What there is to say of the nodes on a bus, line by line; nothing when there are none."""
    pump = Pump(bus)
    nodes = scan_with(pump)
    if nodes:
        yield from _table([HEADINGS, *map(_row, nodes)])
        if counters:
            yield from ("", *_counter_lines(_ask(pump, nodes, configuration)), _own_line(pump.counts))


def _ask(pump: Pump, nodes: Sequence[ScannedNode], configuration: Configuration) -> Refusals:
    """The counters of all nodes that were found."""
    axes = {axis.node_id: axis for axis in configuration.rig.axes.legs}
    drives: dict[int, RefusalCounters] = {}
    for node in nodes:
        profile = profile_of(axes[node.node_id]) if node.node_id in axes else load_profile()
        if node.identity is not None and profile.refusals is not None:
            objects = DriveObjects(node.node_id, AxisSettings(node.node_id, profile).eds_path)
            drives[node.node_id] = RefusalCounters(objects, profile)
    return {**dict.fromkeys(node.node_id for node in nodes), **read_refusals(SdoService(pump), drives)}


def _counter_lines(refusals: Refusals) -> list[str]:
    """A line a counter, a column a node."""
    names = dict.fromkeys(name for counts in refusals.values() for name in counts or ())
    rows = [("not taken from the bus", *(f"node {node_id}" for node_id in refusals))]
    rows += [(name, *(_count(counts, name) for counts in refusals.values())) for name in names]
    silent = [str(node_id) for node_id, counts in refusals.items() if counts is None]
    return [*_table(rows), *([f"do not count, or not as their profile says: {', '.join(silent)}"] if silent else [])]


def _count(counts: Mapping[str, int] | None, name: str) -> str:
    return UNKNOWN if counts is None else str(counts.get(name, UNKNOWN))


def _own_line(counts: PumpCounts) -> str:
    """What this scan itself could not use."""
    return f"this scan: {counts.unknown} frames of no use to it, {counts.malformed} malformed"


def _table(rows: Iterable[tuple[str, ...]]) -> list[str]:
    """Rows as plain text, each column as wide as it needs to be, so that other programs can read it too."""
    rows = list(rows)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]


def _row(node: ScannedNode) -> tuple[str, ...]:
    """What there is to say of a node."""
    state = node.state.name.lower().replace("_", "-") if node.state is not None else UNKNOWN
    who = node.identity
    if who is None:
        return (str(node.node_id), state, *[UNKNOWN] * 6)
    numbers = (who.device_type, who.vendor, who.product, who.revision, who.serial)
    return (str(node.node_id), state, *map(_hex, numbers), _printable(who.name or UNKNOWN))


def _printable(text: str) -> str:
    """A text from the bus that does nothing to a terminal, and stays on its line."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def _hex(number: int | None) -> str:
    """A number of an identity."""
    return UNKNOWN if number is None else f"0x{number:08X}"
