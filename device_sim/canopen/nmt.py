"""The NMT slave: which state the node is in, and which command leads where (CiA 301, 7.3.2)."""

from typing import Protocol

from torquerig.driver.wire import cob, nmt
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.nmt import NmtCommand, NmtState


class NmtObserver(Protocol):
    """Whoever has to do what a change of NMT state means."""

    def nmt_state_changes(self, state: NmtState, at_ns: int) -> None:
        """The node is about to enter another state; the one it leaves is still set."""
        ...

    def nmt_state_changed(self, at_ns: int) -> None:
        """The node has entered another state."""
        ...

    def nmt_resets(self, command: NmtCommand, at_ns: int) -> None:
        """The node is about to enter initialisation by a reset command."""
        ...


class NmtSlave:
    """NMT state of a node.

    Attributes:
        state: The state; BOOT_UP while the node initialises.
        malformed: Frames on COB-ID 0 that are no NMT command.
    """

    __slots__ = ("_node_id", "_observer", "malformed", "state")

    def __init__(self, node_id: int, observer: NmtObserver) -> None:
        self._node_id = node_id
        self._observer = observer
        self.state = NmtState.BOOT_UP
        self.malformed = 0

    def receive(self, frame: Frame, at_ns: int) -> None:
        """Obey an NMT command if it is for this node or for all."""
        decoded = nmt.decode_command(frame)
        if decoded is None:
            self.malformed += 1
            return
        command, addressee = decoded
        if addressee not in {self._node_id, cob.ALL_NODES}:
            return
        target = nmt.TRANSITIONS.get((self.state, command))
        if target is NmtState.BOOT_UP:
            self._observer.nmt_resets(command, at_ns)
        elif target is not None:
            self.enter(target, at_ns)

    def enter(self, state: NmtState, at_ns: int) -> None:
        """Change the state, by a command or by the node's own decision."""
        if state is self.state:
            return
        self._observer.nmt_state_changes(state, at_ns)
        self.state = state
        self._observer.nmt_state_changed(at_ns)
