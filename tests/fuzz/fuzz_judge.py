"""What must hold of a simulated drive whatever it hears, judged from outside: by the wire, its torque and its counters.

Torque. A motor may be told a torque only in NMT operational, in a state that CiA 402 gives power, and only if a
controlword 'shutdown' and after it 'enable operation' came over the wire since the drive was last disabled. The judge
reads the bits by the standard, and none of the project's state tables.

Refusals. A frame that a node listens to and that is wrong, or comes when it must not, leaves a trace: an answer, or a
counter that has moved.
"""

import math
from collections.abc import Iterator
from struct import unpack_from
from typing import Final

from torquerig.device_sim.canopen.node import CanopenNode
from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.nmt import NmtState

PEAK_TORQUE: Final = 0.98  # [N·m], where the drive's current loop saturates
_STATUSWORD: Final = 0x6041
_CONTROLWORD: Final = 0x6040
_STATE_MASK: Final = 0x6F
_POWERED: Final = frozenset({0x27, 0x07, 0x2F, 0x0F})  # operation enabled, quick stop active, fault reaction active
_RPDOS: Final = range(4)
_DISABLED, _SHUT_DOWN, _ENABLED = range(3)
_COMMANDS: Final = frozenset({0x01, 0x02, 0x80, 0x81, 0x82})


class EnablingWitness:
    """Watches one drive's frames for the sequence without which there must be no torque.

    Attributes:
        authorised: The sequence was seen since the drive was last disabled.
    """

    def __init__(self, node: CanopenNode) -> None:
        self._node = node
        self._stage = _DISABLED
        self._waiting: dict[int, list[int]] = {}  # controlwords of RPDOs that act at the next SYNC
        self._segments = False  # a transfer to the controlword has begun

    @property
    def authorised(self) -> bool:
        """Whether the sequence was seen since the drive was last disabled."""
        return self._stage == _ENABLED

    def hear(self, frame: Frame) -> None:
        """Take a frame, before the drive does."""
        self._look()
        if frame.remote or frame.extended:
            return
        store = self._node.store
        if frame.can_id == cob.SDO_REQUEST + self._node.node_id:
            self._hear_sdo(frame.data)
        for number in _RPDOS:
            entry = store.get(0x1400 + number, 1)
            if not entry & cob.INVALID and entry & 0x7FF == frame.can_id:
                words = list(self._controlwords(number, frame.data))
                if store.get(0x1400 + number, 2) <= 240:
                    self._waiting[number] = words
                self._take(words)
        if frame.can_id == store.get(0x1005) & 0x7FF:
            for words in self._waiting.values():
                self._take(words)
            self._waiting.clear()

    def _look(self) -> None:
        """Begin anew when the drive says that it is disabled, or in fault, or not ready."""
        status = self._node.store.get(_STATUSWORD)
        if status & 0x4F in {0x40, 0x08, 0x00}:
            self._stage = _DISABLED

    def _take(self, words: list[int]) -> None:
        for word in words:
            if word & 0x07 == 0x06 and self._stage == _DISABLED:
                self._stage = _SHUT_DOWN
            if word & 0x0F == 0x0F and self._stage == _SHUT_DOWN:
                self._stage = _ENABLED

    def _controlwords(self, number: int, data: bytes) -> Iterator[int]:
        store, place = self._node.store, 0
        for subindex in range(1, store.get(0x1600 + number) + 1):
            entry = store.get(0x1600 + number, subindex)
            if entry == _CONTROLWORD << 16 | 16 and len(data) >= place + 2:
                yield unpack_from("<H", data, place)[0]
            place += (entry & 0xFF) // 8

    def _hear_sdo(self, data: bytes) -> None:
        if len(data) != 8:
            return
        if self._segments:
            self._take([unpack_from("<H", data, 1)[0]])
        kind, (index, subindex) = data[0] >> 5, unpack_from("<HB", data, 1)
        if (index, subindex) != (_CONTROLWORD, 0):
            return
        if kind == 1 and data[0] & 2:
            self._take([unpack_from("<H", data, 4)[0]])
        elif kind in {1, 6}:
            self._segments = True


class TorqueJudge:
    """Refuses a torque that must not be."""

    def __init__(self, node: CanopenNode) -> None:
        self._node = node
        self.witness = EnablingWitness(node)

    def check(self, torque: float) -> None:
        """Let the drive tell its motor a torque [N·m]."""
        assert math.isfinite(torque), torque
        assert abs(torque) <= PEAK_TORQUE + 1e-9, f"{torque} N·m is more than the current loop can give"
        if not torque:
            return
        where = f"drive {self._node.node_id} gives {torque:.4f} N·m"
        assert self._node.nmt.state is NmtState.OPERATIONAL, f"{where} in NMT {self._node.nmt.state.name}"
        assert self.witness.authorised, f"{where}, and the enable sequence was not on the wire"

    def settle(self, torque: float) -> None:
        """Judge the torque that stands after a frame or an event, when the statusword is up to date."""
        status = self._node.store.get(_STATUSWORD)
        if torque:
            self.check(torque)
            assert status & _STATE_MASK in _POWERED, f"{torque:.4f} N·m at statusword {status:#06x}"


def unaccounted(node: CanopenNode, frame: Frame, state: NmtState) -> str | None:
    """What a node owed a trace of, if it neither answered nor counted a frame; None when it owed none.

    Args:
        node: The node, after the frame.
        frame: What it heard.
        state: Its NMT state when it heard it.
    """
    if frame.remote or frame.extended:
        return "a remote or extended frame"
    if state is NmtState.BOOT_UP:
        return None
    if frame.can_id == cob.NMT:
        return None if _is_nmt_command(frame.data) else "an NMT command that is none"
    if frame.can_id == cob.SDO_REQUEST + node.node_id:
        return _unaccounted_sdo(frame.data, state)
    if frame.can_id == node.sync.cob_id and state is not NmtState.STOPPED:
        return "a SYNC of wrong length" if len(frame.data) > 1 else None
    return _unaccounted_rpdo(node, frame, state)


def _is_nmt_command(data: bytes) -> bool:
    return len(data) == 2 and data[0] in _COMMANDS and data[1] <= cob.NODE_IDS[-1]


def _unaccounted_sdo(data: bytes, state: NmtState) -> str | None:
    if state is NmtState.STOPPED:
        return "an SDO request in NMT stopped"
    if len(data) != 8:
        return "an SDO request that has not 8 bytes"
    specifier, subcommand = data[0] >> 5, data[0] & 3
    ends = specifier == 4 or (specifier, subcommand) == (5, 1)  # an abort; the end of a block upload
    return None if ends else "an SDO request"


def _unaccounted_rpdo(node: CanopenNode, frame: Frame, state: NmtState) -> str | None:
    for rpdo in node.pdos.rpdos:
        if rpdo.active and rpdo.parameters.cob_id == frame.can_id:
            if state is not NmtState.OPERATIONAL:
                return "an RPDO outside of NMT operational"
            if not frame.data:
                return "an empty RPDO"
    return None
