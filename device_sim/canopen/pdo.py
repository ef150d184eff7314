"""All PDOs of a node: which listen, and what SYNC and NMT mean to them."""

from collections.abc import Callable, Mapping
from typing import Final

from torquerig.device_sim.canopen.core import NodeCore
from torquerig.device_sim.canopen.emergency import EmergencyProducer
from torquerig.device_sim.canopen.rpdo import Rpdo
from torquerig.device_sim.canopen.sync import SyncConsumer
from torquerig.device_sim.canopen.timers import Timer
from torquerig.device_sim.canopen.tpdo import Tpdo
from torquerig.driver.wire import pdo
from torquerig.driver.wire.frame import Frame

_RPDO_PARAMETERS: Final = range(0x1400, 0x1600)
_TPDO_PARAMETERS: Final = range(0x1800, 0x1A00)


class ProcessData:
    """The PDOs that the dictionary has communication objects for.

    Attributes:
        rpdos: What the node receives, by number from 0.
        tpdos: What it sends, by number from 0.
        eventful: The active TPDOs that are driven by events.
        too_late: Synchronous RPDOs that came after the window 1007 had closed, and were dropped.
    """

    __slots__ = (
        "_active",
        "_cyclic",
        "_ready_ns",
        "_running",
        "_sync",
        "_synchronous",
        "eventful",
        "rpdos",
        "too_late",
        "tpdos",
    )

    def __init__(
        self, core: NodeCore, emergency: EmergencyProducer, sync: SyncConsumer, missed: Callable[[int], None]
    ) -> None:
        """Build them.

        Args:
            core: The node's shared parts.
            emergency: Is told of wrong lengths.
            sync: Knows the synchronous window.
            missed: Called when a watched RPDO's deadline passes.
        """
        store = core.store
        indices = {entry.index for entry in store}
        self._sync = sync
        self._ready_ns = core.timing.sample_ns
        self._running = False
        self.too_late = 0
        self.rpdos = tuple(
            Rpdo(index - _RPDO_PARAMETERS.start, core, emergency, missed)
            for index in sorted(indices.intersection(_RPDO_PARAMETERS))
        )
        self.tpdos = tuple(
            Tpdo(index - _TPDO_PARAMETERS.start, core) for index in sorted(indices.intersection(_TPDO_PARAMETERS))
        )
        self._sort()
        for number, rpdo in enumerate(self.rpdos):
            store.watch(self._rpdo_changed(rpdo), 0x1400 + number, 0x1600 + number)
        for number, tpdo in enumerate(self.tpdos):
            store.watch(self._tpdo_changed(tpdo), 0x1800 + number, 0x1A00 + number)

    def listeners(self) -> Mapping[int, tuple[Callable[[Frame, int], None], ...]]:
        """Who hears which identifier."""
        listeners: dict[int, tuple[Callable[[Frame, int], None], ...]] = {}
        for rpdo in self.rpdos:
            if rpdo.active:
                can_id = rpdo.parameters.cob_id
                hear = self._windowed(rpdo) if rpdo.synchronous else rpdo.receive
                listeners[can_id] = (*listeners.get(can_id, ()), hear)
        return listeners

    def remotes(self) -> Mapping[int, Callable[[int], None]]:
        """Who answers a remote frame of which identifier."""
        return {
            tpdo.parameters.cob_id: tpdo.remote for tpdo in self.tpdos if tpdo.active and tpdo.parameters.remote_allowed
        }

    def start(self, at_ns: int) -> None:
        """The node has become operational."""
        self._running = True
        for tpdo in self.tpdos:
            if tpdo.active:
                tpdo.start(at_ns)

    def stop(self) -> None:
        """The node is operational no more."""
        self._running = False
        for tpdo in self.tpdos:
            tpdo.stop()
        for rpdo in self.rpdos:
            rpdo.reload()
        self._sort()

    def sync(self, at_ns: int) -> None:
        """Sample and send what SYNC asks for, then let the data received since the last one take effect."""
        if not self._sync.window_closed(at_ns + self._ready_ns):
            for tpdo in self._cyclic:
                tpdo.sync(at_ns)
        for rpdo in self._synchronous:
            rpdo.sync(at_ns)

    @property
    def plain(self) -> tuple[tuple[Rpdo, ...], tuple[Tpdo, ...]] | None:
        """What hears, and what SYNC has sent, if that is all: None if there is more to be heeded."""
        return None if self.eventful or self._synchronous else (self._active, self._cyclic)

    @property
    def deadlines(self) -> list[Timer]:
        """The alarms of the active RPDOs."""
        return [rpdo.deadline for rpdo in self._active]

    def check(self, at_ns: int) -> None:
        """Send what is driven by events, if there was one."""
        for tpdo in self.eventful:
            tpdo.check(at_ns)

    def watch(self, from_ns: int) -> None:
        """Watch the deadlines of all RPDOs that have one."""
        for rpdo in self.rpdos:
            rpdo.watch(from_ns)

    def unwatch(self) -> None:
        """Watch no deadlines."""
        for rpdo in self.rpdos:
            rpdo.unwatch()

    def _sort(self) -> None:
        active = [tpdo for tpdo in self.tpdos if tpdo.active]
        self._cyclic = tuple(t for t in active if pdo.is_synchronous(t.parameters.transmission_type))
        self.eventful = tuple(t for t in active if t.event_driven)
        self._active = tuple(rpdo for rpdo in self.rpdos if rpdo.active)
        self._synchronous = tuple(rpdo for rpdo in self._active if rpdo.synchronous)

    def _windowed(self, rpdo: Rpdo) -> Callable[[Frame, int], None]:
        def hear(frame: Frame, at_ns: int) -> None:
            if self._sync.window_closed(at_ns):
                self.too_late += 1
            else:
                rpdo.receive(frame, at_ns)

        return hear

    def _rpdo_changed(self, rpdo: Rpdo) -> Callable[[int, int], None]:
        def renew(at_ns: int, _effect_ns: int) -> None:
            rpdo.renew(at_ns)
            self._sort()

        return renew

    def _tpdo_changed(self, tpdo: Tpdo) -> Callable[[int, int], None]:
        def renew(at_ns: int, _effect_ns: int) -> None:
            tpdo.stop()
            self._sort()
            if self._running and tpdo.active:
                tpdo.start(at_ns)

        return renew
