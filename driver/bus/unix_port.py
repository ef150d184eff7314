"""The cycle's own way through the unix bus: its connections, read and written by compiled code.

There are no filters here: process data and all the rest come through the same connections. So what is no process data
is kept, in its order and with its time, for whoever handles frames; and if somebody wants the log, process data too.
"""

from collections import deque
from collections.abc import Callable, MutableSequence, Sequence
from typing import Final, cast

import numpy as np

from torquerig.driver.bus import unix_kernels
from torquerig.driver.bus.compiled import bind
from torquerig.driver.bus.cyclic import Cycle
from torquerig.driver.bus.cyclic_kernels import BATCH
from torquerig.driver.bus.cyclic_memory import HEADER, NOW, POLLED, VECTOR, address, point, poll_for
from torquerig.driver.bus.interface import Tap
from torquerig.driver.bus.unix import UnixBus
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Arrival, Frame

MOST_PEERS: Final = 256
"""As many as may wait at a member's door; a fuller bus is used by frames."""
_OUT: Final = 128  # commands at most; the SYNC stands behind them
_LOGGED: Final = 1024

PACKET: Final = np.dtype(
    [
        *(("magic", "u4"), ("flags", "u1"), ("length", "u1"), ("reserved", "u1", (2,))),
        *(("can_id", "u4"), ("sequence", "u4"), ("sent_ns", "u8"), ("data", "u1", (8,))),
    ]
)
"""As in `unix_packet`."""
ENTRY: Final = np.dtype(
    [("at_ns", "i8"), ("kind", "i8"), ("can_id", "u4"), ("flags", "u1"), ("length", "u1"), ("data", "u1", (8,))],
    align=True,
)
UNIX_WIRE: Final = np.dtype(
    [
        *NOW,
        ("polled", POLLED, (1 + MOST_PEERS,)),
        *((name, "i8") for name in ("peers", "sent", "latest_ns", "missed", "malformed", "pending", "tapped")),
        *((name, "i8", (MOST_PEERS,)) for name in ("expected", "not_taken", "gone")),
        *((name, "u8") for name in ("headers_in_at", "headers_out_at")),
        ("logged", "i8"),
        ("log", ENTRY, (_LOGGED,)),
        ("packet_in", PACKET, (BATCH,)),
        ("vector_in", VECTOR, (BATCH,)),
        ("header_in", HEADER, (BATCH,)),
        ("packet_out", PACKET, (_OUT + 1,)),
        ("vector_out", VECTOR, (_OUT + 1,)),
        ("header_out", HEADER, (_OUT + 1,)),
    ],
    align=True,
)


