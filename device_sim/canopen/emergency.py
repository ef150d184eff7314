"""Emergencies: this node's own, with history and error register, and its siblings' (CiA 301, 7.2.7)."""

from collections import deque
from collections.abc import Callable, Hashable
from typing import Final

from torquerig.device_sim.canopen.core import NodeCore
from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.driver.wire import cob, emcy
from torquerig.driver.wire.emcy import Emergency, EmergencyCode
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort

ERROR_REGISTER: Final = 0x1001
HISTORY: Final = 0x1003
COB_ID: Final = 0x1014
INHIBIT_TIME: Final = 0x1015
CONSUMERS: Final = 0x1028
INHIBIT_UNIT: Final = 100_000  # [ns] of the times 1015 and 18xx:3
NO_INFORMATION: Final = bytes(emcy.MANUFACTURER_BYTES)
WAITING: Final = 32
"""So many emergencies at most wait for the inhibit time; then the oldest is dropped, for the newest says how it is."""


class EmergencyProducer:
    """Tells errors once when they come up, and 0x0000 when the last of them is gone.

    An error has a cause (any key, by default its code). Reported again while it is active, or with the code of another
    active cause, it is not told again.
    In NMT state stopped nothing is sent; the latest emergency follows when that state is left (CiA 301, 7.2.7.2).

    Attributes:
        dropped: Emergencies that were never told, because too many waited.
    """

    __slots__ = ("_active", "_entries", "_may_send", "_node_id", "_queue", "_send", "_store", "_timer", "dropped")

    def __init__(self, core: NodeCore, may_send: Callable[[], bool]) -> None:
        store = core.store
        self.dropped = 0
        self._node_id = core.node_id
        self._store = store
        self._send = core.send
        self._may_send = may_send
        self._active: dict[Hashable, int] = {}
        self._queue: deque[Emergency] = deque()
        self._timer = core.timers.add(self._inhibit_passed)
        self._entries = sum(1 for entry in store if entry.index == HISTORY and entry.subindex > 0)
        store.guard(self._guard_history, HISTORY)
        store.guard(guard_cob_id(store, COB_ID), COB_ID)
        for subindex in range(1, self._entries + 1):
            store.source(self._history_source(subindex), HISTORY, subindex)

    @property
    def register(self) -> int:
        """The error register, object 1001."""
        register = 0
        for code in self._active.values():
            register |= emcy.register_bits(code)
        return register

    def report(
        self, code: int, at_ns: int, *, cause: Hashable | None = None, information: bytes = NO_INFORMATION
    ) -> None:
        """An error came up.

        Args:
            code: Error code.
            at_ns: When.
            cause: What will tell that it is gone; the code itself when None.
            information: Five manufacturer bytes.
        """
        key = code if cause is None else cause
        known = code in self._active.values()
        self._active.setdefault(key, code)
        if not known:
            self._remember(code, information)
            self._publish(code, at_ns, information)

    def clear(self, cause: Hashable, at_ns: int) -> None:
        """An error is gone; when it was the last, an error-free emergency follows."""
        if self._active.pop(cause, None) is not None:
            self._after_clearing(at_ns)

    def clear_all(self, at_ns: int) -> None:
        """All errors are gone."""
        if self._active:
            self._active.clear()
            self._after_clearing(at_ns)

    def forget(self) -> None:
        """Power-on: no error, no history, nothing to send."""
        self._active.clear()
        self._store.set(0, HISTORY)
        self.restart()

    def restart(self) -> None:
        """Communication begins anew: nothing waits to be sent, the errors stay, and so does their history."""
        self._queue.clear()
        self._timer.cancel()
        self._store.set(self.register, ERROR_REGISTER)

    def release(self, at_ns: int) -> None:
        """NMT state stopped was left: what waited may go."""
        if self._queue and not self._timer.is_set:
            self._transmit(at_ns)

    def _after_clearing(self, at_ns: int) -> None:
        if self._active:
            self._store.set(self.register, ERROR_REGISTER)
        else:
            self._publish(EmergencyCode.NO_ERROR, at_ns, NO_INFORMATION)

    def _publish(self, code: int, at_ns: int, information: bytes) -> None:
        register = self.register
        self._store.set(register, ERROR_REGISTER)
        if not self._may_send():
            self._queue.clear()
        elif len(self._queue) == WAITING:
            self._queue.popleft()
            self.dropped += 1
        self._queue.append(Emergency(self._node_id, code, register, information))
        if self._may_send() and not self._timer.is_set:
            self._transmit(at_ns)

    def _transmit(self, at_ns: int) -> None:
        emergency = self._queue.popleft()
        entry = self._store.get(COB_ID)
        if cob.is_valid(entry):
            self._send(emcy.encode(emergency, cob_id=cob.identifier(entry)), at_ns)
        inhibit = self._store.get(INHIBIT_TIME)
        if inhibit:
            self._timer.arm(at_ns + inhibit * INHIBIT_UNIT)
        elif self._queue:
            self._transmit(at_ns)

    def _inhibit_passed(self, at_ns: int) -> None:
        if self._queue and self._may_send():
            self._transmit(at_ns)

    def _remember(self, code: int, information: bytes) -> None:
        """Enter the error into 1003, the latest first: code in the low half, two manufacturer bytes in the high."""
        count = min(self._store.get(HISTORY) + 1, self._entries)
        for subindex in range(count, 1, -1):
            self._store.set(self._store.get(HISTORY, subindex - 1), HISTORY, subindex)
        self._store.set(code | int.from_bytes(information[:2], "little") << 16, HISTORY, 1)
        self._store.set(count, HISTORY)

    def _history_source(self, subindex: int) -> Callable[[int], int]:
        def read(_at_ns: int) -> int:
            if subindex > self._store.get(HISTORY):
                raise SdoAbort(AbortCode.NO_DATA, HISTORY, subindex)
            return self._store.get(HISTORY, subindex)

        return read

    def _guard_history(self, subindex: int, value: int) -> None:
        """Only 0 can be written, and clears the history (CiA 301, 7.5.2.4)."""
        if value:
            raise SdoAbort(AbortCode.INVALID_VALUE, HISTORY, subindex)


