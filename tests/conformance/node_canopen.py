"""node-canopen as a member of a bus: it has no transport of its own, so its frames go by the lines of a pipe."""

import contextlib
import hashlib
import json
import os
import re
import select
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any, Final, NoReturn

import can
from forward import unavailable
from stations import PATIENCE_S

HERE: Final = Path(__file__).parent
MASTER: Final = HERE / "node_master.js"
MANIFESTS: Final = ("package.json", "package-lock.json")
INSTALL: Final = ("ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error")
INSTALL_LIMIT_S: Final = 120.0
CHUNK: Final = 1 << 16  # [byte]


class NoNodeError(Exception):
    """node-canopen cannot run here; the message is one line and says what to install."""


def packages() -> Path:
    """Return the folder with the packages of the lock file, installed at the first call for each lock file.

    They stand in the virtual environment, where all that is needed for development stands.

    Raises:
        NoNodeError: They cannot be had.
    """
    if shutil.which("node") is None or shutil.which("npm") is None:
        raise NoNodeError("no node and npm (apt install nodejs npm)")
    content = b"".join((HERE / name).read_bytes() for name in MANIFESTS)
    folder = Path(sys.prefix) / "node-canopen" / hashlib.sha256(content).hexdigest()[:16]
    if not folder.exists():
        _install(folder)
    return folder


def _install(folder: Path) -> None:
    """Install beside the folder, then rename: it is there whole or not at all, whoever else installs at this time."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as name:
            building = Path(name) / "packages"
            building.mkdir()
            for manifest in MANIFESTS:
                shutil.copy(HERE / manifest, building)
            subprocess.run(
                ["npm", *INSTALL], cwd=building, capture_output=True, text=True, timeout=INSTALL_LIMIT_S, check=True
            )
            with contextlib.suppress(FileExistsError):
                building.rename(folder)
    except subprocess.CalledProcessError as error:
        reason = [*error.stderr.strip().splitlines(), "no reason given"][0]
        raise NoNodeError(f"npm installs no packages: {reason}") from error
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NoNodeError(f"npm installs no packages: {error}") from error


def eds_of_node_1(folder: Path) -> Path:
    """Return a copy of the EDS with $NODEID worked out, which node-canopen cannot do."""
    text = (files("torquerig.driver") / "data" / "torquerig-drive.eds").read_text("ascii")
    copy = folder / "node-1.eds"
    copy.write_text(re.sub(r"\$NODEID\+(\w+)", lambda term: f"0x{int(term[1], 0) + 1:X}", text), "ascii")
    return copy


class AbsentMaster:
    """Stands in where node-canopen cannot run: skips the test that orders anything, or fails it in CI.

    Not a fixture but the test itself must do so: then pytest folds all such skips into one line.
    """

    def __init__(self, reason: NoNodeError) -> None:
        self._reason = reason

    def join(self, bus: can.BusABC) -> None:
        """Do nothing."""

    def order(self, order: str, **what: object) -> NoReturn:
        """Say what is missing."""
        del order, what
        unavailable(f"not run for want of node-canopen: {self._reason}")

    def close(self) -> None:
        """Do nothing."""


class NodeMaster:
    """A process that is a master, and the member of the bus that lends it its ears and mouth."""

    def __init__(self, modules: Path, eds: Path) -> None:
        self._bus: can.BusABC | None = None
        self._events: list[dict[str, Any]] = []
        self._answers: list[dict[str, Any]] = []
        self._unread = b""
        self._process = subprocess.Popen(
            ["node", str(MASTER), str(eds)],
            env={**os.environ, "NODE_PATH": str(modules / "node_modules")},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )

    def join(self, bus: can.BusABC) -> None:
        """Begin anew, as a master that knows nothing, on a bus."""
        self._bus = bus
        self._events.clear()
        self.order("begin")

    def order(self, order: str, **what: object) -> dict[str, Any]:
        """Let the master do something; return its answer, or why it was refused."""
        self._tell({"order": order, **what})
        self._serve_until(lambda: self._answers)
        return self._answers.pop(0)

    def event(self, kind: str, **what: object) -> dict[str, Any]:
        """Wait for an event of a kind, and return it; each is returned once."""
        wanted = {"event": kind, **what}.items()
        self._serve_until(lambda: any(wanted <= event.items() for event in self._events))
        found = next(event for event in self._events if wanted <= event.items())
        self._events.remove(found)
        return found

    def close(self) -> None:
        """End the process, by the end of its input."""
        self._process.communicate(timeout=PATIENCE_S)

    def _serve_until(self, done: Callable[[], object]) -> None:
        """Carry frames between bus and process until something is true."""
        give_up = time.monotonic() + PATIENCE_S
        output = self._process.stdout.fileno()
        while not done():
            patience_s = max(0.0, give_up - time.monotonic())
            readable, _, _ = select.select([output, self._bus.fileno()], [], [], patience_s)
            assert readable, "node-canopen neither heard nor said what was awaited"
            if output in readable:
                self._take(os.read(output, CHUNK))
            while (message := self._bus.recv(0)) is not None:
                self._tell({"frame": [message.arbitration_id, message.data.hex()]})

    def _take(self, chunk: bytes) -> None:
        assert chunk, f"node-canopen ended with status {self._process.wait(PATIENCE_S)}"
        *lines, self._unread = (self._unread + chunk).split(b"\n")
        for line in map(json.loads, lines):
            if "frame" in line:
                can_id, data = line["frame"]
                self._bus.send(can.Message(arbitration_id=can_id, is_extended_id=False, data=bytes.fromhex(data)))
            else:
                (self._events if "event" in line else self._answers).append(line)

    def _tell(self, what: dict[str, object]) -> None:
        self._process.stdin.write(json.dumps(what).encode() + b"\n")
        self._process.stdin.flush()
