"""Who is still there: heartbeats and guarding together, and what their loss does to the node (CiA 301, 7.2.8.3.2)."""

from typing import Final

from torquerig.device_sim.canopen.application import Application, CommunicationEvent
from torquerig.device_sim.canopen.core import NodeCore
from torquerig.device_sim.canopen.emergency import EmergencyConsumer, EmergencyProducer
from torquerig.device_sim.canopen.guarding import NodeGuarding
from torquerig.device_sim.canopen.heartbeat import HeartbeatConsumer, HeartbeatProducer
from torquerig.device_sim.canopen.nmt import NmtSlave
from torquerig.driver.wire.emcy import EmergencyCode
from torquerig.driver.wire.nmt import NmtState

ERROR_BEHAVIOUR: Final = 0x1029
_ERROR_STATES: Final = {0: NmtState.PRE_OPERATIONAL, 2: NmtState.STOPPED}  # 1029:1; 1 changes nothing
_GUARDING: Final = "life guarding"  # a cause of emergencies


class ErrorControl:
    """The node's own heartbeat, the heartbeats it watches, and guarding, which works only without an own heartbeat.

    A loss is told by EMCY 0x8130 and to the application, and changes the NMT state as 1029:1 says.

    Attributes:
        producer: The node's own heartbeat.
        consumer: The watched heartbeats.
        unanswered: Guarding requests while the node produces heartbeats.
    """

    def __init__(
        self,
        core: NodeCore,
        slave: NmtSlave,
        emergency: EmergencyProducer,
        application: Application,
        siblings: EmergencyConsumer,
    ) -> None:
        self._store = core.store
        self._slave = slave
        self._emergency = emergency
        self._application = application
        self._siblings = siblings
        self.producer = HeartbeatProducer(core, self._state)
        self.consumer = HeartbeatConsumer(core, self)
        self._guarding = NodeGuarding(core, self._state, self)
        self.unanswered = 0

    def start(self, at_ns: int) -> None:
        """The boot-up message goes out now: the heartbeat's first period begins."""
        self.producer.start(at_ns)
        self.consumer.reload(at_ns)

    def stop(self, at_ns: int) -> None:
        """The node initialises: nothing is sent or watched."""
        self.producer.stop()
        self.consumer.reset(at_ns)
        self._guarding.reset()

    def request(self, at_ns: int) -> None:
        """Hear the remote frame on the node's error control identifier."""
        if self.producer.enabled:
            self.unanswered += 1
        else:
            self._guarding.request(at_ns)

    def heartbeat_lost(self, producer: int, at_ns: int) -> None:
        """A watched node is silent."""
        self._emergency.report(EmergencyCode.HEARTBEAT_LOST, at_ns, cause=(EmergencyCode.HEARTBEAT_LOST, producer))
        sibling = producer in self._siblings.producers
        self._lost(CommunicationEvent.SIBLING_LOST if sibling else CommunicationEvent.HEARTBEAT_LOST, at_ns)

    def heartbeat_back(self, producer: int, at_ns: int) -> None:
        """A watched node is heard again, or no longer watched."""
        self._emergency.clear((EmergencyCode.HEARTBEAT_LOST, producer), at_ns)

    def producer_left_operational(self, at_ns: int) -> None:
        """A watched node is operational no more."""
        self._application.handle_event(CommunicationEvent.SIBLING_LEFT, at_ns)

    def guarding_lost(self, at_ns: int) -> None:
        """The guarding master is silent."""
        self._emergency.report(EmergencyCode.HEARTBEAT_LOST, at_ns, cause=_GUARDING)
        self._lost(CommunicationEvent.LIFE_GUARDING_LOST, at_ns)

    def guarding_back(self, at_ns: int) -> None:
        """The guarding master asks again."""
        self._emergency.clear(_GUARDING, at_ns)

    def _lost(self, event: CommunicationEvent, at_ns: int) -> None:
        self._application.handle_event(event, at_ns)
        state = _ERROR_STATES.get(self._store.get(ERROR_BEHAVIOUR, 1))
        if state is NmtState.STOPPED or (state is not None and self._slave.state is NmtState.OPERATIONAL):
            self._slave.enter(state, at_ns)

    def _state(self) -> NmtState:
        return self._slave.state
