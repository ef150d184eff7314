"""Run a command where vcan0 and vcan1 are up: in the host's own kernel if it has vcan, else in a User-Mode Linux.

In namespaces of the host's kernel the command works on the host's files. In a User-Mode Linux it sees them through an
overlay: it may write anywhere, and nothing reaches the host but what is below the -w folders. Both ways it keeps
working folder, environment, umask, output and exit status; its input is empty. Nothing of it outlives the launcher.

Exit status: the command's; 124 time limit; 125 the guest failed; 126, 127 as the shell; 69 there is no vcan here.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import BinaryIO, Final, NoReturn

from guest import GRACE_S, GUEST_FAILED, Job
from native import Native
from places import NoVcanError, Place
from uml import Uml

UNAVAILABLE: Final = 69  # EX_UNAVAILABLE of sysexits.h
START_LIMIT_S: Final = 90.0
END_LIMIT_S: Final = 30.0
LOOK_EVERY_S: Final = 0.02
PLACES: Final[Mapping[str, Callable[[], Place]]] = {"native": Native.find, "uml": Uml.find}

# The keeper: a shell that holds the other end of a pipe to the launcher. When the launcher ends, by whatever road, the
# pipe does, and the keeper ends all of the guest's process group, itself included. "$0" is the folder of the job.
KEEPER: Final = """
exec 3<&0 </dev/null
{ read -r _ <&3; rm -rf -- "$0"; kill -KILL 0; } &
exec 3<&-
exec "$@"
"""


def find_place() -> Place:
    """Returns the best place of this machine.

    Raises:
        NoVcanError: There is none; the message says in one line why and what to install.
    """
    reasons = []
    for find in PLACES.values():
        try:
            return find()
        except NoVcanError as reason:
            reasons.append(str(reason))
    raise NoVcanError("; ".join(reasons))


def run(
    command: Sequence[str],
    *,
    place: Place | None = None,
    limit_s: float = 300.0,
    links: int = 2,
    writable: Sequence[Path] = (),
    environment: Mapping[str, str] | None = None,
    cwd: Path | None = None,
    output: BinaryIO | None = None,
    errors: BinaryIO | None = None,
) -> int:
    """Runs the command where links vcan0, vcan1 ... are up, and returns its exit status.

    By default the place is the best of this machine; environment, working folder and streams are this process' own.
    The limit [s] is the command's; the guest's own start has another one. Folders named writable are the host's in a
    User-Mode Linux too.

    Raises:
        NoVcanError: There is no place, or the guest does not start there.
    """
    place = find_place() if place is None else place
    with tempfile.TemporaryDirectory(prefix="vcan-") as name:
        folder = Path(name)
        Job(
            command=list(command),
            environment=dict(os.environ if environment is None else environment),
            cwd=str(cwd or Path.cwd()),
            umask=_umask(),
            limit_s=limit_s,
            links=links,
            modules=None if place.modules is None else list(place.modules),
            writable=[str(path.resolve()) for path in (folder, *writable)],
        ).save(folder)
        _supervise(place, folder, (output or sys.stdout.buffer, errors or sys.stderr.buffer), limit_s)
        return _status(place, folder)


class _Relay:
    """Hands on what is new in a file that the guest writes."""

    def __init__(self, source: Path, sink: BinaryIO) -> None:
        self._source = source
        self._sink = sink
        self._handed_on = 0

    def __call__(self) -> None:
        if not self._source.exists():
            return
        with self._source.open("rb") as file:
            file.seek(self._handed_on)
            new = file.read()
        if new:
            self._sink.write(new)
            self._sink.flush()
            self._handed_on += len(new)


def _supervise(place: Place, folder: Path, sinks: tuple[BinaryIO, BinaryIO], limit_s: float) -> None:
    """Starts the guest, and ends it when it left its status, died, or let its time limits pass."""
    relays = (_Relay(folder / "stdout", sinks[0]), _Relay(folder / "stderr", sinks[1]))
    environment = {**os.environ, **place.prepare(folder)}
    with (folder / "console").open("wb") as console:
        process = subprocess.Popen(
            ["sh", "-c", KEEPER, str(folder), *place.command_line(folder)],
            env=environment,
            cwd="/",
            stdin=subprocess.PIPE,
            stdout=console,
            stderr=console,
            start_new_session=True,
        )
    try:
        until = time.monotonic() + START_LIMIT_S
        started = False
        while process.poll() is None and not (folder / "status").exists() and time.monotonic() < until:
            if not started and _has_started(folder):
                started = True
                until = time.monotonic() + limit_s + GRACE_S + END_LIMIT_S  # the guest itself keeps the command's limit
            for relay in relays:
                relay()
            time.sleep(LOOK_EVERY_S)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate(timeout=END_LIMIT_S)
    for relay in relays:
        relay()


def _has_started(folder: Path) -> bool:
    """Whether the guest's first process was reached."""
    return (folder / "stderr").exists()


def _status(place: Place, folder: Path) -> int:
    """Returns the status that the guest left, or the launcher's own word for its silence."""
    if (folder / "status").exists():
        return int((folder / "status").read_text())
    console = (folder / "console").read_text(errors="replace")
    if not _has_started(folder):
        raise NoVcanError(place.why_not_started(console))
    sys.stderr.write(f"{console}\nthe guest ended without a status\n")
    return GUEST_FAILED


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def _leave(number: int, frame: FrameType | None) -> NoReturn:
    del frame
    raise SystemExit(128 + number)


def main() -> int:
    """Runs the command line's command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-t", type=float, default=300.0, metavar="S", help="time limit [s] (default 300)")
    parser.add_argument("-n", type=int, default=2, metavar="LINKS", help="number of vcan links (default 2)")
    parser.add_argument("-w", type=Path, action="append", default=[], metavar="DIR", help="folder the guest may write")
    parser.add_argument("--place", choices=PLACES, help="do not choose by yourself")
    parser.add_argument("command", nargs="+", help="program and arguments, after --")
    arguments = parser.parse_args()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _leave)
    try:
        place = PLACES[arguments.place]() if arguments.place else find_place()
        return run(arguments.command, place=place, limit_s=arguments.t, links=arguments.n, writable=arguments.w)
    except NoVcanError as error:
        sys.stderr.write(f"{error}\n")
        return UNAVAILABLE


if __name__ == "__main__":
    sys.exit(main())
