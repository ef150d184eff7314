"""A CAN bus between the processes of one machine, without kernel CAN: python-can's interface `unix`.

    can.Bus(interface="unix", channel="/tmp/rig")

Any number of members, each hears all others. There is no daemon: every pair of members shares one connection of
sequenced packets (AF_UNIX, SOCK_SEQPACKET), whose queue is limited by bytes, where datagram sockets queue no more than
net.unix.max_dgram_qlen (often 10) frames. Sending never blocks: a member that does not read fills its own queues only,
and what it cannot take is counted by the sender (`not_taken`) and, from the gaps in the sequence numbers, by itself
(`counts`). A killed member is noticed because its connections close. What a member sends after a newcomer's constructor
returned, the newcomer hears.

There is no arbitration and no bit time: frames arrive as soon as they are sent, in the order they were sent.
"""

import contextlib
import logging
import os
import select
import threading
import time
from collections import Counter, deque
from collections.abc import Mapping, MutableSequence, Sized
from socket import socket
from typing import Final

import can
from can.typechecking import CanFilters

from torquerig.driver.bus import unix_folder
from torquerig.driver.bus.unix_folder import UNKNOWN, Peer
from torquerig.driver.bus.unix_packet import LONGEST, SEQUENCE_MASK, decode, encode

log = logging.getLogger(__name__)

_ROUNDS: Final = 4096  # frames taken from one member in one go; more than its queue holds with the usual wmem_max


