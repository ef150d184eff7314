"""A CANopen slave: the services of CiA 301 around one object dictionary, and the application behind it."""

from collections.abc import Callable, Iterable, Mapping
from typing import Final

import canopen

from torquerig.device_sim.canopen import emergency as emergencies
from torquerig.device_sim.canopen import heartbeat as heartbeats
from torquerig.device_sim.canopen import sync as syncs
from torquerig.device_sim.canopen.application import Application, CommunicationEvent
from torquerig.device_sim.canopen.core import NodeCore, NodeTiming
from torquerig.device_sim.canopen.emergency import EmergencyConsumer, EmergencyProducer
from torquerig.device_sim.canopen.error_control import ErrorControl
from torquerig.device_sim.canopen.nmt import NmtSlave
from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.device_sim.canopen.pdo import ProcessData
from torquerig.device_sim.canopen.refusals import refusals_of
from torquerig.device_sim.canopen.sdo_server import SdoServer
from torquerig.device_sim.canopen.storage import Storage
from torquerig.device_sim.canopen.sync import SyncConsumer
from torquerig.device_sim.canopen.timers import Timers
from torquerig.device_sim.devices import Emission
from torquerig.driver.wire import cob, nmt
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.nmt import NmtCommand, NmtState

_COMMUNICATION: Final = (range(0x1000, emergencies.HISTORY), range(emergencies.HISTORY + 1, 0x2000))  # history stays
_APPLICATION: Final = range(0x2000, 0x10000)
_PDO_OBJECTS: Final = range(0x1400, 0x1C00)

Listener = Callable[[Frame, int], None]


