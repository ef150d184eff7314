"""Several buses as one: a drive or a few on each, and the master on all of them.

What the master sends goes to the bus of the drive that it is for; SYNC, its heartbeat and whatever is for all go to
every bus, back to back. What it receives comes in the order of time.

Drives watch each other (objects 1016 and 1028: a redundant mechanism is never driven by a subset of its drives). So
heartbeats and emergencies of the drives are passed on to the other buses, where their siblings hear them as if they
were there. That happens whenever the master listens, which is all the time that it does not compute.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Final, Protocol, runtime_checkable

from torquerig.driver.bus.echoes import EchoFilter
from torquerig.driver.bus.interface import Bus
from torquerig.driver.bus.merged import MergedReception, Wait
from torquerig.driver.errors import BusError
from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Arrival, Frame

_TO_A_NODE: Final = (*cob.RPDO.values(), cob.SDO_REQUEST, *cob.TPDO.values(), cob.HEARTBEAT)
"""What a master sends to one node; TPDOs and error control as remote frames."""
_PASSED_ON: Final = (cob.EMCY, cob.HEARTBEAT)
_FROM_A_NODE: Final = (*_PASSED_ON, *cob.TPDO.values(), cob.SDO_RESPONSE)
_NMT_LENGTH: Final = 2
_ECHO_NS: Final = 10_000_000
"""As long as the master itself waits for the echo of its first frame (`DriveSession.open`)."""


@runtime_checkable
class Counting(Protocol):
    """A bus that counts what goes wrong on it."""

    @property
    def counts(self) -> Mapping[str, int]:
        """How often, by kind."""
        ...


class SeveralBuses:
    """Buses with one clock behind our bus protocol.

    A bus that takes no frame does not keep the others from getting theirs: its error is raised by the next `receive`,
    so that a stop reaches every drive that can still be reached.

    Attributes:
        members: The buses.
    """

    def __init__(self, members: Sequence[Bus], homes: Mapping[int, int], wait: Wait) -> None:
        """Join buses; `close` closes them all.

        Args:
            members: The buses, in real time or on the wires of one simulated time.
            homes: On which of them each node is, by node-id: its place in `members`. Frames for other nodes go to all.
            wait: Waits for all of them at once.

        Raises:
            ValueError: A home is not among the members, or a node-id is none.
        """
        self.members = tuple(members)
        for node_id, place in homes.items():
            cob.check_node_id(node_id)
            if not 0 <= place < len(self.members):
                raise ValueError(f"node {node_id} cannot be on bus {place} of {len(self.members)}")
        self._all = tuple(range(len(self.members)))
        self._homes = {node_id: (place,) for node_id, place in homes.items()}
        self._targets = {base + node: (place,) for node, place in homes.items() for base in _TO_A_NODE}
        self._sources = {base + node: place for node, place in homes.items() for base in _FROM_A_NODE}
        self._passed_on = frozenset(base + node for node in homes for base in _PASSED_ON)
        self._merged = MergedReception(self.members, wait)
        self._echoes = tuple(EchoFilter(_ECHO_NS) for _ in self.members)
        self._failure: BusError | None = None
        self._counts = Counter(passed_on=0, misplaced=0, echoed=0)

    @property
    def counts(self) -> dict[str, int]:
        """What happened between the buses, and what went wrong on each, named by its place from 1.

        `passed_on`: heartbeats and emergencies; `misplaced`: frames of a drive on a bus that is not its own, which are
        handed to nobody; `echoed`: own frames that a bus gave back.
        """
        own = {
            f"bus {place}: {kind}": count
            for place, member in enumerate(self.members, start=1)
            if isinstance(member, Counting)
            for kind, count in member.counts.items()
        }
        return {**self._counts, **own}

    def now_ns(self) -> int:
        """Return the time of all the buses [ns]."""
        return self.members[0].now_ns()

    def wait_until(self, due_ns: int) -> None:
        """Wait without looking at the buses; frames queue meanwhile."""
        self.members[0].wait_until(due_ns)

    def send(self, frame: Frame) -> None:
        """Hand a frame over to the bus of the node that it is for, or to all of them.

        Raises:
            ValueError: It is not a classic CAN frame.
        """
        self._send(frame, self._targets_of(frame))

    def receive(self, until_ns: int) -> Arrival | None:
        """Return the next frame, or None once `until_ns` has come; what waits already comes first.

        Raises:
            BusError: A link is down or gone, a bus is closed, or one did not take a frame since the last call.
        """
        while True:
            if self._failure is not None:
                failure, self._failure = self._failure, None
                raise failure
            heard = self._merged.receive(until_ns)
            if heard is None:
                return None
            place, arrival = heard
            if self._is_for_the_master(place, arrival):
                return arrival
            if arrival.at_ns >= until_ns:  # on a bus that never falls silent there is always another
                return None

    def close(self) -> None:
        """Close all buses; may be called again."""
        for member in self.members:
            member.close()

    def _targets_of(self, frame: Frame) -> tuple[int, ...]:
        """Places of the buses that a frame of the master is for."""
        if frame.extended:
            return self._all
        if frame.can_id == cob.NMT and len(frame.data) == _NMT_LENGTH:
            return self._homes.get(frame.data[1], self._all)
        return self._targets.get(frame.can_id, self._all)

    def _send(self, frame: Frame, places: Sequence[int]) -> None:
        for place in places:
            try:
                self.members[place].send(frame)
            except BusError as error:
                self._failure = self._failure or error
            else:
                self._echoes[place].sent(frame, self.now_ns())

    def _is_for_the_master(self, place: int, arrival: Arrival) -> bool:
        """Whether a frame is to be handed on; what drives need of each other is passed on meanwhile."""
        frame = arrival.frame
        if self._echoes[place].is_echo(arrival):
            self._counts["echoed"] += 1
            return False
        home = None if frame.extended or frame.remote else self._sources.get(frame.can_id)
        if home is None:
            return True
        if home != place:
            self._counts["misplaced"] += 1
            return False
        if frame.can_id in self._passed_on:
            self._counts["passed_on"] += 1
            self._send(frame, [other for other in self._all if other != place])
        return True