class EmergencyConsumer:
    """Hears the emergencies of the nodes in 1028.

    Attributes:
        producers: Node-ids of the nodes it hears.
        malformed: Frames on their identifiers that are no emergency.
    """

    __slots__ = ("_by_cob_id", "_hear", "_store", "malformed", "producers")

    def __init__(self, store: ObjectStore, hear: Callable[[Emergency, int], None]) -> None:
        self._store = store
        self._hear = hear
        self._by_cob_id: dict[int, int] = {}
        self.producers: frozenset[int] = frozenset()
        self.malformed = 0
        store.guard(guard_cob_id(store, CONSUMERS), CONSUMERS)

    @property
    def cob_ids(self) -> tuple[int, ...]:
        """The identifiers it listens to."""
        return tuple(self._by_cob_id)

    def reload(self) -> None:
        """Take over the entries of 1028."""
        self._by_cob_id = {}
        for entry in self._store:
            if entry.index == CONSUMERS and entry.subindex > 0:
                value = self._store.values[entry.slot]
                can_id = cob.identifier(value)
                if cob.is_valid(value) and can_id:
                    producer = can_id - cob.EMCY
                    self._by_cob_id[can_id] = producer if producer in cob.NODE_IDS else entry.subindex
        self.producers = frozenset(self._by_cob_id.values())

    def receive(self, frame: Frame, at_ns: int) -> None:
        """Hear an emergency on one of `cob_ids`."""
        emergency = emcy.decode_payload(self._by_cob_id[frame.can_id], frame.data)
        if emergency is None:
            self.malformed += 1
        else:
            self._hear(emergency, at_ns)


def guard_cob_id(store: ObjectStore, index: int) -> Callable[[int, int], None]:
    """A guard for the COB-ID entries of an object: the rules of CiA 301, 7.5.2.15 and 7.5.2.35.

    11-bit identifiers only; none that is restricted; and while an object exists its identifier does not change.
    """

    def guard(subindex: int, value: int) -> None:
        if not cob.is_valid(value):
            return
        present = store.get(index, subindex)
        changes = cob.is_valid(present) and cob.identifier(present) != cob.identifier(value)
        if changes or value & cob.EXTENDED or cob.is_restricted(cob.identifier(value)):
            raise SdoAbort(AbortCode.INVALID_VALUE, index, subindex)

    return guard
