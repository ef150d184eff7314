"""What the drive does when communication fails: nothing re-enables by itself, and torque is zero in that tick."""

from typing import Final, Protocol

from torquerig.device_sim.canopen.application import CommunicationEvent
from torquerig.device_sim.canopen.node import CanopenNode
from torquerig.device_sim.drive import objects
from torquerig.driver.wire.emcy import Emergency, EmergencyCode

COMMUNICATION: Final = 0x8100  # CiA 301's generic code: the NMT state was left on command
_UNHARMFUL: Final = frozenset(
    {EmergencyCode.NO_ERROR, EmergencyCode.SIBLING_STOP}
)  # else drives would latch each other
_NOTHING, _FAULT, _DISABLE, _QUICK_STOP = range(4)  # abort connection option codes, 6007


class Reactions(Protocol):
    """What the watchdogs can make the drive do."""

    @property
    def energised(self) -> bool:
        """Whether the drive may give torque now."""
        ...

    def fail(self, code: int, at_ns: int) -> None:
        """Torque 0 now, EMCY, fault."""
        ...

    def disable(self, at_ns: int) -> None:
        """Torque 0 now, switch on disabled."""
        ...

    def quick_stop(self, at_ns: int) -> None:
        """Quick stop as 605A says."""
        ...


class Watchdogs:
    """Watches RPDOs, SYNC and siblings in operation enabled, and knows what follows from what is lost.

    Attributes:
        sync_loss: The alarm for missing SYNCs.
    """

    __slots__ = ("_missed", "_multiple", "_node", "_reactions", "_store", "_values", "_watching", "sync_loss")

    def __init__(self, node: CanopenNode, reactions: Reactions) -> None:
        self._node = node
        self._store = node.store
        self._values = node.store.values
        self._reactions = reactions
        self._watching = False
        self._multiple = node.store.slot(*objects.SYNC_LOSS_MULTIPLE)
        self._missed = node.store.slot(*objects.MISSED_SYNCS)
        self.sync_loss = node.timers.add(lambda at_ns: reactions.fail(EmergencyCode.SYNC_LOST, at_ns))

    def start(self, at_ns: int) -> None:
        """Operation was enabled: RPDOs are due from now on, SYNC from the first one on."""
        self._watching = True
        self._node.pdos.watch(at_ns)

    def stop(self) -> None:
        """Operation is enabled no more."""
        self._watching = False
        self._node.pdos.unwatch()
        self.sync_loss.cancel()

    def synchronise(self, at_ns: int, previous_ns: int | None) -> None:
        """A SYNC came.

        Args:
            at_ns: When [ns].
            previous_ns: When the one before it came, None for the first since boot-up [ns].
        """
        period_ns = self._node.sync.period_ns
        if not period_ns:
            self.sync_loss.cancel()
            return
        if previous_ns is not None and at_ns - previous_ns > period_ns:
            missed = self._values[self._missed] + round((at_ns - previous_ns) / period_ns) - 1
            self._values[self._missed] = min(missed, 0xFFFFFFFF)
        if self._watching:
            multiple = self._values[self._multiple]
            if multiple:
                self.sync_loss.arm(at_ns + multiple * period_ns + 1)  # more than: one just in time is in time
            else:
                self.sync_loss.cancel()

    def lend(self) -> tuple[int, int, int, int]:
        """What a steady cycle goes on with (`steady_memory.WATCHDOGS`)."""
        values = self._values
        return self._node.sync.period_ns, values[self._multiple], values[self._missed], self.sync_loss.due_ns

    def take_back(self, missed: int, sync_deadline_ns: int) -> None:
        """Go on from where a steady cycle ended."""
        self._values[self._missed] = missed
        self.sync_loss.arm(sync_deadline_ns)

    def handle_event(self, event: CommunicationEvent, at_ns: int) -> None:
        """Do what follows from a loss; nothing unless the drive may give torque."""
        reactions = self._reactions
        if not reactions.energised:
            return
        if event is CommunicationEvent.POWER_LOST:
            reactions.disable(at_ns)
        elif event is CommunicationEvent.RPDO_MISSING:
            reactions.fail(EmergencyCode.RPDO_TIMEOUT, at_ns)
        elif event is CommunicationEvent.SIBLING_LEFT:
            self._stop_with_sibling(at_ns)
        elif event is CommunicationEvent.LEFT_OPERATIONAL:
            self._abort_connection(COMMUNICATION, at_ns)
            if reactions.energised:
                reactions.disable(at_ns)  # whatever 6007 says, there is no torque outside NMT operational
        else:
            self._abort_connection(EmergencyCode.HEARTBEAT_LOST, at_ns)
            if event is CommunicationEvent.SIBLING_LOST:
                self._stop_with_sibling(at_ns)

    def hear_emergency(self, emergency: Emergency, at_ns: int) -> None:
        """A sibling told an emergency: a redundant mechanism is never driven by a subset of its drives."""
        if emergency.code not in _UNHARMFUL:
            self._stop_with_sibling(at_ns)

    def _stop_with_sibling(self, at_ns: int) -> None:
        if self._watching and self._store.get(*objects.SIBLING_STOP):
            self._reactions.fail(EmergencyCode.SIBLING_STOP, at_ns)

    def _abort_connection(self, code: int, at_ns: int) -> None:
        option = self._store.get(objects.ABORT_CONNECTION_OPTION)
        if option == _FAULT:
            self._reactions.fail(code, at_ns)
        elif option == _DISABLE:
            self._reactions.disable(at_ns)
        elif option == _QUICK_STOP:
            self._reactions.quick_stop(at_ns)
