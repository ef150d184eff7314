"""Which frame goes next on a CAN wire: the lowest identifier of those that are ready (ISO 11898-1)."""

from operator import itemgetter
from typing import Final, NamedTuple

from torquerig.device_sim.devices import NEVER_NS
from torquerig.driver.wire.frame import Frame


class Waiting(NamedTuple):
    """A frame in a send queue.

    Attributes:
        rank: What arbitration compares: the lower one wins.
        node_id: Who sends it; between equal frames, which real nodes must not send, the lower one wins.
        ready_ns: Since when it is ready to be sent [ns].
        frame: The frame.
    """

    rank: int
    node_id: int
    ready_ns: int
    frame: Frame


ROOM: Final = 512
"""So many frames may wait at a node: four times what it ever says at once, a block of 127 segments."""

_PRECEDENCE: Final = itemgetter(0, 1)  # rank, then node_id


def rank_of(frame: Frame) -> int:
    """Return the arbitration field as the number that it is on the wire, where a dominant bit is 0.

    The first 11 identifier bits come first; then RTR and the dominant IDE of a base frame, or the recessive SRR and IDE
    of an extended one; then that one's other 18 bits and its RTR. So a data frame beats the remote frame of the same
    identifier, and a base frame any extended frame that begins with its identifier.
    """
    if frame.extended:
        return (frame.can_id >> 18) << 21 | 0b11 << 19 | (frame.can_id & 0x3FFFF) << 1 | frame.remote
    return frame.can_id << 21 | frame.remote << 20


class SendQueues:
    """The frames that wait at all nodes of the wire.

    A node's controller offers its best frame, as one with a mailbox a frame does: the lowest identifier that is ready.
    Frames of one identifier keep their order.
    """

    def __init__(self) -> None:
        self._waiting: list[Waiting] = []
        self._held: dict[int, int] = {}  # frames by node

    def __len__(self) -> int:
        """Return how many frames wait, at all nodes together."""
        return len(self._waiting)

    def put(self, node_id: int, frame: Frame, ready_ns: int, *, room: int = ROOM) -> bool:
        """Let a frame wait at a node, unless `room` frames do already; whether it does."""
        held = self._held.get(node_id, 0)
        if held >= room:
            return False
        self._held[node_id] = held + 1
        self._waiting.append(Waiting(rank_of(frame), node_id, ready_ns, frame))
        return True

    def ready_ns(self) -> int:
        """Return when the first frame is ready [ns]; NEVER_NS if none waits."""
        return min([waiting.ready_ns for waiting in self._waiting], default=NEVER_NS)

    def take(self, at_ns: int) -> Waiting:
        """Remove and return the frame that wins the arbitration that begins at a time.

        Args:
            at_ns: When the wire is idle and at least one frame is ready [ns].
        """
        ready = [waiting for waiting in self._waiting if waiting.ready_ns <= at_ns]
        winner = min(ready, key=_PRECEDENCE)  # the first of equals: they keep their order
        self._waiting.remove(winner)
        self._held[winner.node_id] -= 1
        return winner
