"""Network management: commands, states, boot-up, heartbeat and guarding (CiA 301, 7.2.8 and 7.3.2)."""

from collections.abc import Mapping
from enum import IntEnum
from types import MappingProxyType
from typing import Final, NamedTuple

from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Frame

_TOGGLE: Final = 0x80


class NmtCommand(IntEnum):
    """Command specifiers of the NMT protocol."""

    START = 1
    STOP = 2
    PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class NmtState(IntEnum):
    """NMT states as heartbeats carry them."""

    BOOT_UP = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 0x7F


# CiA 301, NMT state diagram; a pair that is not here changes nothing. (1) power on enters initialisation and (2) its
# end enters pre-operational, both by themselves: BOOT_UP is the only state that a command never leaves.
TRANSITIONS: Final[Mapping[tuple[NmtState, NmtCommand], NmtState]] = MappingProxyType(
    {
        (NmtState.PRE_OPERATIONAL, NmtCommand.START): NmtState.OPERATIONAL,  # (3)
        (NmtState.OPERATIONAL, NmtCommand.PRE_OPERATIONAL): NmtState.PRE_OPERATIONAL,  # (4)
        (NmtState.PRE_OPERATIONAL, NmtCommand.STOP): NmtState.STOPPED,  # (5)
        (NmtState.STOPPED, NmtCommand.START): NmtState.OPERATIONAL,  # (6)
        (NmtState.STOPPED, NmtCommand.PRE_OPERATIONAL): NmtState.PRE_OPERATIONAL,  # (7)
        (NmtState.OPERATIONAL, NmtCommand.STOP): NmtState.STOPPED,  # (8)
        (NmtState.OPERATIONAL, NmtCommand.RESET_NODE): NmtState.BOOT_UP,  # (9) to (11)
        (NmtState.STOPPED, NmtCommand.RESET_NODE): NmtState.BOOT_UP,
        (NmtState.PRE_OPERATIONAL, NmtCommand.RESET_NODE): NmtState.BOOT_UP,
        (NmtState.OPERATIONAL, NmtCommand.RESET_COMMUNICATION): NmtState.BOOT_UP,  # (12) to (14)
        (NmtState.STOPPED, NmtCommand.RESET_COMMUNICATION): NmtState.BOOT_UP,
        (NmtState.PRE_OPERATIONAL, NmtCommand.RESET_COMMUNICATION): NmtState.BOOT_UP,
    }
)


class Heartbeat(NamedTuple):
    """An error control message: boot-up, heartbeat, or the answer to a guarding request.

    Attributes:
        node_id: Who sent it.
        state: Its NMT state; BOOT_UP in the boot-up message.
        toggle: Bit 7, which alternates in guarding and is clear in heartbeats.
    """

    node_id: int
    state: NmtState
    toggle: bool


def encode_command(command: NmtCommand, node_id: int) -> Frame:
    """The NMT command to one node, or to all (node-id 0).

    Raises:
        ValueError: The command is none, or the node-id is not 0 to 127.
    """
    if node_id != cob.ALL_NODES:
        cob.check_node_id(node_id)
    return Frame(cob.NMT, bytes((NmtCommand(command), node_id)))


def decode_command(frame: Frame) -> tuple[NmtCommand, int] | None:
    """The command and the node-id it is for (0: all), or None when this is no well-formed NMT command."""
    if frame.can_id != cob.NMT or frame.remote or frame.extended or len(frame.data) != 2:
        return None
    command, node_id = frame.data
    if command not in _COMMANDS or node_id not in _ADDRESSEES:
        return None
    return _COMMANDS[command], node_id


def encode_heartbeat(node_id: int, state: NmtState, *, toggle: bool = False) -> Frame:
    """The error control message of a node: state BOOT_UP makes it the boot-up message.

    Raises:
        ValueError: The node-id is not 1 to 127, or the state is none.
    """
    return Frame(cob.HEARTBEAT + cob.check_node_id(node_id), bytes((NmtState(state) | _TOGGLE * toggle,)))


def decode_heartbeat(frame: Frame) -> Heartbeat | None:
    """The error control message in a frame, or None when it is none or malformed."""
    node_id = frame.can_id - cob.HEARTBEAT
    if node_id not in cob.NODE_IDS or frame.remote or frame.extended or len(frame.data) != 1:
        return None
    state = _STATES.get(frame.data[0] & ~_TOGGLE)
    return None if state is None else Heartbeat(node_id, state, bool(frame.data[0] & _TOGGLE))


def encode_guard_request(node_id: int) -> Frame:
    """The remote frame that asks a node for its state (node guarding).

    Raises:
        ValueError: The node-id is not 1 to 127.
    """
    return Frame(cob.HEARTBEAT + cob.check_node_id(node_id), bytes(1), remote=True)


def decode_guard_request(frame: Frame) -> int | None:
    """The node-id that is asked for its state, or None when this is no guarding request."""
    node_id = frame.can_id - cob.HEARTBEAT
    return node_id if frame.remote and not frame.extended and node_id in cob.NODE_IDS else None


_COMMANDS: Final = {int(command): command for command in NmtCommand}
_STATES: Final = {int(state): state for state in NmtState}
_ADDRESSEES: Final = range(cob.NODE_IDS.stop)