class UnixBus(can.BusABC):
    """One member of the bus in a folder.

    Sending and receiving may happen in different threads, unless compiled code uses its connections
    (`unix_connections`, which knows this class from within). `fileno()` is readable whenever `recv(0)` has something.
    Timestamps are the sender's: a receiver that stalled still sees when each frame was sent.
    """

    def __init__(
        self,
        channel: str | os.PathLike[str],
        can_filters: CanFilters | None = None,
        *,
        receive_own_messages: bool = False,
        **kwargs: object,
    ) -> None:
        """Join the bus.

        Args:
            channel: The folder; made, for the user alone, if it is missing.
            can_filters: See `can.BusABC.set_filters`.
            receive_own_messages: Whether this member hears what it sent itself.
            kwargs: What other interfaces need (such as the bit rate), and this one does not.

        Raises:
            can.CanInitializationError: The folder cannot be used.
        """
        folder = str(channel)
        try:
            self._place = unix_folder.join(folder)
        except OSError as error:
            raise can.CanInitializationError(f"no unix bus in {folder}: {error.strerror or error}") from error
        self.channel_info = f"unix bus in {folder}"
        self._receive_own = receive_own_messages
        self._lock = threading.Lock()
        self._closed = False
        self._sent: MutableSequence[int] = [0]  # frames so far, which is the sequence number of the next
        self._inbox: deque[can.Message] = deque()
        self._not_taken: Counter[int] = Counter()
        self._counts: Counter[str] = Counter()
        self._peers: dict[int, Peer] = {}
        self._changes = 0  # of the peers
        self._kept: Sized = ()  # what others took from the connections, and still have
        self._knock = select.poll()
        self._knock.register(self._place.door, select.POLLIN)
        self._flag = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._flag_is_up = False
        self._epoll = select.epoll()
        self._epoll.register(self._place.door, select.EPOLLIN)
        self._epoll.register(self._flag, select.EPOLLIN)
        for connection in self._place.connections:
            self._add(connection)
        super().__init__(channel=folder, can_filters=can_filters, **kwargs)

    @property
    def counts(self) -> Mapping[str, int]:
        """What went wrong so far.

        `not_taken`: frames of ours that members could not take; `missed`: frames that we could not take, as far as
        later ones told; `malformed`: packets that are no frames; `refused`: newcomers for whom no descriptor was left.
        """
        with self._lock:
            return {
                "not_taken": self._not_taken.total(),
                "missed": self._counts["missed"],
                "malformed": self._counts["malformed"],
                "refused": self._counts["refused"],
            }

    @property
    def not_taken(self) -> Mapping[int, int]:
        """Frames of ours that could not be taken, by the process-id of the member that could not take them."""
        with self._lock:
            return dict(self._not_taken)

    @property
    def members(self) -> int:
        """How many others are connected, as far as this member has looked."""
        return len(self._peers)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Hand the frame to every other member; never blocks.

        Args:
            msg: A classic CAN frame.
            timeout: Not needed: nothing is waited for.

        Raises:
            can.CanOperationError: The bus is shut down, or this is not a classic CAN frame.
        """
        del timeout
        with self._lock:
            self._check_open()
            sent_ns = time.monotonic_ns()
            packet = encode(msg, self._sent[0], sent_ns)
            while self._knock.poll(0) and self._admit():
                pass
            self._sent[0] = (self._sent[0] + 1) & SEQUENCE_MASK
            gone = []
            for peer in self._peers.values():
                try:
                    peer.connection.send(packet)
                except (BrokenPipeError, ConnectionResetError):
                    gone.append(peer)
                except OSError:  # its queue is full
                    self._not_taken[peer.process] += 1
            for peer in gone:
                self._part_with(peer)
            if self._receive_own:
                self._hear_own(packet)
            self._settle_flag()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            with self._lock:
                self._check_open()
                if not self._inbox:
                    self._collect()
                message = self._take()
                self._settle_flag()
            if message is not None:
                return message, True
            left = None if deadline is None else deadline - time.monotonic()
            if left is not None and left <= 0:
                return None, True
            # select has microseconds, epoll only milliseconds. The bus may be closed meanwhile: the next look tells.
            with contextlib.suppress(OSError, ValueError):
                select.select([self._epoll], [], [], left)

    def fileno(self) -> int:
        """Return a descriptor that is readable when a frame (or a newcomer) has come."""
        return self._epoll.fileno()

    def shutdown(self) -> None:
        """Leave the bus; may be called again."""
        super().shutdown()
        with self._lock:
            if self._closed:
                return
            self._closed = True
            self._settle_flag()
            for peer in self._peers.values():
                peer.connection.close()
            self._peers.clear()
            self._place.leave()
            self._epoll.close()
            os.close(self._flag)

    def _check_open(self) -> None:
        if self._closed:
            raise can.CanOperationError(f"this member of the {self.channel_info} is shut down")

    def _add(self, connection: socket) -> None:
        self._changes += 1
        self._peers[connection.fileno()] = Peer(connection, unix_folder.peer_process(connection))
        self._epoll.register(connection, select.EPOLLIN)

    def _admit(self) -> bool:
        """Take in one newcomer that waits at the door, and return whether that worked."""
        try:
            connection, _ = self._place.door.accept()
        except OSError:
            self._counts["refused"] += 1
            return False
        unix_folder.prepare(connection)
        self._add(connection)
        return True

    def _part_with(self, peer: Peer) -> None:
        """Close the connection to a member that left, once what it said before is read."""
        said: list[tuple[int, can.Message]] = []
        while self._read(peer, said):
            pass
        self._put(said)

    def _collect(self) -> None:
        """Read what has come, a frame of every member a round, until there is no more."""
        came: list[tuple[int, can.Message]] = []
        for _ in range(_ROUNDS):
            moved = False
            for descriptor, _ in self._epoll.poll(0):
                peer = self._peers.get(descriptor)
                moved |= self._admit() if peer is None else self._read(peer, came)
            if not moved:
                break
        self._put(came)

    def _read(self, peer: Peer, came: list[tuple[int, can.Message]]) -> bool:
        """Append a frame of this member; return False when it has no more, and close its connection if it left."""
        try:
            packet = peer.connection.recv(LONGEST + 1)
        except BlockingIOError:
            return False
        except OSError:
            packet = b""
        if not packet:
            self._changes += 1
            self._epoll.unregister(peer.connection)
            del self._peers[peer.connection.fileno()]
            peer.connection.close()
            return False
        parts = decode(packet)
        if parts is None:
            self._counts["malformed"] += 1
            return True
        if peer.expected[0] != UNKNOWN:
            self._counts["missed"] += (parts.sequence - int(peer.expected[0])) & SEQUENCE_MASK
        peer.expected[0] = (parts.sequence + 1) & SEQUENCE_MASK
        came.append((parts.sent_ns, parts.message))
        return True

    def _put(self, came: list[tuple[int, can.Message]]) -> None:
        """Add what has come to the inbox, in the order of sending and with epoch timestamps."""
        if not came:
            return
        if len(came) > 1:
            came.sort(key=lambda each: each[0])
        now_ns = time.monotonic_ns()
        epoch_ns = time.time_ns() - now_ns
        for sent_ns, message in came:
            message.timestamp = (min(sent_ns, now_ns) + epoch_ns) / 1e9
            message.channel = "unix"
            self._inbox.append(message)

    def _hear_own(self, packet: bytes) -> None:
        parts = decode(packet)
        if parts is not None:
            parts.message.is_rx = False
            self._put([(parts.sent_ns, parts.message)])

    def _take(self) -> can.Message | None:
        """Return the next frame of the inbox that the filters let pass."""
        while self._inbox:
            message = self._inbox.popleft()
            if self._matches_filters(message):
                return message
        return None

    def _settle_flag(self) -> None:
        """Keep `fileno()` readable while there is something that epoll does not know of, for whoever waits on it."""
        wanted = self._closed or bool(self._inbox) or bool(self._kept)
        if wanted != self._flag_is_up:
            if wanted:
                os.eventfd_write(self._flag, 1)
            else:
                os.eventfd_read(self._flag)
            self._flag_is_up = wanted
