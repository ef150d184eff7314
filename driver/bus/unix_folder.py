"""The folder that is a unix bus: who is in it, how one joins, how the dead are swept.

Every member listens on a socket of its own in the folder. A newcomer connects to every member it finds; the members
find out about it because its connection waits at their door. So the folder is listed once a member, never a frame, and
there is nothing to run besides the members.

Joining happens under a file lock: of two members that start at once the second one finds the first, exactly once. The
kernel drops the lock of a process that dies. A socket that refuses connections belonged to a process that was
killed, since the lock keeps anyone from being seen between its bind and its listen: it is removed.
"""

import contextlib
import fcntl
import os
import re
import secrets
import socket
import struct
import time
from collections.abc import MutableSequence
from dataclasses import dataclass, field
from typing import Final

LOCK_NAME: Final = "members.lock"
PATIENCE_S: Final = 5.0  # joining takes a millisecond: who holds the lock longer is stopped
BACKLOG: Final = 256  # newcomers that may wait at the door of a member that does not look
SEND_BUFFER: Final = 1 << 20  # [byte]; the kernel caps it (net.core.wmem_max), and 212992 hold 277 frames
_MEMBER: Final = re.compile(r"member-\d+-[0-9a-f]{8}\.sock")


UNKNOWN: Final = -1


@dataclass(slots=True)
class Peer:
    """Another member.

    Attributes:
        connection: The connection to it.
        process: Its process-id.
        expected: The one sequence number that its next frame should have, `UNKNOWN` before the first.
    """

    connection: socket.socket
    process: int
    expected: MutableSequence[int] = field(default_factory=lambda: [UNKNOWN])


@dataclass(frozen=True, slots=True)
class Place:
    """A member's place in the folder: its door, and the connections to all who were there before."""

    folder: int
    name: str
    door: socket.socket
    connections: tuple[socket.socket, ...]

    def leave(self) -> None:
        """Close the door and take its name out of the folder; the connections belong to whoever uses them."""
        self.door.close()
        _unlink(self.name, self.folder)
        os.close(self.folder)


def join(path: str) -> Place:
    """Return a new member's place in the folder, which is made (for the user alone) if it is missing.

    Args:
        path: The folder; of any length, since names are resolved through its descriptor and not through `sun_path`.

    Raises:
        OSError: The folder cannot be made or used.
        TimeoutError: Another process holds the folder's lock and does not let go.
    """
    os.makedirs(path, mode=0o700, exist_ok=True)
    folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        lock = _take_lock(folder, path)
        try:
            return _enter(folder)
        finally:
            os.close(lock)
    except BaseException:
        os.close(folder)
        raise


def prepare(connection: socket.socket) -> None:
    """Make a connection one that never blocks and queues as many frames as the kernel allows."""
    connection.settimeout(0.0)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)


def peer_process(connection: socket.socket) -> int:
    """Return the process-id at the other end."""
    credentials = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
    pid: int = struct.unpack("3i", credentials)[0]
    return pid


def _take_lock(folder: int, path: str) -> int:
    flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
    lock = os.open(LOCK_NAME, flags, 0o600, dir_fd=folder)
    give_up = time.monotonic() + PATIENCE_S
    while True:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > give_up:
                os.close(lock)
                raise TimeoutError(f"another process has held {path}/{LOCK_NAME} for {PATIENCE_S:g} s") from None
            time.sleep(0.002)
        else:
            return lock


def _enter(folder: int) -> Place:
    name = f"member-{os.getpid()}-{secrets.token_hex(4)}.sock"
    door = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    connections: list[socket.socket] = []
    try:
        door.settimeout(0.0)
        others = filter(_MEMBER.fullmatch, os.listdir(folder))
        connections.extend(connection for other in others if (connection := _connect(other, folder)))
        door.bind(_address(name, folder))
        door.listen(BACKLOG)
    except BaseException:
        for each in (door, *connections):
            each.close()
        _unlink(name, folder)
        raise
    return Place(folder, name, door, tuple(connections))


def _connect(name: str, folder: int) -> socket.socket | None:
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    prepare(connection)
    try:
        connection.connect(_address(name, folder))
    except ConnectionRefusedError:  # its process was killed
        connection.close()
        _unlink(name, folder)
        return None
    except (FileNotFoundError, BlockingIOError):  # it left just now; or it is stopped, with its backlog full
        connection.close()
        return None
    except OSError:
        connection.close()
        raise
    return connection


def _address(name: str, folder: int) -> str:
    return f"/proc/self/fd/{folder}/{name}"


def _unlink(name: str, folder: int) -> None:
    with contextlib.suppress(FileNotFoundError):
        os.unlink(name, dir_fd=folder)
