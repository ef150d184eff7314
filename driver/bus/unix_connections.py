"""A unix bus member's connections as compiled code sees them: memory laid out once, that frames go through in batches.

What the member's own methods (python-can's side of it) count and number stands in this memory too, so both ways may
take turns.
"""

import struct
from collections.abc import MutableSequence, Sequence
from operator import itemgetter
from typing import Final, cast

import numpy as np

from torquerig.driver.bus import unix_frame_kernels, unix_kernels
from torquerig.driver.bus.compiled import bind
from torquerig.driver.bus.cyclic import CYCLE, NOBODY
from torquerig.driver.bus.cyclic_kernels import BATCH
from torquerig.driver.bus.cyclic_memory import HEADER, NOW, POLLED, VECTOR, address, point, poll_for
from torquerig.driver.bus.messages import check_frame
from torquerig.driver.bus.unix import UnixBus
from torquerig.driver.bus.unix_folder import Peer
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import MAX_DATA_LENGTH, Frame

MOST_PEERS: Final = 256
"""As many as may wait at a member's door."""
FRAMES: Final = 64
"""Frames handed to the kernel with one call; more take several."""
COMMANDS: Final = 128
"""Commands of a cycle at most."""
FIRST_FRAME: Final = COMMANDS  # packets to be sent: a cycle's commands, then frames, and as the last one its SYNC
SYNC_PLACE: Final = COMMANDS + FRAMES
_LOGGED: Final = 1024
_LONG_AGO_NS: Final = 0

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
        *((name, "i8") for name in ("peers", "sent", "latest_ns", "missed", "malformed", "pending")),
        *((name, "i8") for name in ("tapped", "spin_ns")),
        *((name, "i8", (MOST_PEERS,)) for name in ("expected", "not_taken", "gone")),
        *((name, "u8") for name in ("headers_in_at", "headers_out_at")),
        ("logged", "i8"),
        ("log", ENTRY, (_LOGGED,)),
        ("packet_in", PACKET, (BATCH,)),
        ("vector_in", VECTOR, (BATCH,)),
        ("header_in", HEADER, (BATCH,)),
        ("packet_out", PACKET, (SYNC_PLACE + 1,)),
        ("vector_out", VECTOR, (SYNC_PLACE + 1,)),
        ("header_out", HEADER, (SYNC_PLACE + 1,)),
    ],
    align=True,
)
_ENTRY: Final = struct.Struct("=qqIBB8s2x")
_FRAME: Final = struct.Struct("=IBB2xI12x8s")  # what of a packet its sender's caller says
assert (_ENTRY.size, _FRAME.size) == (ENTRY.itemsize, PACKET.itemsize)  # noqa: S101  (the same memory)

_PACKET_SIZE: Final = PACKET.itemsize
_BASE_ID: Final = 0x7FF
_lay_out: Final = _FRAME.pack_into
_time_of: Final = itemgetter(0)

Entry = tuple[int, int, int, int, int, bytes]
"""Of a frame: its time [ns], whether it was process data, identifier, flags, length, eight bytes."""


