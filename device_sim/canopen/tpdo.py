"""A PDO that the node sends (CiA 301, 7.2.2)."""

from collections.abc import Callable, Mapping
from operator import itemgetter
from typing import Final, NamedTuple

from torquerig.device_sim.canopen.core import NodeCore
from torquerig.device_sim.canopen.mapping import MappingObject
from torquerig.device_sim.canopen.object_store import Source
from torquerig.device_sim.canopen.pdo_parameters import PdoParameters
from torquerig.driver.wire import pdo
from torquerig.driver.wire.frame import Frame

CONSTANT: Final = 0  # what a steady cycle's code calls a value that stays
REFUSED: Final = -1  # and one that it does not know


class TpdoPlan(NamedTuple):
    """How a steady cycle makes a TPDO.

    Attributes:
        frame: `steady_memory.TPDO`: identifier, length, and with every how many SYNCs it is sent.
        fields: `steady_memory.FIELD`: what each number is, its place in the data, its bytes.
    """

    frame: tuple[int, int, int]
    fields: tuple[tuple[int, int, int], ...]


class Tpdo:
    """Samples its objects and sends them: after SYNC, on an event, on a timer, or when asked.

    An event is a change of a mapped object that is not measured; measured ones change all the time.

    Attributes:
        parameters: Its communication object.
        event_driven: Its type makes changes of its objects an event (0, 254, 255).
    """

    __slots__ = (
        "_cob_id",
        "_codec",
        "_event_ns",
        "_event_timer",
        "_inhibit_ns",
        "_inhibit_timer",
        "_known",
        "_live",
        "_mapping",
        "_places",
        "_plan",
        "_ready_ns",
        "_running",
        "_sampled",
        "_send",
        "_slots",
        "_steady",
        "_store",
        "_syncs",
        "_type",
        "_values_of",
        "_waiting",
        "event_driven",
        "parameters",
    )

    def __init__(self, number: int, core: NodeCore) -> None:
        """Build it.

        Args:
            number: From 0: objects 1800 + number and 1A00 + number.
            core: The node's shared parts.
        """
        store = core.store
        self.parameters = PdoParameters(store, 0x1800 + number, pdo.allowed_for_tpdo, lambda: self._mapping.count)
        self._mapping = MappingObject(store, 0x1A00 + number, lambda: self.parameters.exists, inward=False)
        self._store = store
        self._send = core.send
        self._ready_ns = core.timing.sample_ns
        self._event_timer = core.timers.add(self._transmit_or_wait)
        self._inhibit_timer = core.timers.add(self._inhibit_passed)
        self._running = False
        self.reload()

    def reload(self) -> None:
        """Take over what the objects say now, and forget what was sampled and counted."""
        mapping = self._mapping.compile()
        self._codec = mapping.codec
        slots = tuple(entry.slot for entry in mapping.entries)
        self._values_of = _getter(slots)
        self._slots, self._places = slots, mapping.places
        sources = self._store.sources
        self._live: tuple[tuple[int, Source], ...] = tuple((slot, sources[slot]) for slot in slots if slot in sources)
        self._steady = tuple(slot for slot in slots if slot not in sources)
        self._cob_id = self.parameters.cob_id
        self._type = self.parameters.transmission_type
        self._inhibit_ns = self.parameters.inhibit_ns
        self._event_ns = self.parameters.event_ns
        self.event_driven = self._type == pdo.SYNC_ACYCLIC or self._type >= pdo.EVENT_MANUFACTURER
        self._syncs = 0
        self._sampled: bytes | None = None
        self._known: tuple[int, ...] | None = None
        self._waiting = False
        self._plan: TpdoPlan | None = None

    @property
    def active(self) -> bool:
        """Whether it exists and has something to carry."""
        return self.parameters.exists and self._codec.size > 0

    def start(self, at_ns: int) -> None:
        """The node became operational, or the PDO was made valid: one driven by events is sent once."""
        self._running = True
        if self._type >= pdo.EVENT_MANUFACTURER:
            self._transmit_or_wait(at_ns)

    def stop(self) -> None:
        """The node is operational no more."""
        self._running = False
        self._event_timer.cancel()
        self._inhibit_timer.cancel()
        self.reload()

    def sync(self, at_ns: int) -> None:
        """Do what the type says of a SYNC: nothing if it is not synchronous."""
        kind = self._type
        if pdo.SYNC_EVERY <= kind < pdo.SYNC_RTR:
            self._syncs += 1
            if self._syncs >= kind:
                self._syncs = 0
                self._transmit(at_ns)
        elif kind == pdo.SYNC_RTR:
            self._sampled = self._sample(at_ns)
        elif kind == pdo.SYNC_ACYCLIC and self._changed():
            self._transmit(at_ns)

    def remote(self, at_ns: int) -> None:
        """Answer a remote frame: with the last SYNC's sample if the type is synchronous, else with a new one."""
        if pdo.is_synchronous(self._type) and self._sampled is not None:
            self._send(Frame(self._cob_id, self._sampled), at_ns + self._ready_ns)
        else:
            self._transmit(at_ns)

    def check(self, at_ns: int) -> None:
        """Send it if it is driven by events and there is one."""
        if self._running and self._type >= pdo.EVENT_MANUFACTURER and not self._waiting and self._changed():
            self._transmit_or_wait(at_ns)

    def plan(self, sources: Mapping[int, int]) -> TpdoPlan | None:
        """How a steady cycle makes it; the same object until it is configured anew.

        Args:
            sources: What the objects are whose values change in a steady cycle, as its code names it, by slot.

        Returns:
            None unless it is sent with every so many SYNCs, and measures nothing else.
        """
        if self._plan is None and pdo.SYNC_EVERY <= self._type < pdo.SYNC_RTR:
            measured = self._store.sources
            kinds = [sources.get(slot, REFUSED if slot in measured else CONSTANT) for slot in self._slots]
            if REFUSED not in kinds:
                fields = tuple((kind, *place) for kind, place in zip(kinds, self._places, strict=True))
                self._plan = TpdoPlan((self._cob_id, self._codec.size, self._type), fields)
        return self._plan

    def lend(self) -> tuple[int, tuple[int, ...]]:
        """What a steady cycle goes on with: SYNCs since it was sent, and the values that the objects hold."""
        return self._syncs, self._values_of(self._store.values)

    def measure(self, number: int, at_ns: int) -> int:
        """The value now of one of the numbers that it carries, a measured one."""
        return self._store.sources[self._slots[number]](at_ns)

    def take_back(self, syncs: int, sampled: bytes | None) -> None:
        """Go on from where a steady cycle ended.

        Args:
            syncs: SYNCs since the last one with which it was sent.
            sampled: What was sent last; None if nothing was since `lend`.
        """
        self._syncs = syncs
        if sampled is not None:
            self._sampled = sampled

    def _changed(self) -> bool:
        values = self._store.values
        return self._known != tuple([values[slot] for slot in self._steady])

    def _transmit_or_wait(self, at_ns: int) -> None:
        if self._inhibit_timer.is_set:
            self._waiting = True
        else:
            self._transmit(at_ns)

    def _inhibit_passed(self, at_ns: int) -> None:
        if self._waiting:
            self._transmit(at_ns)

    def _transmit(self, at_ns: int) -> None:
        self._sampled = self._sample(at_ns)
        self._send(Frame(self._cob_id, self._sampled), at_ns + self._ready_ns)
        if self.event_driven:
            values = self._store.values
            self._known = tuple([values[slot] for slot in self._steady])
            self._waiting = False
            if self._type >= pdo.EVENT_MANUFACTURER:
                self._restart_timers(at_ns)

    def _restart_timers(self, at_ns: int) -> None:
        if self._event_ns:
            self._event_timer.arm(at_ns + self._event_ns)
        if self._inhibit_ns:
            self._inhibit_timer.arm(at_ns + self._inhibit_ns)

    def _sample(self, at_ns: int) -> bytes:
        values = self._store.values
        for slot, source in self._live:
            values[slot] = source(at_ns)
        return self._codec.pack(*self._values_of(values))


def _getter(slots: tuple[int, ...]) -> Callable[[list[int]], tuple[int, ...]]:
    """A function that takes the values at the slots out of a list, at the speed of C when there are several."""
    if len(slots) == 1:
        slot = slots[0]
        return lambda values: (values[slot],)
    return itemgetter(*slots) if slots else lambda _values: ()
