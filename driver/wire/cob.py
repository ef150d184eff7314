"""COB-IDs: the pre-defined connection set, and what the other bits of a COB-ID entry say (CiA 301, 7.3.5 and 7.5.2)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

NMT: Final = 0x000
SYNC: Final = 0x080
EMCY: Final = 0x080  # + node-id, like all that follow
TPDO: Final[Mapping[int, int]] = MappingProxyType({1: 0x180, 2: 0x280, 3: 0x380, 4: 0x480})
RPDO: Final[Mapping[int, int]] = MappingProxyType({1: 0x200, 2: 0x300, 3: 0x400, 4: 0x500})
SDO_RESPONSE: Final = 0x580
SDO_REQUEST: Final = 0x600
HEARTBEAT: Final = 0x700

GROUP_RPDO: Final = 0x200  # no node has id 0, so its RPDO1 identifier is free for a PDO that all drives share

NODE_IDS: Final = range(1, 128)
ALL_NODES: Final = 0

# bits of a COB-ID entry (1005, 1014, 1016.., 14xx:1, 18xx:1) above the identifier
INVALID: Final = 1 << 31  # PDO, SDO, EMCY: does not exist; SYNC: do not care
NO_RTR: Final = 1 << 30  # TPDO: must not be asked for by a remote frame; SYNC: this node generates it
EXTENDED: Final = 1 << 29  # the identifier has 29 bits
ID_MASK: Final = 0x7FF

# CiA 301, table "Restricted CAN-IDs": no configurable object may use them
_RESTRICTED: Final = (
    range(0x001),  # NMT
    range(0x001, 0x080),
    range(0x101, 0x181),
    range(0x581, 0x600),  # default SDO, server to client
    range(0x601, 0x680),  # default SDO, client to server
    range(0x6E0, 0x700),
    range(0x701, 0x780),  # error control
    range(0x780, 0x800),
)


def is_restricted(can_id: int) -> bool:
    """Whether no PDO, SYNC or EMCY may be configured to this 11-bit identifier (CiA 301, restricted CAN-IDs)."""
    return any(can_id in block for block in _RESTRICTED)


def is_valid(entry: int) -> bool:
    """Whether the COB-ID entry of a PDO or EMCY says that the object exists (bit 31 clear)."""
    return not entry & INVALID


def identifier(entry: int) -> int:
    """The 11-bit identifier in a COB-ID entry."""
    return entry & ID_MASK


def check_node_id(node_id: int) -> int:
    """The node-id itself.

    Raises:
        ValueError: It is not 1 to 127.
    """
    if node_id not in NODE_IDS:
        raise ValueError(f"a CANopen node-id is 1 to 127, not {node_id}")
    return node_id
