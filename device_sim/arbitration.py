"""Which frame goes next on a CAN wire: a node's oldest, and among nodes the lowest identifier (ISO 11898-1)."""

from collections import deque
from typing import NamedTuple

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
    """The send queue of every node on the wire."""

    def __init__(self) -> None:
        self._queues: dict[int, deque[Waiting]] = {}

    def put(self, node_id: int, frame: Frame, ready_ns: int) -> None:
        """Append a frame to a node's queue."""
        queue = self._queues.get(node_id)
        if queue is None:
            queue = self._queues[node_id] = deque()
        queue.append(Waiting(rank_of(frame), node_id, ready_ns, frame))

    def ready_ns(self) -> int:
        """Return when the first of the queues' heads is ready [ns]; NEVER_NS if all are empty."""
        return min([queue[0].ready_ns for queue in self._queues.values() if queue], default=NEVER_NS)

    def take(self, at_ns: int) -> Waiting:
        """Remove and return the frame that wins the arbitration that begins at a time.

        Args:
            at_ns: When the wire is idle and at least one head is ready [ns].
        """
        winner = min([queue[0] for queue in self._queues.values() if queue and queue[0].ready_ns <= at_ns])
        self._queues[winner.node_id].popleft()
        return winner
