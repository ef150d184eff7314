"""What the master listens for besides its cycle: emergencies, heartbeats, slower process data, and other masters."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from torquerig.driver.master.axis import Axis
from torquerig.driver.master.profile import PdoMapping
from torquerig.driver.master.pump import Pump, heartbeat_cob
from torquerig.driver.wire import cob, emcy, nmt
from torquerig.driver.wire.cia402 import DriveState
from torquerig.driver.wire.emcy import Emergency, EmergencyCode
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.nmt import NmtState

_REMEMBERED: Final = 64  # emergencies kept for the report
_TROUBLES: Final = 16  # more are not told: what came first is the cause


class TroubleKind(Enum):
    """Why a group must stop."""

    FAULT = auto()  # a drive left 'operation enabled', or sent an emergency
    SILENT = auto()  # a drive does not answer SYNC any more
    MASTER = auto()  # somebody else commands


@dataclass(frozen=True, slots=True)
class Trouble:
    """Something that must stop the group.

    Attributes:
        kind: Of what kind.
        node_id: Which drive; 0 for none of them.
        words: What happened, to follow the drive's name.
    """

    kind: TroubleKind
    node_id: int
    words: str


class Watch:
    """Listens; what happens while it is armed is trouble.

    Attributes:
        armed: Whether all drives are to be enabled now.
        troubles: What happened, oldest first; the reader clears it.
        emergencies: The last emergencies heard.
        nmt_states: The last NMT state heard of each node.
        left: Drives that left NMT operational since `expect_operational`, and how they told.
        foreign: How another master was heard, None while there is none.
    """

    def __init__(self, pump: Pump, axes: Sequence[Axis], master_id: int) -> None:
        self.armed = False
        self.troubles: list[Trouble] = []
        self.emergencies: deque[Emergency] = deque(maxlen=_REMEMBERED)
        self.nmt_states: dict[int, NmtState] = {}
        self.left: dict[int, str] = {}
        self.foreign: str | None = None
        self._counts = pump.counts
        for axis in axes:
            pump.handlers[cob.EMCY + axis.node_id] = self._emergency_handler(axis)
            pump.handlers[heartbeat_cob(axis.node_id)] = self._heartbeat_handler(axis)
            for mapping in axis.settings.profile.tpdos[1:]:
                pump.handlers[cob.TPDO[mapping.number] + axis.node_id] = self._monitor_handler(axis, mapping)
            pump.handlers[axis.rpdo_cob] = self.master_handler(f"it commands drive {axis.node_id}")
        pump.handlers[cob.SYNC] = self.master_handler("it sends SYNC")
        pump.handlers[heartbeat_cob(master_id)] = self.master_handler(f"it sends our heartbeat, node-id {master_id}")

    def expect_operational(self) -> None:
        """Drives have been started: from now on note who leaves NMT operational, enabled or not."""
        self.nmt_states.clear()
        self.left.clear()

    def report(self, kind: TroubleKind, node_id: int, words: str) -> None:
        """Note trouble, unless nobody is enabled; each once, and no more than a person will read."""
        if not self.armed:
            return
        trouble = Trouble(kind, node_id, words)
        has_room = len(self.troubles) < _TROUBLES or kind is TroubleKind.MASTER
        if has_room and trouble not in self.troubles:
            self.troubles.append(trouble)

    def report_state(self, axis: Axis) -> None:
        """Note that a drive changed its state."""
        if self.armed and axis.state is not DriveState.OPERATION_ENABLED:
            self.report(TroubleKind.FAULT, axis.node_id, f"went to {axis.state_words}")

    def _emergency_handler(self, axis: Axis) -> Callable[[int, bytes], None]:
        def hear(_at_ns: int, data: bytes) -> None:
            emergency = emcy.decode_payload(axis.node_id, data)
            if emergency is None:
                self._counts.malformed += 1
                return
            self.emergencies.append(emergency)
            axis.emergency = emergency if emergency.code else None
            if emergency.code == EmergencyCode.HEARTBEAT_LOST:  # which ends NMT operational (1029:1)
                self.left.setdefault(axis.node_id, describe_code(emergency.code))
            if emergency.code:
                self.report(TroubleKind.FAULT, axis.node_id, describe_code(emergency.code))

        return hear

    def _heartbeat_handler(self, axis: Axis) -> Callable[[int, bytes], None]:
        def hear(_at_ns: int, data: bytes) -> None:
            heartbeat = nmt.decode_heartbeat(Frame(heartbeat_cob(axis.node_id), data))
            if heartbeat is None:
                self._counts.malformed += 1
                return
            before = self.nmt_states.get(axis.node_id)
            self.nmt_states[axis.node_id] = heartbeat.state
            if heartbeat.state is NmtState.OPERATIONAL:
                return
            state = heartbeat.state.name.lower().replace("_", "-")
            is_restart = heartbeat.state is NmtState.BOOT_UP
            if is_restart or before is NmtState.OPERATIONAL:  # a first heartbeat may be older than the start
                self.left.setdefault(axis.node_id, "restarted" if is_restart else f"is {state}")
            words = "restarted" if is_restart else f"left NMT operational: it is {state}"
            self.report(TroubleKind.FAULT, axis.node_id, words)

        return hear

    def _monitor_handler(self, axis: Axis, mapping: PdoMapping) -> Callable[[int, bytes], None]:
        layout = axis.objects.layout(mapping.objects)

        def hear(_at_ns: int, data: bytes) -> None:
            values = layout.unpack(data)
            if values is None:
                self._counts.malformed += 1
            else:
                axis.monitored.update(zip(mapping.objects, values, strict=True))

        return hear

    def master_handler(self, words: str) -> Callable[[int, bytes], None]:
        """Who takes a frame that only a master sends, and says how it was heard."""

        def hear(_at_ns: int, _data: bytes) -> None:
            self.foreign = words
            self.report(TroubleKind.MASTER, 0, words)

        return hear


def tell(troubles: Sequence[Trouble]) -> str:
    """What happened, each only once, in one sentence; empty when nothing did."""
    return "; ".join(dict.fromkeys(f"drive {trouble.node_id} {trouble.words}" for trouble in troubles))


def describe_code(code: int) -> str:
    """An error code in words and figures: "overspeed (0x7310)"."""
    return f"{emcy.describe(code)} (0x{code:04X})"
