"""Heartbeats: this node's own (object 1017) and those it watches (object 1016); CiA 301, 7.2.8.3.2."""

from collections.abc import Callable
from typing import Final, Protocol

from torquerig.device_sim.canopen.core import NodeCore
from torquerig.device_sim.canopen.timers import Timers
from torquerig.driver.wire import cob, nmt
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.nmt import NmtState
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort

MS: Final = 1_000_000  # [ns]
CONSUMER_TIME: Final = 0x1016
PRODUCER_TIME: Final = 0x1017
_OPERATIONAL: Final = bytes([NmtState.OPERATIONAL])


class HeartbeatProducer:
    """Sends the node's state every 1017 ms, the boot-up message being the first (CiA 301, 7.3.2.2.1).

    Attributes:
        timer: The alarm of the next one.
    """

    __slots__ = ("_node_id", "_send", "_slot", "_state", "_store", "timer")

    def __init__(self, core: NodeCore, state: Callable[[], NmtState]) -> None:
        self._node_id = core.node_id
        self._store = core.store
        self._send = core.send
        self._state = state
        self._slot = core.store.slot(PRODUCER_TIME)
        self.timer = core.timers.add(self._beat)
        core.store.watch(lambda at_ns, _: self.start(at_ns), PRODUCER_TIME)

    @property
    def enabled(self) -> bool:
        """Whether the node produces heartbeats, which excludes that it is guarded."""
        return self._store.values[self._slot] > 0

    def start(self, at_ns: int) -> None:
        """Begin a period now, by the object's present value; 0 ends the heartbeat."""
        period_ms = self._store.values[self._slot]
        if period_ms:
            self.timer.arm(at_ns + period_ms * MS)
        else:
            self.timer.cancel()

    def stop(self) -> None:
        """Send no heartbeat until `start`."""
        self.timer.cancel()

    def _beat(self, at_ns: int) -> None:
        self._send(nmt.encode_heartbeat(self._node_id, self._state()), at_ns)
        self.start(at_ns)


class HeartbeatObserver(Protocol):
    """Whoever has to know how the watched nodes fare."""

    def heartbeat_lost(self, producer: int, at_ns: int) -> None:
        """A node that was heard has been silent for its time."""
        ...

    def heartbeat_back(self, producer: int, at_ns: int) -> None:
        """A node is heard that was lost, or is no longer watched."""
        ...

    def producer_left_operational(self, at_ns: int) -> None:
        """A watched node says that it is operational no more."""
        ...


class _Watch:
    """One entry of 1016."""

    __slots__ = ("lost", "producer", "state", "timeout_ns", "timer")

    def __init__(self, timers: Timers, expire: "Callable[[_Watch, int], None]") -> None:
        self.producer = 0  # node-id; 0: not in use
        self.timeout_ns = 0
        self.state: NmtState | None = None  # None: not heard yet
        self.lost = False
        self.timer = timers.add(lambda at_ns: expire(self, at_ns))


class HeartbeatConsumer:
    """Watches other nodes, each from its first heartbeat on (CiA 301, 7.2.8.3.2.2).

    Attributes:
        malformed: Heartbeats of watched nodes that are none.
    """

    __slots__ = ("_by_cob_id", "_observer", "_store", "_watches", "malformed")

    def __init__(self, core: NodeCore, observer: HeartbeatObserver) -> None:
        store, timers = core.store, core.timers
        self._store = store
        self._observer = observer
        self.malformed = 0
        subindices = sorted(e.subindex for e in store if e.index == CONSUMER_TIME and e.subindex > 0)
        self._watches = {subindex: _Watch(timers, self._expire) for subindex in subindices}
        self._by_cob_id: dict[int, _Watch] = {}
        store.guard(self._guard, CONSUMER_TIME)
        store.watch(lambda at_ns, _: self.reload(at_ns), CONSUMER_TIME)

    @property
    def cob_ids(self) -> tuple[int, ...]:
        """The identifiers it listens to."""
        return tuple(self._by_cob_id)

    def reload(self, at_ns: int) -> None:
        """Take over the entries of 1016; one that changed waits for a first heartbeat again."""
        for subindex, watch in self._watches.items():
            producer, timeout_ns = _split(self._store.get(CONSUMER_TIME, subindex))
            if (producer, timeout_ns) != (watch.producer, watch.timeout_ns):
                self._forget(watch, at_ns)
                watch.producer, watch.timeout_ns = producer, timeout_ns
        self._by_cob_id = {cob.HEARTBEAT + w.producer: w for w in self._watches.values() if w.producer}

    def reset(self, at_ns: int) -> None:
        """Wait for a first heartbeat of every entry again."""
        for watch in self._watches.values():
            self._forget(watch, at_ns)
        self.reload(at_ns)

    def is_no_news(self, frame: Frame) -> bool:
        """Whether a frame on one of `cob_ids` says of a node that was there that it still is, and operational."""
        watch = self._by_cob_id[frame.can_id]
        return frame.data == _OPERATIONAL and watch.state is NmtState.OPERATIONAL and not watch.lost

    def receive(self, frame: Frame, at_ns: int) -> None:
        """Hear a heartbeat on one of `cob_ids`."""
        heartbeat = nmt.decode_heartbeat(frame)
        if heartbeat is None:
            self.malformed += 1
            return
        watch = self._by_cob_id[frame.can_id]
        left = watch.state is NmtState.OPERATIONAL and heartbeat.state is not NmtState.OPERATIONAL
        watch.state = heartbeat.state
        watch.timer.arm(at_ns + watch.timeout_ns)
        if watch.lost:
            watch.lost = False
            self._observer.heartbeat_back(watch.producer, at_ns)
        if left:
            self._observer.producer_left_operational(at_ns)

    def _expire(self, watch: _Watch, at_ns: int) -> None:
        watch.state = None
        watch.lost = True
        self._observer.heartbeat_lost(watch.producer, at_ns)

    def _forget(self, watch: _Watch, at_ns: int) -> None:
        watch.timer.cancel()
        watch.state = None
        if watch.lost:
            watch.lost = False
            self._observer.heartbeat_back(watch.producer, at_ns)

    def _guard(self, subindex: int, value: int) -> None:
        """A node must not be watched by two entries (CiA 301, 7.5.2.17: 0604 0043)."""
        producer, _ = _split(value)
        others = (_split(self._store.get(CONSUMER_TIME, other))[0] for other in self._watches if other != subindex)
        if producer and producer in others:
            raise SdoAbort(AbortCode.PARAMETER_INCOMPATIBLE, CONSUMER_TIME, subindex)


def _split(entry: int) -> tuple[int, int]:
    """Node-id and time [ns] of an entry; (0, 0) when either says that it is not in use."""
    producer, timeout_ms = entry >> 16 & 0xFF, entry & 0xFFFF
    return (producer, timeout_ms * MS) if timeout_ms and producer in cob.NODE_IDS else (0, 0)
