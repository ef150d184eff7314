"""The messages of CANopen's services, which every node has: NMT, SYNC, EMCY, SDO, heartbeat (CiA 301)."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final, NamedTuple

from torquerig.driver.wire import cob, emcy, nmt
from torquerig.driver.wire.emcy import EmergencyCode
from torquerig.driver.wire.sdo_abort import AbortCode, describe
from torquerig.exports.dbc import Message, Signal

MASTER: Final = "Master"

NMT_STATES: Final = MappingProxyType({int(state): state.name.lower().replace("_", "-") for state in nmt.NmtState})
NMT_COMMANDS: Final = MappingProxyType({int(each): each.name.lower().replace("_", "-") for each in nmt.NmtCommand})
ERROR_CODES: Final = MappingProxyType({int(code): emcy.describe(code) for code in EmergencyCode})

_ABORT_CODES: Final = MappingProxyType({int(code): describe(code) for code in AbortCode})
_ABORT: Final = 4


class _Direction(NamedTuple):
    """Messages of one direction of an SDO, told apart by bits 5 to 7 of the first byte (CiA 301, 7.2.4.3).

    Attributes:
        words: What each specifier is.
        naming: Specifiers of messages that name an object.
        carrying: The one of them with a value.
    """

    words: Mapping[int, str]
    naming: tuple[int, ...]
    carrying: int


_REQUEST: Final = _Direction(
    {
        0: "download segment",
        1: "initiate download",
        2: "initiate upload",
        3: "upload segment",
        _ABORT: "abort",
        5: "block upload",
        6: "block download",
        7: "reserved",
    },
    naming=(1, 2, _ABORT),
    carrying=1,
)
_RESPONSE: Final = _Direction(
    {
        0: "upload segment",
        1: "download segment",
        2: "initiate upload",
        3: "initiate download",
        _ABORT: "abort",
        5: "block download",
        6: "block upload",
        7: "reserved",
    },
    naming=(2, 3, _ABORT),
    carrying=2,
)


def drive_name(node_id: int) -> str:
    """What a drive is called as a node of a DBC."""
    return f"Drive{node_id}"


def common_messages(drives: Sequence[str]) -> tuple[Message, ...]:
    """NMT and SYNC, which the master sends to all.

    Args:
        drives: Names of the drives.
    """
    receivers = tuple(drives)
    command = Signal("Command", 0, 8, choices=NMT_COMMANDS)
    addressee = Signal("Node_id", 8, 8, comment="For whom; 0: all", raw_limits=(0, 127))
    return (
        Message(cob.NMT, "NMT", 2, MASTER, receivers, (command, addressee), "Network management command"),
        Message(cob.SYNC, "SYNC", 0, MASTER, receivers, comment="Begin of a cycle: drives sample, and answer"),
    )


def heartbeat_message(node_id: int, sender: str, receivers: Sequence[str]) -> Message:
    """Boot-up, heartbeat, and the answer to guarding (CiA 301, 7.2.8.3)."""
    state = Signal("NMT_state", 0, 7, choices=NMT_STATES)
    toggle = Signal("Toggle", 7, 1, comment="Alternates in answers to guarding, 0 in heartbeats")
    comment = "Boot-up, heartbeat, or the answer to guarding"
    return Message(
        cob.HEARTBEAT + node_id, f"{sender}_heartbeat", 1, sender, tuple(receivers), (state, toggle), comment
    )


def drive_services(node_id: int, others: Sequence[str]) -> tuple[Message, ...]:
    """EMCY, SDO and heartbeat of one drive.

    Args:
        node_id: The drive.
        others: Names of the other drives, which listen too.
    """
    return node_services(node_id, drive_name(node_id), others)


def node_services(node_id: int, name: str, others: Sequence[str] = ()) -> tuple[Message, ...]:
    """EMCY, SDO and heartbeat of any node.

    Args:
        node_id: The node.
        name: What it is called.
        others: Who listens beside the master.
    """
    emergency = (
        Signal("Error_code", 0, 16, choices=ERROR_CODES),
        Signal("Error_register", 16, 8, comment="Object 1001: bit 0 any error, then a bit a kind"),
        Signal("Manufacturer", 24, 40, comment="Five bytes at the maker's discretion"),
    )
    everyone = (MASTER, *others)
    return (
        Message(cob.EMCY + node_id, f"{name}_EMCY", 8, name, everyone, emergency, "An error came or went"),
        _sdo(_REQUEST, cob.SDO_REQUEST + node_id, f"{name}_SDO_request", MASTER, name),
        _sdo(_RESPONSE, cob.SDO_RESPONSE + node_id, f"{name}_SDO_response", name, MASTER),
        heartbeat_message(node_id, name, everyone),
    )


def _sdo(direction: _Direction, can_id: int, name: str, sender: str, receiver: str) -> Message:
    """One direction of the SDO of a drive."""
    rest = tuple(specifier for specifier in direction.words if specifier not in direction.naming)
    signals = (
        Signal("Specifier", 5, 3, choices=direction.words, selects=True),
        Signal("Index", 8, 16, selected_by=direction.naming),
        Signal("Subindex", 24, 8, selected_by=direction.naming),
        Signal("Data", 32, 32, comment="Value if expedited, else length", selected_by=(direction.carrying,)),
        Signal("Abort_code", 32, 32, choices=_ABORT_CODES, selected_by=(_ABORT,)),
        Signal("Bytes_1_to_7", 8, 56, comment="Of a segment or a block transfer", selected_by=rest),
    )
    comment = "Object dictionary access; the data inside a block transfer cannot be told from other messages"
    return Message(can_id, name, 8, sender, (receiver,), signals, comment)