class CanopenNode:
    """One node on the bus; satisfies devices.OpenNode.

    Attributes:
        node_id: CANopen node-id.
        timers: Its alarms.
        store: Its objects.
        emergency: Its emergencies.
        nmt: Its NMT state.
        sync: Its view of SYNC.
        pdos: Its process data.
        storage: What it remembers without power.
        error_control: Its heartbeat, and those that it watches.
        listeners: What hears which identifier now: always this object, changed in place.
        shares_identifiers: Whether two of its services hear the same identifier now.
        refused: Frames for a service that the NMT state does not allow.
        ignored: Remote and extended frames that mean nothing to a CANopen node, or to this one.
    """

    def __init__(
        self,
        node_id: int,
        dictionary: canopen.ObjectDictionary,
        application: "Callable[[CanopenNode], Application]",
        *,
        timing: NodeTiming | None = None,
        volatile: Iterable[int] = (),
        power_on_ns: int = 0,
    ) -> None:
        """Build the node; it is switched on at its first event.

        Args:
            node_id: CANopen node-id, 1 to 127.
            dictionary: Its object dictionary, $NODEID worked out.
            application: Builds the device behind it, once the node has its objects and services.
            timing: How long it takes.
            volatile: Indices of application objects that 1010 does not store.
            power_on_ns: When it is switched on, and says its boot-up message [ns].
        """
        self._timing = timing or NodeTiming()
        self.node_id = cob.check_node_id(node_id)
        self._outbox: list[Emission] = []
        self._cold = True
        self.refused = 0
        self.ignored = 0
        self.timers = Timers(power_on_ns)
        self.store = ObjectStore(dictionary, self.timers, reaction_ns=self._timing.reaction_ns)
        self.nmt = NmtSlave(node_id, self)
        self.storage = Storage(self.store, volatile)
        self.listeners: dict[int, Listener] = {}
        self.shares_identifiers = False
        self._build_services(application)
        self._remotes: Mapping[int, Callable[[int], None]] = {}
        self._boot_timer = self.timers.add(self._boot)
        self._boot_timer.arm(power_on_ns)

    def _build_services(self, application: "Callable[[CanopenNode], Application]") -> None:
        store = self.store
        core = NodeCore(self.node_id, store, self.timers, self._send, self._timing)
        self.emergency = EmergencyProducer(core, self._may_send_emergency)
        self.sync = SyncConsumer(store, self.emergency)
        self.pdos = ProcessData(core, self.emergency, self.sync, self._rpdo_missing)
        self._sdo = SdoServer(store, size_of=store.size_of)
        self._sdo_timer = self.timers.add(lambda at_ns: self._answer_sdo(self._sdo.overdue(), at_ns))
        self._application = application(self)
        self._siblings = EmergencyConsumer(store, self._application.hear_emergency)
        self.error_control = ErrorControl(core, self.nmt, self.emergency, self._application, self._siblings)
        self._refusals = refusals_of(self, self._sdo, self.error_control, self._siblings)
        pdo_objects = {entry.index for entry in store}.intersection(_PDO_OBJECTS)
        store.watch(self._reconfigured, syncs.COB_ID, heartbeats.CONSUMER_TIME, emergencies.CONSUMERS, *pdo_objects)

    def next_event_ns(self) -> int:
        """When something happens next without a frame."""
        return self.timers.next_ns

    def show_next_event(self, board: list[int], place: int) -> None:
        """From now on keep the time of the next event in `board[place]`."""
        self.timers.show_next(board, place)

    def advance(self, to_ns: int) -> None:
        """Let everything happen that is due at or before the time."""
        timers = self.timers
        while timers.next_ns <= to_ns:
            timers.ring()
            if self.pdos.eventful:
                self.pdos.check(timers.now_ns)

    def receive(self, frame: Frame, at_ns: int) -> None:
        """Hear a frame; any frame is legal, and one that means nothing to this node changes nothing."""
        timers = self.timers
        if timers.next_ns <= at_ns:
            self.advance(at_ns)
        timers.now_ns = at_ns
        if frame.remote or frame.extended:
            self._receive_remote(frame, at_ns)
            return
        listener = self.listeners.get(frame.can_id)
        if listener is not None:
            listener(frame, at_ns)
            if self.pdos.eventful:
                self.pdos.check(at_ns)

    def take(self) -> list[Emission]:
        """What the node wants to send since it was last asked."""
        outbox = self._outbox
        if outbox:
            self._outbox = []
        return outbox

    def power_cycle(self, at_ns: int) -> None:
        """Switch the device off and on again; only what was stored stays."""
        self.advance(at_ns)
        self._application.handle_event(CommunicationEvent.POWER_LOST, at_ns)
        self._outbox = []
        self._initialise(at_ns, cold=True)

    def counters(self) -> Mapping[str, int]:
        """What was refused, ignored or malformed since the node was built; object 2140."""
        return self._refusals.counts()

    def nmt_state_changes(self, state: NmtState, at_ns: int) -> None:
        """The state is about to be entered."""
        if state is not NmtState.OPERATIONAL:
            self._application.handle_event(CommunicationEvent.LEFT_OPERATIONAL, at_ns)

    def nmt_state_changed(self, at_ns: int) -> None:
        """The state was entered."""
        state = self.nmt.state
        self._rebuild()
        if state is NmtState.STOPPED:
            self._sdo.reset()
        else:
            self.emergency.release(at_ns)
        if state is NmtState.OPERATIONAL:
            self.pdos.start(at_ns)
        else:
            self.pdos.stop()

    def nmt_resets(self, command: NmtCommand, at_ns: int) -> None:
        """A reset was commanded."""
        self._application.handle_event(CommunicationEvent.LEFT_OPERATIONAL, at_ns)
        self._initialise(at_ns + self._timing.boot_ns, cold=command is NmtCommand.RESET_NODE)

    def _rpdo_missing(self, at_ns: int) -> None:
        self._application.handle_event(CommunicationEvent.RPDO_MISSING, at_ns)

    def _may_send_emergency(self) -> bool:
        return self.nmt.state in {NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL}

    def _initialise(self, until_ns: int, *, cold: bool) -> None:
        """Enter NMT initialisation, in which the node hears and says nothing."""
        self.nmt.state = NmtState.BOOT_UP
        self._cold = self._cold or cold
        if cold:
            self.timers.clear()
        self.pdos.stop()
        self.pdos.unwatch()
        self.error_control.stop(self.timers.now_ns)
        self.emergency.restart()
        self._sdo.reset()
        self._rebuild()
        self._boot_timer.arm(until_ns)

    def _boot(self, at_ns: int) -> None:
        """Leave initialisation: power-on values, boot-up message, pre-operational."""
        saved = self.storage.saved
        for indices in _COMMUNICATION:
            self.store.restore(indices, saved)
        if self._cold:
            self.store.restore(_APPLICATION, saved)
            self.emergency.forget()
        self.emergency.restart()
        self.sync.reset()
        self._siblings.reload()
        if self._cold:
            self._cold = False
            self._application.power_on(at_ns)
        self.pdos.stop()
        self.nmt.state = NmtState.PRE_OPERATIONAL
        self._send(nmt.encode_heartbeat(self.node_id, NmtState.BOOT_UP), at_ns)
        self.error_control.start(at_ns)
        self._rebuild()
        self.emergency.release(at_ns)

    def _send(self, frame: Frame, ready_ns: int) -> None:
        self._outbox.append(Emission(ready_ns, self.node_id, frame))

    def _reconfigured(self, at_ns: int, _effect_ns: int) -> None:
        self.error_control.consumer.reload(at_ns)
        self._siblings.reload()
        self._rebuild()

    def _rebuild(self) -> None:
        """Make the table of who hears which identifier in this NMT state."""
        state, listeners = self.nmt.state, self.listeners
        listeners.clear()
        self.shares_identifiers = False
        self._remotes = {}
        if state is NmtState.BOOT_UP:
            return
        talks, operates = state is not NmtState.STOPPED, state is NmtState.OPERATIONAL
        self._enlist(cob.NMT, self.nmt.receive)
        self._enlist(cob.SDO_REQUEST + self.node_id, self._serve_sdo if talks else self._refuse)
        for can_id in self.error_control.consumer.cob_ids:
            self._enlist(can_id, self.error_control.consumer.receive)
        for can_id, hearers in self.pdos.listeners().items():
            for hear in hearers if operates else (self._refuse,):
                self._enlist(can_id, hear)
        if talks:
            self._enlist(self.sync.cob_id, self._synchronise)
            for can_id in self._siblings.cob_ids:
                self._enlist(can_id, self._siblings.receive)
        remotes = self.pdos.remotes() if operates else {}
        self._remotes = {**remotes, cob.HEARTBEAT + self.node_id: self.error_control.request}

    def _enlist(self, can_id: int, listener: Listener) -> None:
        """Add a listener; two on one identifier both hear it."""
        present = self.listeners.get(can_id)
        if present is None:
            self.listeners[can_id] = listener
            return

        def both(frame: Frame, at_ns: int) -> None:
            present(frame, at_ns)
            listener(frame, at_ns)

        self.shares_identifiers = True
        self.listeners[can_id] = both

    def _receive_remote(self, frame: Frame, at_ns: int) -> None:
        answer = None if frame.extended else self._remotes.get(frame.can_id)
        if answer is None:
            self.ignored += 1
        else:
            answer(at_ns)

    def _refuse(self, _frame: Frame, _at_ns: int) -> None:
        self.refused += 1

    def _serve_sdo(self, frame: Frame, at_ns: int) -> None:
        self._answer_sdo(self._sdo.handle(frame.data), at_ns)

    def _answer_sdo(self, response: bytes | None, at_ns: int) -> None:
        if response is not None:
            for message in (response, *self._sdo.pending):
                self._send(Frame(cob.SDO_RESPONSE + self.node_id, message), at_ns + self._timing.answer_ns)
        if self._sdo.receiving:
            self._sdo_timer.arm(at_ns + self._timing.sdo_patience_ns)
        else:
            self._sdo_timer.cancel()

    def _synchronise(self, frame: Frame, at_ns: int) -> None:
        if self.sync.accept(frame, at_ns):
            self._application.synchronise(at_ns)
            if self.nmt.state is NmtState.OPERATIONAL:
                self.pdos.sync(at_ns)
