"""`torquerig nodes`: who is on a bus."""

from pathlib import Path

import click

from torquerig.assembly import open_rig
from torquerig.cli.options import a_bus_option, config_option, configure
from torquerig.driver.errors import NoAnswer
from torquerig.driver.master.scan import ScannedNode, scan

UNKNOWN = "-"
HEADINGS = ("node-id", "state", "device type", "vendor", "product", "revision", "serial", "device name")


@click.command("nodes")
@a_bus_option
@config_option
def command(bus: str, config_file: Path | None) -> None:
    """Scan a bus: node-id, state, identity and device name of each node."""
    configuration = configure(config_file, bus=bus)
    with open_rig(configuration) as rig:
        nodes = scan(rig.bus)
    if not nodes:
        raise NoAnswer(f"no node answers on {bus}: none of the node-ids 1 to 127 within 0.2 s each")
    click.echo("\n".join(_lines(nodes)))


def _lines(nodes: list[ScannedNode]) -> list[str]:
    """The nodes as a table of plain text, as wide as it needs to be, so that other programs can read it too."""
    rows = [HEADINGS, *(_row(node) for node in nodes)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]


def _row(node: ScannedNode) -> tuple[str, ...]:
    """What there is to say of a node."""
    state = node.state.name.lower().replace("_", "-") if node.state is not None else UNKNOWN
    who = node.identity
    if who is None:
        return (str(node.node_id), state, *[UNKNOWN] * 6)
    numbers = (who.device_type, who.vendor, who.product, who.revision, who.serial)
    return (str(node.node_id), state, *map(_hex, numbers), who.name or UNKNOWN)


def _hex(number: int | None) -> str:
    """A number of an identity."""
    return UNKNOWN if number is None else f"0x{number:08X}"
