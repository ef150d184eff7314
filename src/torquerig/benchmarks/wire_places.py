"""Where the wire benchmark's frames pass: every contestant has a member of a bus, and a peer that plays its drives.

The peer answers in the contestant's own thread, and its time is taken out, so that work is compared, not wake-ups.
"""

import itertools
import select
import socket
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter_ns
from typing import Final, Protocol

import can
from can.interfaces.socketcan import SocketcanBus

from torquerig.benchmarks.wire_pair import PairedCanBus, PairedKernelCanBus
from torquerig.driver.bus import unix_folder
from torquerig.driver.bus.clock import RealClock
from torquerig.driver.bus.interface import Bus, Tap
from torquerig.driver.bus.unix_packet import HEADER, LONGEST, MAGIC
from torquerig.driver.bus.url import open_bus, open_python_can
from torquerig.driver.errors import BusUrlError
from torquerig.driver.wire import cob

DRIVES: Final = (1, 2, 3)
BIT_RATE: Final = 1_000_000
CAN_FRAME: Final = struct.Struct("=IB3x8s")  # struct can_frame of linux/can.h
TPDO: Final = struct.Struct("<Hih")  # statusword, position, actual torque
RPDO: Final = struct.Struct("<Hh")  # controlword, target torque
STATUSWORD: Final = 0x1237  # operation enabled, target used
PAIR: Final = "pair"
"""The code for the kernel's CAN over a pair of Unix sockets, for machines whose kernel has none."""
UNIX: Final = "unix"
SOCKETCAN: Final = "socketcan"
URLS: Final = "unix:, pair: (the kernel CAN's code over pairs of Unix sockets) or socketcan:vcan0"


class Peer:
    """Plays three drives: answers SYNC with TPDOs, and takes the RPDOs.

    Attributes:
        busy_ns: Time it spent on answering.
        torques: The last target torque of each drive [count].
        close: Leaves the bus.
    """

    def __init__(
        self,
        send: Callable[[int, bytes], None],
        take: Callable[[], tuple[int, bytes] | None],
        close: Callable[[], None],
    ) -> None:
        """Sit at the other end.

        Args:
            send: Sends a frame.
            take: The next frame that waits, None when there is none.
            close: Leaves the bus.
        """
        self.busy_ns = 0
        self.torques: dict[int, int] = {}
        self._send = send
        self._take = take
        self.close = close
        self._cycles = 0

    def answer(self) -> None:
        """Send all TPDOs; the time that takes goes into `busy_ns`."""
        began = perf_counter_ns()
        self._cycles += 1
        for node_id in DRIVES:
            self._send(cob.TPDO[1] + node_id, TPDO.pack(STATUSWORD, 1000 * node_id + self._cycles % 100, 5))
        self.busy_ns += perf_counter_ns() - began

    def collect(self) -> None:
        """Take what has come."""
        while (frame := self._take()) is not None:
            can_id, data = frame
            if can_id - cob.RPDO[1] in DRIVES:
                self.torques[can_id - cob.RPDO[1]] = RPDO.unpack(data[: RPDO.size])[1]


class Place(Protocol):
    """A kind of bus."""

    def bare(self) -> tuple[socket.socket, Peer]:
        """A socket that carries `struct can_frame`, and its peer."""
        ...

    def python_can(self) -> tuple[can.BusABC, Peer]:
        """A python-can bus, and its peer."""
        ...

    def ours(self, tap: Tap | None = None) -> tuple[Bus, Peer]:
        """A bus of ours that tells a tap, and its peer."""
        ...


@dataclass(frozen=True, slots=True)
class UnixPlace:
    """The unix bus, a folder a contestant; the bare socket is one of a pair of the same kind."""

    folder: Path

    def bare(self) -> tuple[socket.socket, Peer]:
        """One of a pair of sequenced-packet sockets."""
        return _bare_pair(socket.SOCK_SEQPACKET)

    def python_can(self) -> tuple[can.BusABC, Peer]:
        """python-can's API on the unix bus."""
        url = self._url("python_can")
        peer = open_python_can(url, bitrate=BIT_RATE)
        return open_python_can(url, bitrate=BIT_RATE), _python_can_peer(peer)

    def ours(self, tap: Tap | None = None) -> tuple[Bus, Peer]:
        """As `torquerig run --bus unix:` opens it."""
        url = self._url("ours")
        member = unix_folder.join(url.partition(":")[2])
        bus = open_bus(url, bitrate=BIT_RATE, tap=tap, spin_ns=0)
        return bus, _unix_peer(member)

    def _url(self, name: str) -> str:
        number = sum(1 for _ in self.folder.iterdir()) if self.folder.exists() else 0
        return f"unix:{self.folder}/{name}{number}"


