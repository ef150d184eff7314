"""Node guarding and life guarding, the elder error control (CiA 301, 7.2.8.3.2.1)."""

from collections.abc import Callable
from typing import Final, Protocol

from torquerig.device_sim.canopen.core import NodeCore
from torquerig.device_sim.canopen.heartbeat import MS
from torquerig.driver.wire import nmt
from torquerig.driver.wire.nmt import NmtState

GUARD_TIME: Final = 0x100C
LIFE_TIME_FACTOR: Final = 0x100D


class GuardingObserver(Protocol):
    """Whoever has to know whether the guarding master is there."""

    def guarding_lost(self, at_ns: int) -> None:
        """The master has not asked for the life time (life guarding event)."""
        ...

    def guarding_back(self, at_ns: int) -> None:
        """The master asks again."""
        ...


class NodeGuarding:
    """Answers the guarding master, and notices when it is gone.

    The node's life is guarded from the first request on, for guard time (100C) times life-time factor (100D).
    """

    __slots__ = ("_core", "_lost", "_observer", "_state", "_timer", "_toggle")

    def __init__(self, core: NodeCore, state: Callable[[], NmtState], observer: GuardingObserver) -> None:
        self._core = core
        self._state = state
        self._observer = observer
        self._toggle = False
        self._lost = False
        self._timer = core.timers.add(self._expire)

    def reset(self) -> None:
        """Begin as after boot-up: toggle bit 0, not guarded."""
        self._toggle = False
        self._lost = False
        self._timer.cancel()

    def request(self, at_ns: int) -> None:
        """Hear the remote frame on the node's error control identifier."""
        core = self._core
        answer = nmt.encode_heartbeat(core.node_id, self._state(), toggle=self._toggle)
        core.send(answer, at_ns + core.timing.answer_ns)
        self._toggle = not self._toggle
        life_ns = core.store.get(GUARD_TIME) * core.store.get(LIFE_TIME_FACTOR) * MS
        if life_ns:
            self._timer.arm(at_ns + life_ns)
        if self._lost:
            self._lost = False
            self._observer.guarding_back(at_ns)

    def _expire(self, at_ns: int) -> None:
        self._lost = True
        self._observer.guarding_lost(at_ns)
