"""Which frame goes next on a CAN wire: the lowest identifier of those that are ready (ISO 11898-1)."""

from heapq import heappop, heappush
from itertools import count
from typing import Final, NamedTuple

from torquerig.device_sim.devices import NEVER_NS
from torquerig.driver.wire.frame import Frame


class Waiting(NamedTuple):
    """A frame in a send queue; the least of them wins the arbitration.

    Attributes:
        rank: What arbitration compares: the lower one wins.
        node_id: Who sends it; between equal frames, which real nodes must not send, the lower one wins.
        order: How many were put into the queues before it: frames of one identifier keep their order.
        ready_ns: Since when it is ready to be sent [ns].
        frame: The frame.
    """

    rank: int
    node_id: int
    order: int
    ready_ns: int
    frame: Frame


ROOM: Final = 512
"""So many frames may wait at a node: four times what it ever says at once, a block of 127 segments."""


def rank_of(frame: Frame) -> int:
    """Return the arbitration field as the number that it is on the wire, where a dominant bit is 0.

    The first 11 identifier bits come first; then RTR and the dominant IDE of a base frame, or the recessive SRR and IDE
    of an extended one; then that one's other 18 bits and its RTR. So a data frame beats the remote frame of the same
    identifier, and a base frame any extended frame that begins with its identifier.
    """
    can_id, _, remote, extended = frame
    if extended:
        return (can_id >> 18) << 21 | 0b11 << 19 | (can_id & 0x3FFFF) << 1 | remote
    return can_id << 21 | remote << 20


class SendQueues:
    """The frames that wait at all nodes of the wire.

    A node's controller offers its best frame, as one with a mailbox a frame does: the lowest identifier that is ready.
    Frames of one identifier keep their order.
    """

    def __init__(self) -> None:
        self._later: list[tuple[int, Waiting]] = []  # a heap by time: not ready at the last `take`, or put since
        self._ready: list[Waiting] = []  # a heap by precedence
        self._ready_ns = NEVER_NS  # of the first of those, or before
        self._held: dict[int, int] = {}  # frames by node
        self._orders = count()

    def __len__(self) -> int:
        """Return how many frames wait, at all nodes together."""
        return len(self._later) + len(self._ready)

    def put(self, node_id: int, frame: Frame, ready_ns: int, *, room: int = ROOM) -> bool:
        """Let a frame wait at a node, unless `room` frames do already; whether it does."""
        held = self._held.get(node_id, 0)
        if held >= room:
            return False
        self._held[node_id] = held + 1
        heappush(self._later, (ready_ns, Waiting(rank_of(frame), node_id, next(self._orders), ready_ns, frame)))
        return True

    def ready_ns(self) -> int:
        """Return when the first frame is ready [ns], or a time before if that has passed; NEVER_NS if none waits."""
        later = self._later
        return min(self._ready_ns, later[0][0]) if later else self._ready_ns

    def take(self, at_ns: int) -> Waiting:
        """Remove and return the frame that wins the arbitration that begins at a time.

        Args:
            at_ns: When the wire is idle and at least one frame is ready [ns].
        """
        later, ready = self._later, self._ready
        while later and later[0][0] <= at_ns:
            self._ready_ns = min(self._ready_ns, later[0][0])
            heappush(ready, heappop(later)[1])
        winner = heappop(ready)
        if not ready:
            self._ready_ns = NEVER_NS
        self._held[winner.node_id] -= 1
        return winner