class PairPlace:
    """Pairs of Unix datagram sockets that carry the kernel's CAN frames with its timestamps."""

    def bare(self) -> tuple[socket.socket, Peer]:
        """One of a pair."""
        return _bare_pair(socket.SOCK_DGRAM)

    def python_can(self) -> tuple[SocketcanBus, Peer]:
        """python-can's SocketCAN bus on one of a pair."""
        ours, peer = self.bare()
        return PairedCanBus(ours), peer

    def ours(self, tap: Tap | None = None) -> tuple[Bus, Peer]:
        """Our bus for the kernel's CAN on one of a pair, or rather two: a cycle's port has a socket of its own."""
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        bus = PairedKernelCanBus(PairedCanBus(ours), RealClock(0), tap)
        return bus, _socket_peer(theirs, bus.process_data)


@dataclass(frozen=True, slots=True)
class SocketcanPlace:
    """The kernel's CAN: all contestants share the interface, and all hear all."""

    interface: str

    def bare(self) -> tuple[socket.socket, Peer]:
        """A raw CAN socket."""
        opened = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        opened.bind((self.interface,))
        return opened, self._peer()

    def python_can(self) -> tuple[can.BusABC, Peer]:
        """python-can's SocketCAN bus."""
        return self._open(), self._peer()

    def ours(self, tap: Tap | None = None) -> tuple[Bus, Peer]:
        """As `torquerig run --bus socketcan:` opens it."""
        peer = self._peer()
        return open_bus(f"socketcan:{self.interface}", bitrate=BIT_RATE, tap=tap, spin_ns=0), peer

    def _open(self) -> SocketcanBus:
        opened = open_python_can(f"socketcan:{self.interface}", bitrate=BIT_RATE)
        assert isinstance(opened, SocketcanBus)  # noqa: S101  (what the URL says)
        return opened

    def _peer(self) -> Peer:
        return _python_can_peer(self._open())


def place_of(url: str, folder: Path) -> Place:
    """The kind of bus that a URL names.

    Args:
        url: One of URLS.
        folder: Where unix buses may be made.

    Raises:
        BusUrlError: There is none.
    """
    interface, colon, channel = url.partition(":")
    if colon and interface == UNIX:
        return UnixPlace(Path(channel) if channel else folder)
    if interface == PAIR and colon and not channel:
        return PairPlace()
    if interface == SOCKETCAN and channel:
        return SocketcanPlace(channel)
    raise BusUrlError(f"{url!r} cannot be measured: {URLS}")


def _bare_pair(kind: socket.SocketKind) -> tuple[socket.socket, Peer]:
    ours, theirs = socket.socketpair(socket.AF_UNIX, kind)
    return ours, _socket_peer(theirs)


def _socket_peer(theirs: socket.socket, process_data: Callable[[], socket.socket | None] = lambda: None) -> Peer:
    """A peer on a socket that carries `struct can_frame`, and on a second one where process data have their own."""
    room = bytearray(CAN_FRAME.size)

    def send(can_id: int, data: bytes) -> None:
        own = process_data() if can_id - cob.TPDO[1] in DRIVES else None
        (own or theirs).send(CAN_FRAME.pack(can_id, len(data), data))

    def take() -> tuple[int, bytes] | None:
        if not select.select((theirs,), (), (), 0)[0]:
            return None
        theirs.recv_into(room)
        can_id, length, data = CAN_FRAME.unpack(room)
        return can_id, data[:length]

    return Peer(send, take, theirs.close)


def _unix_peer(member: unix_folder.Place) -> Peer:
    """A peer on the unix bus without python-can, which would leave less of the processor's caches to ours."""
    theirs, _ = member.door.accept()
    theirs.settimeout(0.0)
    sequence = itertools.count()

    def send(can_id: int, data: bytes) -> None:
        theirs.send(HEADER.pack(MAGIC, 0, len(data), can_id, next(sequence), time.monotonic_ns()) + data)

    def take() -> tuple[int, bytes] | None:
        try:
            packet = theirs.recv(LONGEST)
        except BlockingIOError:
            return None
        return HEADER.unpack_from(packet)[3], packet[HEADER.size :]

    def close() -> None:
        theirs.close()
        member.leave()

    return Peer(send, take, close)


def _python_can_peer(theirs: can.BusABC) -> Peer:
    """A peer on a python-can bus."""

    def send(can_id: int, data: bytes) -> None:
        theirs.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

    def take() -> tuple[int, bytes] | None:
        message = theirs.recv(0)
        return None if message is None else (message.arbitration_id, bytes(message.data))

    return Peer(send, take, theirs.shutdown)
