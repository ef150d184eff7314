"""A pseudo-terminal that stands for a serial port: this end is the adapter's, the other one, by name, the host's.

While no host has the port open, the kernel tells this end EIO, at once and for every read: then looking again is put
off by a moment. What a host leaves behind is cleared when it closes the port, as a real port's driver does: bytes not
read, settings, and a line discipline, with which a network interface may go.
"""

import contextlib
import errno
import fcntl
import os
import select
import struct
import termios
import time
import tty
from pathlib import Path
from typing import Final

from torquerig.driver.errors import BusUrlError

KNOCK_S: Final = 0.01
"""How often to look whether a host has come."""

_CHUNK: Final = 65_536
_TERMINALS_DISCIPLINE: Final = struct.pack("i", 0)  # N_TTY of linux/tty.h


class PseudoTerminal:
    """A pseudo-terminal with a symbolic link to the host's end, raw, never blocking.

    Attributes:
        host_end: The name of the host's end.
        connected: Whether a host had it open when last looked.
    """

    def __init__(self, link: Path) -> None:
        """Make both.

        Args:
            link: The link's name. A link that is left over and leads nowhere is replaced.

        Raises:
            BusUrlError: Something else has that name, or the link cannot be made.
        """
        self._descriptor, host = os.openpty()
        os.set_blocking(self._descriptor, False)
        self.host_end = os.ttyname(host)
        self.connected = False
        self._used = False
        self._link = link
        tty.setraw(host)
        os.close(host)
        try:
            self._place_link()
        except OSError as error:
            os.close(self._descriptor)
            taken = isinstance(error, FileExistsError)
            reason = "it exists, and not as a link that a simulator left over" if taken else error.strerror
            raise BusUrlError(f"{link} cannot become a serial port: {reason}") from error

    def read(self) -> bytes:
        """Return what the host wrote, as much as there is in one go; empty when there is nothing, or no host."""
        try:
            data = os.read(self._descriptor, _CHUNK)
        except BlockingIOError:
            data = b""
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            self.connected = False
            if self._used:
                self._used = not self._clear()
            return b""
        self.connected = self._used = True
        return data

    def write(self, data: bytes | bytearray) -> int:
        """Return how many of the bytes the host's end has taken, which may be none."""
        try:
            return os.write(self._descriptor, data)
        except BlockingIOError:
            return 0

    def wait(self, seconds: float, *, for_room: bool) -> None:
        """Return when the host wrote something, or, if that is asked for, has room again; else after a time.

        Args:
            seconds: The time, 0 for not at all [s]. Without a host, the time till the next look for one may be shorter.
            for_room: Whether to wait for room, too.
        """
        if self.connected:
            ends = [self._descriptor]
            select.select(ends, ends if for_room else [], [], seconds)
        else:
            time.sleep(min(seconds, KNOCK_S))

    def close(self) -> None:
        """Take the port away, as by pulling the adapter out, and the link if it is still ours; may be called again."""
        if self._descriptor < 0:
            return
        with contextlib.suppress(OSError):
            if os.readlink(self._link) == self.host_end:
                self._link.unlink()
        os.close(self._descriptor)
        self._descriptor = -1

    def _place_link(self) -> None:
        if self._link.is_symlink() and (not self._link.exists() or os.readlink(self._link) == self.host_end):
            self._link.unlink()
        self._link.symlink_to(self.host_end)

    def _clear(self) -> bool:
        """Make the host's end what it was; return False if it cannot be opened now."""
        try:
            host = os.open(self.host_end, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError:  # whoever has it again already, has it for himself alone (TIOCEXCL)
            return False
        try:
            fcntl.ioctl(host, termios.TIOCSETD, _TERMINALS_DISCIPLINE)
            termios.tcflush(host, termios.TCIOFLUSH)
            termios.tcflush(self._descriptor, termios.TCIOFLUSH)  # and what the kernel has not brought there yet
            tty.setraw(host)
        finally:
            os.close(host)
        return True