class UnixPort:
    """A cycle's port on a member of the unix bus; satisfies `CyclicPort`.

    While it is open the member belongs to the thread that uses the port.
    """

    def __init__(
        self,
        member: UnixBus,
        cycle: Cycle,
        *,
        tap: Tap | None,
        take_inbox: Callable[[], Arrival | None],
        early: deque[Arrival],
    ) -> None:
        """Lay the packets out; nothing is sent.

        Args:
            member: The member.
            cycle: The cycle.
            tap: Is told every frame.
            take_inbox: Takes a frame that the member has taken from its connections already.
            early: Where to keep frames that are no process data and were taken already; the tap is told.
        """
        self._early = early
        self._member = member
        self._tap = tap
        self._take_inbox = take_inbox
        self._wire = np.zeros(1, dtype=UNIX_WIRE)
        record = self._wire[0]
        record["tapped"] = tap is not None
        point(self._wire, "header_in", "vector_in", "packet_in", PACKET.itemsize)
        point(self._wire, "header_out", "vector_out", "packet_out", PACKET.itemsize)
        record["headers_in_at"] = address(self._wire, "header_in")
        record["headers_out_at"] = address(self._wire, "header_out")
        record["packet_out"]["magic"] = unix_kernels.MAGIC
        self._address(_OUT, cycle.sync.can_id, 0)
        for number, command in enumerate(cycle.field("command")[0]):
            self._address(number, command["can_id"], int(command["length"]))
        self._meet()
        self._look_around()
        records = cycle.block, self._wire
        self.sync = bind(unix_kernels.unix_sync, *records, scalars=("int64", "boolean"))
        self.take = bind(unix_kernels.unix_take, *records, scalars=("int64",))
        self.command = bind(unix_kernels.unix_command, *records, scalars=("int64", "boolean"))

    def others(self) -> Sequence[Arrival]:
        """Return frames that are no process data; takes in newcomers, and lets go who left."""
        self._take_over()
        self.tell()
        self._look_around()
        arrivals = tuple(self._early)
        self._early.clear()
        return arrivals

    def error(self, flags: int) -> BusError:
        """What an error among the flags means: nothing that can come from a connection; waiting may fail."""
        return BusError(f"cannot wait on the {self._member.channel_info}: error {-flags}")

    def tell(self) -> None:
        """Tell the tap what the port has sent and taken, and keep the frames that are others' to handle."""
        record = self._wire[0]
        count = int(record["logged"])
        if not count:
            return
        entries = record["log"][:count].tolist()
        record["logged"] = record["pending"] = 0
        if record["peers"] > 1:
            entries.sort(key=lambda entry: entry[0])  # each peer's come in order, one peer after the other
        for at_ns, kind, can_id, flags, length, data in entries:
            if flags & unix_kernels.ERROR:
                continue
            remote, extended = bool(flags & unix_kernels.REMOTE), bool(flags & unix_kernels.EXTENDED)
            frame = Frame(can_id, bytes(data[:length]), remote, extended)
            if self._tap is not None:
                self._tap(at_ns, frame)
            if kind == unix_kernels.FOREIGN:
                self._early.append(Arrival(at_ns, frame))

    def _look_around(self) -> None:
        """Take in newcomers, and let go who left."""
        self._settle()
        member, record = self._member, self._wire[0]
        with member._lock:
            while member._knock.poll(0) and member._admit():
                pass
            for peer, gone in zip(self._peers, record["gone"].tolist(), strict=False):
                if gone and peer.connection.fileno() >= 0:
                    member._part_with(peer)
        if tuple(member._peers.values()) != self._peers:
            self._meet()
        self._take_over()

    def _take_over(self) -> None:
        """Take what the member has taken from its connections already."""
        while self._member._inbox and (arrival := self._take_inbox()) is not None:
            self._early.append(arrival)

    def close(self) -> None:
        """Give back what was lent."""
        self.tell()
        self._settle()
        self._member._sent = [int(self._wire["sent"][0])]
        for peer in self._peers:
            peer.expected = [int(peer.expected[0])]

    def _address(self, number: int, can_id: int, length: int) -> None:
        """Lay out a packet to be sent."""
        record = self._wire[0]
        packet = record["packet_out"][number]
        packet["can_id"], packet["length"] = can_id, length
        record["vector_out"][number]["size"] = unix_kernels.PACKET_HEAD + length

    def _meet(self) -> None:
        """Have the compiled code know all members that the member knows, and share what is counted of their frames."""
        member, record = self._member, self._wire[0]
        sent = int(member._sent[0])
        member._sent = cast("MutableSequence[int]", self._wire["sent"])
        member._sent[0] = sent
        self._peers = tuple(member._peers.values())[:MOST_PEERS]
        expected = [int(peer.expected[0]) for peer in self._peers]
        for place, (peer, number) in enumerate(zip(self._peers, expected, strict=True)):
            peer.expected = record["expected"][place : place + 1]
            peer.expected[0] = number
        record["gone"] = record["not_taken"] = 0
        record["peers"] = len(self._peers)
        poll_for(self._wire, (member._place.door.fileno(), *(peer.connection.fileno() for peer in self._peers)))

    def _settle(self) -> None:
        """Add what the compiled code counted to the member's counts."""
        member, record = self._member, self._wire[0]
        with member._lock:
            for name in ("missed", "malformed"):
                member._counts[name] += int(record[name])
                record[name] = 0
            for peer, count in zip(self._peers, record["not_taken"].tolist(), strict=False):
                if count:
                    member._not_taken[peer.process] += count
        record["not_taken"] = 0
