"""A PDO that the node receives (CiA 301, 7.2.2)."""

from collections.abc import Callable, Mapping

from torquerig.device_sim.canopen.core import NodeCore
from torquerig.device_sim.canopen.emergency import EmergencyProducer
from torquerig.device_sim.canopen.mapping import MappingObject
from torquerig.device_sim.canopen.object_store import Entry, Watcher
from torquerig.device_sim.canopen.pdo_parameters import PdoParameters
from torquerig.driver.wire import pdo
from torquerig.driver.wire.emcy import EmergencyCode
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sdo_abort import SdoAbort


class Rpdo:
    """Writes received data into the objects, on reception or at the next SYNC.

    Attributes:
        parameters: Its communication object.
        deadline: The event timer's alarm.
        synchronous: SYNC makes its data valid.
        received: Frames that were long enough.
        too_short: Frames that were not, and were not processed.
        refused: Values that limits or guards of their objects refused.
    """

    __slots__ = (
        "_codec",
        "_complaint",
        "_emergency",
        "_entries",
        "_event_ns",
        "_mapping",
        "_pending",
        "_places",
        "_plan",
        "_slots",
        "_store",
        "_watched",
        "_watchers",
        "deadline",
        "parameters",
        "received",
        "refused",
        "synchronous",
        "too_short",
    )

    def __init__(
        self, number: int, core: NodeCore, emergency: EmergencyProducer, missed: Callable[[int], None]
    ) -> None:
        """Build it.

        Args:
            number: From 0: objects 1400 + number and 1600 + number.
            core: The node's shared parts.
            emergency: Is told of wrong lengths.
            missed: Called when the event timer's deadline passes while it is watched.
        """
        store = core.store
        self.parameters = PdoParameters(store, 0x1400 + number, pdo.allowed_for_rpdo, lambda: self._mapping.count)
        self._mapping = MappingObject(store, 0x1600 + number, lambda: self.parameters.exists, inward=True)
        self._store = store
        self._emergency = emergency
        self.deadline = core.timers.add(missed)
        self._watched = False
        self._complaint: EmergencyCode | None = None
        self._pending: bytes | None = None
        self.received = 0
        self.too_short = 0
        self.refused = 0
        self.reload()

    def reload(self) -> None:
        """Take over what the objects say now."""
        mapping = self._mapping.compile()
        self._codec = mapping.codec
        self._places = mapping.places
        self._slots = tuple(entry.slot for entry in mapping.entries)
        checked = any(self._store.is_checked(entry) for entry in mapping.entries)
        self._entries: tuple[Entry, ...] = mapping.entries if checked else ()
        watchers = (watcher for entry in mapping.entries for watcher in self._store.watchers(entry.index))
        self._watchers: tuple[Watcher, ...] = tuple(dict.fromkeys(watchers))
        self.synchronous = pdo.is_synchronous(self.parameters.transmission_type)
        self._event_ns = self.parameters.event_ns if self.parameters.exists else 0
        self._pending = None
        self._plan: tuple[int, ...] | None = None

    @property
    def active(self) -> bool:
        """Whether it exists and has something to carry."""
        return self.parameters.exists and self._codec.size > 0

    def watch(self, from_ns: int) -> None:
        """Watch the event timer: a reception is due within it from now on, and after every reception."""
        self._watched = True
        if self._event_ns:
            self.deadline.arm(from_ns + self._event_ns)
        else:
            self.deadline.cancel()

    def unwatch(self) -> None:
        """Watch no deadline."""
        self._watched = False
        self.deadline.cancel()

    def renew(self, at_ns: int) -> None:
        """Take over a changed configuration while the node runs."""
        self.reload()
        if self._watched:
            self.watch(at_ns)

    def receive(self, frame: Frame, at_ns: int) -> None:
        """Hear a frame on its identifier."""
        data = frame.data
        size = self._codec.size
        if len(data) != size or self._complaint is not None:
            self._judge_length(len(data), at_ns)
            if len(data) < size:
                self.too_short += 1
                return
        self.received += 1
        if self._watched and self._event_ns:
            self.deadline.arm(at_ns + self._event_ns)
        if self.synchronous:
            self._pending = data
        else:
            self._apply(data, at_ns, at_ns + self._store.reaction_ns)

    def sync(self, at_ns: int) -> None:
        """Let the data that came since the last SYNC take effect."""
        data = self._pending
        if data is not None:
            self._pending = None
            self._apply(data, at_ns, at_ns)

    def plan(self, places: Mapping[int, int]) -> tuple[int, ...] | None:
        """How a steady cycle reads it (`steady_memory.RPDO`); the same object until it is configured anew.

        Args:
            places: Which of the places that the cycle asks for is whose, by the slots of the objects that it knows.

        Returns:
            Identifier, length, and places; None if it carries anything else, or does not act when it comes.
        """
        if self._plan is None and places.keys() >= set(self._slots) and not (self.synchronous or self._entries):
            found = [-1] * len(places)
            for slot, (at, _size) in zip(self._slots, self._places, strict=True):
                found[places[slot]] = at
            self._plan = (self.parameters.cob_id, self._codec.size, *found)
        return self._plan if self._complaint is None else None

    def lend(self) -> tuple[int, int, int]:
        """What a steady cycle goes on with: how long the next may take (or 0), its deadline [ns], how many came."""
        return self._event_ns if self._watched else 0, self.deadline.due_ns, self.received

    def take_back(self, deadline_ns: int, received: int) -> None:
        """Go on from where a steady cycle ended."""
        self.deadline.arm(deadline_ns)
        self.received = received

    def _apply(self, data: bytes, at_ns: int, effect_ns: int) -> None:
        received: tuple[int, ...] = self._codec.unpack_from(data)
        values = self._store.values
        if self._entries:
            self._apply_checked(received)
        else:
            for slot, value in zip(self._slots, received, strict=True):
                values[slot] = value
        for watcher in self._watchers:
            watcher(at_ns, effect_ns)

    def _apply_checked(self, received: tuple[int, ...]) -> None:
        for entry, value in zip(self._entries, received, strict=True):
            try:
                self._store.check(entry, value)
            except SdoAbort:
                self.refused += 1
            else:
                self._store.values[entry.slot] = value

    def _judge_length(self, length: int, at_ns: int) -> None:
        """Tell a wrong length by EMCY 0x8210 (too short) or 0x8220 (longer than mapped), and when it is right again."""
        complaint = None
        if length != self._codec.size:
            too_short = length < self._codec.size
            complaint = EmergencyCode.PDO_TOO_SHORT if too_short else EmergencyCode.PDO_TOO_LONG
        if self._complaint is not None and complaint is not self._complaint:
            self._emergency.clear((self._complaint, self), at_ns)
        self._complaint = complaint
        if complaint is not None:  # told once: the emergencies know whether it was, and forget it with a reset
            self._emergency.report(complaint, at_ns, cause=(complaint, self))