class UnixConnections:
    """A member's connections, read and written by compiled code.

    They belong to one thread at a time, and the member with them.
    """

    def __init__(self, member: UnixBus, spin_ns: int = 0) -> None:
        """Lay the packets out; nothing is sent.

        Args:
            member: The member.
            spin_ns: For how long a port spins for answers before it sleeps for them: to be woken up takes longer than a
                drive on the same machine needs to answer [ns].
        """
        self.member = member
        self.wire = np.zeros(1, dtype=UNIX_WIRE)
        record = self.wire[0]
        record["spin_ns"] = spin_ns
        point(self.wire, "header_in", "vector_in", "packet_in", PACKET.itemsize)
        point(self.wire, "header_out", "vector_out", "packet_out", PACKET.itemsize)
        record["headers_in_at"] = address(self.wire, "header_in")
        record["headers_out_at"] = address(self.wire, "header_out")
        record["packet_out"]["magic"] = unix_kernels.MAGIC
        self._logged, self._pending = (self.wire[name].data for name in ("logged", "pending"))
        self._log = record["log"].view(np.uint8).data
        self._out = record["packet_out"][FIRST_FRAME:SYNC_PLACE].view(np.uint8).data
        self._at_door = record["polled"]["revents"]
        self._peers: tuple[Peer, ...] = ()
        self.meet()
        no_cycle = np.zeros(1, dtype=CYCLE)
        no_cycle["row_of"] = NOBODY
        self._take = bind(unix_frame_kernels.unix_frames_take, no_cycle, self.wire, scalars=("int64",))
        self._send = bind(unix_frame_kernels.unix_frames_send, self.wire, scalars=("int64", "int64", "boolean"))

    def usable(self) -> bool:
        """Whether compiled code can serve all members, and nobody wants frames filtered: to be asked before its use."""
        member = self.member
        if member._changes != self._met:
            self.meet()
        return self._few and member._filters is None

    def take(self, until_ns: int) -> int:
        """Read what has come; if there is nothing, wait for it until a time.

        Newcomers are let in, and who left is let go.

        Returns:
            0 if there are no `entries`.

        Raises:
            BusError: Waiting failed.
        """
        found = self._take(until_ns)
        if found < 0:
            raise BusError(f"cannot wait on the {self.member.channel_info}: error {-found}")
        if found == unix_frame_kernels.COMPANY:
            self.look_around()
            found = self._take(_LONG_AGO_NS)  # what newcomers have said already
        return found

    def entries(self) -> list[Entry]:
        """Return what was read, and what a port noted down, in the order of sending."""
        count = self._logged[0]
        entries = list(_ENTRY.iter_unpack(self._log[: count * _ENTRY.size]))
        self._logged[0] = self._pending[0] = 0
        if count > 1:
            entries.sort(key=_time_of)  # each peer's come in order, one peer after the other
        return entries

    def send(self, frames: Sequence[Frame]) -> int:
        """Send frames to every member; what one cannot take is counted.

        Returns:
            How many: not all if newcomers have made the members too many.

        Raises:
            ValueError: One is no classic CAN frame.
        """
        sent = count = 0
        for frame in frames:
            if count == FRAMES:
                if not self._send_laid_out(count):
                    return sent
                sent, count = sent + count, 0
            can_id, data, remote, extended = frame
            flags = 0
            if remote or extended or not 0 <= can_id <= _BASE_ID or len(data) > MAX_DATA_LENGTH:
                check_frame(frame)
                flags = extended * unix_kernels.EXTENDED | remote * unix_kernels.REMOTE
            _lay_out(self._out, count * _PACKET_SIZE, unix_kernels.MAGIC, flags, len(data), can_id, data)
            count += 1
        return sent + count if self._send_laid_out(count) else sent

    def _send_laid_out(self, count: int) -> bool:
        """Send the first packets of those that are for frames, unless newcomers make the members too many."""
        found = self._send(FIRST_FRAME, count, True)  # noqa: FBT003  (compiled code knows no keywords)
        if found == unix_frame_kernels.COMPANY:
            self.look_around()
            if not self._few:
                return False
            found = self._send(FIRST_FRAME, count, False)  # noqa: FBT003
        if found == unix_frame_kernels.PARTED:
            self.look_around()
        return True

    def has_company(self) -> bool:
        """Whether newcomers were at the door when the connections were last looked at, or members have left."""
        return bool(self._at_door.item(0)) or bool(self._gone.any())

    def look_around(self) -> None:
        """Let newcomers in, and let go who left; what those said before waits in the member's inbox."""
        self.settle()
        member = self.member
        with member._lock:
            while member._knock.poll(0) and member._admit():
                pass
            for peer, gone in zip(self._peers, self.wire[0]["gone"].tolist(), strict=False):
                if gone and peer.connection.fileno() >= 0:
                    member._part_with(peer)
            member._settle_flag()
        if member._changes != self._met:
            self.meet()

    def meet(self) -> None:
        """Have the compiled code know all members that the member knows, and share what is counted of their frames."""
        self.settle()
        member, record = self.member, self.wire[0]
        sent = int(member._sent[0])
        member._sent = cast("MutableSequence[int]", self.wire["sent"])
        member._sent[0] = sent
        self._peers = tuple(member._peers.values())[:MOST_PEERS]
        self._gone = record["gone"][: len(self._peers)]
        self._few = len(self._peers) == len(member._peers)
        self._met = member._changes
        expected = [int(peer.expected[0]) for peer in self._peers]
        for place, (peer, number) in enumerate(zip(self._peers, expected, strict=True)):
            peer.expected = record["expected"][place : place + 1]
            peer.expected[0] = number
        record["gone"] = record["not_taken"] = 0
        record["peers"] = len(self._peers)
        poll_for(self.wire, (member._place.door.fileno(), *(peer.connection.fileno() for peer in self._peers)))

    def settle(self) -> None:
        """Add what the compiled code counted to the member's counts."""
        member, record = self.member, self.wire[0]
        with member._lock:
            for name in ("missed", "malformed"):
                member._counts[name] += int(record[name])
                record[name] = 0
            for peer, count in zip(self._peers, record["not_taken"].tolist(), strict=False):
                if count:
                    member._not_taken[peer.process] += count
        record["not_taken"] = 0
