"""Simulated devices on one bus: who hears a frame, and in which order time passes for them all.

Sans I/O: frames and times go in, frames that are ready to be sent come out. Whoever joins this to a bus (in simulated
or in real time) arbitrates, delays and stamps the frames.
"""

from collections.abc import Callable, Container, Iterable, Mapping
from types import MappingProxyType
from typing import Final, NamedTuple, Protocol, runtime_checkable

from torquerig.driver.wire.frame import Frame

NEVER_NS: Final = 1 << 62  # a time that no simulation reaches: 146 years


class Emission(NamedTuple):
    """A frame that a node wants to send.

    Attributes:
        ready_ns: When the node hands it to its CAN controller; arbitration starts then, never before.
        node_id: Who sends it.
        frame: The frame.
    """

    ready_ns: int
    node_id: int
    frame: Frame


class Node(Protocol):
    """One device on the bus. Its time moves forward only, by `advance` and `receive`."""

    @property
    def node_id(self) -> int:
        """CANopen node-id, 1 to 127."""
        ...

    def next_event_ns(self) -> int:
        """When something happens next in the node without a frame; NEVER_NS when nothing will."""
        ...

    def advance(self, to_ns: int) -> None:
        """Let everything happen that is due at or before the time."""
        ...

    def receive(self, frame: Frame, at_ns: int) -> None:
        """Hear a frame that was complete at the time; any frame is legal, and none raises."""
        ...

    def take(self) -> list[Emission]:
        """What the node wants to send since it was last asked, in the order in which it decided so."""
        ...


@runtime_checkable
class OpenNode(Node, Protocol):
    """A node that shows what it waits for, so that it need not be asked at every frame and every event."""

    @property
    def listeners(self) -> Container[int]:
        """Identifiers of the 11-bit data frames that it hears now: always the same object, with the present content."""
        ...

    def show_next_event(self, board: list[int], place: int) -> None:
        """From now on keep in `board[place]` what `next_event_ns` tells."""
        ...


class SimulatedDevices:
    """All nodes of one bus under one time: events happen in their order, whichever node they belong to.

    The order matters because the nodes' motors share a machine, whose time cannot go back.

    Attributes:
        nodes: The nodes by node-id.
    """

    def __init__(self, nodes: Iterable[Node]) -> None:
        self._nodes = tuple(nodes)
        self.nodes: Mapping[int, Node] = MappingProxyType({node.node_id: node for node in self._nodes})
        if len(self.nodes) != len(self._nodes):
            raise ValueError(f"node-ids must differ: {sorted(node.node_id for node in self._nodes)}")
        self._hearers = tuple(
            (node.node_id, node, node.listeners if isinstance(node, OpenNode) else _ALL) for node in self._nodes
        )
        self._dues = [NEVER_NS] * (len(self._nodes) + 1)  # in the order of the nodes; the last is nobody's
        self._asked: list[tuple[int, Node]] = []  # who does not keep its due time there by itself
        for place, node in enumerate(self._nodes):
            if isinstance(node, OpenNode):
                node.show_next_event(self._dues, place)
            else:
                self._asked.append((place, node))

    def next_event_ns(self) -> int:
        """When something happens next without a frame; NEVER_NS when nothing will."""
        dues = self._dues
        for place, node in self._asked:
            dues[place] = node.next_event_ns()
        return min(dues)

    def advance(self, to_ns: int) -> list[Emission]:
        """Let everything happen that is due at or before the time.

        Args:
            to_ns: Time to advance to; one that has passed changes nothing [ns].

        Returns:
            What the nodes want to send, in the order of the events.
        """
        emissions: list[Emission] = []
        while (due_ns := self.next_event_ns()) <= to_ns:
            node = self._nodes[self._dues.index(due_ns)]
            node.advance(due_ns)
            emissions += node.take()
        return emissions

    def intervene(self, node_id: int, at_ns: int, act: Callable[[int], None]) -> list[Emission]:
        """Do something to a node that no frame does, such as switching it off, after all that is due until then.

        Args:
            node_id: Which node.
            at_ns: When [ns].
            act: Does it to the node; is called with the time.

        Returns:
            What the nodes want to send.

        Raises:
            KeyError: There is no such node.
        """
        node = self.nodes[node_id]
        emissions = self.advance(at_ns)
        act(at_ns)
        return emissions + node.take()

    def receive(self, frame: Frame, at_ns: int, sender: int | None = None) -> list[Emission]:
        """Let every node but the sender hear a frame, after all that is due until then has happened.

        Args:
            frame: The frame.
            at_ns: When it was complete on the bus [ns].
            sender: Node-id of the node it comes from, or None when it comes from outside.

        Returns:
            What the nodes want to send, in the order in which they decided so.
        """
        emissions = self.advance(at_ns)
        can_id = frame.can_id
        plain = not (frame.remote or frame.extended)
        for node_id, node, listeners in self._hearers:
            if node_id != sender and (can_id in listeners or not plain):
                node.receive(frame, at_ns)
                emissions += node.take()
        return emissions


_ALL: Final = range(1 << 29)  # what a node hears that does not select
