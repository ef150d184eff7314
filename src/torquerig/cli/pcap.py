"""`torquerig pcap`: a record's bus log for Wireshark."""

import sys
from pathlib import Path

import click

from torquerig.errors import RecordError
from torquerig.exports.pcap import read_log, write_pcap
from torquerig.record import BUS_FILE

PCAP_FILE = "bus.pcap"
STANDARD_OUTPUT = Path("-")


@click.command("pcap")
@click.argument("record", metavar="RECORD", type=click.Path(path_type=Path))
@click.option(
    "--output",
    metavar="FILE",
    type=click.Path(path_type=Path, dir_okay=False, allow_dash=True),
    help="Where it goes, - for standard output; default: bus.pcap beside the log.",
)
def command(record: Path, output: Path | None) -> None:
    """Convert a record's bus.log into a pcap file for Wireshark.

    RECORD is a record's folder, or a file as `candump -L` writes it. Wireshark is told that the frames are CANopen's
    by its option -d can.subdissector,canopen.
    """
    log = record / BUS_FILE if record.is_dir() else record
    if output == STANDARD_OUTPUT:
        write_pcap(read_log(log), sys.stdout.buffer)
        return
    place = output or log.with_name(PCAP_FILE)
    click.echo(f"{_convert(log, place)} frames: {place}")


def _convert(log: Path, place: Path) -> int:
    """Convert a log; a file that is there already is replaced at the end, or left as it is when that is not reached.

    Returns:
        The number of frames.
    """
    part = place.with_name(f"{place.name}.part")
    try:
        with part.open("wb") as file:
            count = write_pcap(read_log(log), file)
        part.replace(place)
    except RecordError:
        raise
    except OSError as error:
        raise click.BadParameter(f"{place} cannot be written: {error.strerror}", param_hint="--output") from error
    finally:
        part.unlink(missing_ok=True)
    return count
