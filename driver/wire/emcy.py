"""Emergency messages (CiA 301, 7.2.7; CiA 402, error codes)."""

from collections.abc import Mapping
from enum import IntEnum
from struct import Struct
from types import MappingProxyType
from typing import Final, NamedTuple

from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Frame

_PAYLOAD: Final = Struct("<HB5s")
MANUFACTURER_BYTES: Final = 5


class EmergencyCode(IntEnum):
    """The codes our drive sends (object 603F holds the last of them)."""

    NO_ERROR = 0x0000
    OVERCURRENT = 0x2310
    I2T = 0x2350
    DC_OVERVOLTAGE = 0x3210
    DC_UNDERVOLTAGE = 0x3220
    DEVICE_TEMPERATURE = 0x4210
    DRIVE_TEMPERATURE = 0x4310
    ENCODER = 0x7305
    OVERSPEED = 0x7310
    CAN_OVERRUN = 0x8110
    CAN_ERROR_PASSIVE = 0x8120
    HEARTBEAT_LOST = 0x8130
    BUS_OFF_RECOVERED = 0x8140
    CAN_ID_COLLISION = 0x8150
    PDO_TOO_SHORT = 0x8210
    PDO_TOO_LONG = 0x8220
    SYNC_LENGTH = 0x8240
    RPDO_TIMEOUT = 0x8250
    SYNC_LOST = 0x8700
    SIBLING_STOP = 0xFF01


class ErrorRegister(IntEnum):
    """Bits of the error register, object 1001."""

    GENERIC = 1 << 0
    CURRENT = 1 << 1
    VOLTAGE = 1 << 2
    TEMPERATURE = 1 << 3
    COMMUNICATION = 1 << 4
    PROFILE = 1 << 5
    MANUFACTURER = 1 << 7


class Emergency(NamedTuple):
    """An emergency message.

    Attributes:
        node_id: Who sent it.
        code: Error code, 0 when the last error is gone; any 16-bit number may come from foreign drives.
        register: Error register, object 1001.
        manufacturer: Five bytes at the maker's discretion.
    """

    node_id: int
    code: int
    register: int
    manufacturer: bytes = bytes(MANUFACTURER_BYTES)


# (mask, pattern, words) from the most to the least specific: CiA 301's table of error code classes, CiA 402's codes
_WORDS: Final = (
    (0xFFFF, 0x0000, "no error, or the error is gone"),
    (0xFFFF, 0x2310, "continuous overcurrent at the output"),
    (0xFFFF, 0x2320, "short circuit or earth leakage at the output"),
    (0xFFFF, 0x2350, "overload: I2t"),
    (0xFFFF, 0x3210, "DC link overvoltage"),
    (0xFFFF, 0x3220, "DC link undervoltage"),
    (0xFFFF, 0x4210, "device over-temperature"),
    (0xFFFF, 0x4310, "drive over-temperature"),
    (0xFFFF, 0x7305, "encoder fault"),
    (0xFFFF, 0x7310, "overspeed"),
    (0xFFFF, 0x8110, "CAN overrun: objects lost"),
    (0xFFFF, 0x8120, "CAN error passive"),
    (0xFFFF, 0x8130, "heartbeat or life guarding lost"),
    (0xFFFF, 0x8140, "recovered from bus-off"),
    (0xFFFF, 0x8150, "CAN identifier collision"),
    (0xFFFF, 0x8210, "PDO too short, not processed"),
    (0xFFFF, 0x8220, "PDO longer than its mapping"),
    (0xFFFF, 0x8230, "destination of a multiplexed PDO not available"),
    (0xFFFF, 0x8240, "unexpected SYNC length"),
    (0xFFFF, 0x8250, "RPDO timeout"),
    (0xFFFF, 0x8611, "following error"),
    (0xFFFF, 0x8700, "SYNC lost"),
    (0xFFFF, 0xFF01, "stopped because a sibling drive stopped"),
    (0xFF00, 0x2100, "current at the device's input"),
    (0xFF00, 0x2200, "current inside the device"),
    (0xFF00, 0x2300, "current at the device's output"),
    (0xFF00, 0x3100, "mains voltage"),
    (0xFF00, 0x3200, "voltage inside the device"),
    (0xFF00, 0x3300, "output voltage"),
    (0xFF00, 0x4100, "ambient temperature"),
    (0xFF00, 0x4200, "device temperature"),
    (0xFF00, 0x4300, "drive temperature"),
    (0xFF00, 0x6100, "internal software"),
    (0xFF00, 0x6200, "user software"),
    (0xFF00, 0x6300, "data set"),
    (0xFF00, 0x7300, "sensor"),
    (0xFF00, 0x8100, "communication"),
    (0xFF00, 0x8200, "protocol error"),
    (0xFF00, 0xFF00, "device-specific error"),
    (0xF000, 0x0000, "error reset"),
    (0xF000, 0x1000, "generic error"),
    (0xF000, 0x2000, "current"),
    (0xF000, 0x3000, "voltage"),
    (0xF000, 0x4000, "temperature"),
    (0xF000, 0x5000, "device hardware"),
    (0xF000, 0x6000, "device software"),
    (0xF000, 0x7000, "additional modules"),
    (0xF000, 0x8000, "monitoring"),
    (0xF000, 0x9000, "external error"),
    (0xF000, 0xF000, "additional functions"),
)

# what a killed controller or a broken wire leaves behind, and the siblings' stop that follows from it
_COMMUNICATION: Final = (
    (0xFF00, 0x8100),
    (0xFF00, 0x8200),
    (0xFFFF, EmergencyCode.SYNC_LOST),
    (0xFFFF, EmergencyCode.SIBLING_STOP),
)


def encode(emergency: Emergency, *, cob_id: int | None = None) -> Frame:
    """The emergency as a frame.

    Args:
        emergency: What to send.
        cob_id: Identifier out of 1014; None for the pre-defined 0x80 + node-id.

    Raises:
        ValueError: A field is out of its range.
    """
    cob.check_node_id(emergency.node_id)
    if not 0 <= emergency.code <= 0xFFFF:
        raise ValueError(f"an emergency code has 16 bits, {emergency.code} has not")
    if not 0 <= emergency.register <= 0xFF:
        raise ValueError(f"an error register has 8 bits, {emergency.register} has not")
    if len(emergency.manufacturer) != MANUFACTURER_BYTES:
        raise ValueError(f"an emergency carries 5 manufacturer bytes, not {len(emergency.manufacturer)}")
    can_id = cob.EMCY + emergency.node_id if cob_id is None else cob_id
    return Frame(can_id, _PAYLOAD.pack(emergency.code, emergency.register, emergency.manufacturer))


def decode(frame: Frame) -> Emergency | None:
    """The emergency in a frame on its pre-defined identifier, or None when it is none or malformed."""
    node_id = frame.can_id - cob.EMCY
    if node_id not in cob.NODE_IDS or frame.remote or frame.extended:
        return None
    return decode_payload(node_id, frame.data)


def decode_payload(node_id: int, data: bytes) -> Emergency | None:
    """The emergency in the data of a node's EMCY object, whatever its identifier; None when it has not 8 bytes."""
    if len(data) != _PAYLOAD.size:
        return None
    return Emergency(node_id, *_PAYLOAD.unpack(data))


def describe(code: int) -> str:
    """The code in words, as specific as the standards are: "overspeed", or only "additional modules"."""
    return next(
        (words for mask, pattern, words in _WORDS if code & mask == pattern),
        "unknown error",
    )


def is_communication(code: int) -> bool:
    """Whether the code tells of lost communication rather than of the drive: 81xx, 82xx, 8700, and FF01 after them."""
    return any(code & mask == pattern for mask, pattern in _COMMUNICATION)


_REGISTER_BITS: Final[Mapping[int, ErrorRegister]] = MappingProxyType(
    {
        0x2000: ErrorRegister.CURRENT,
        0x3000: ErrorRegister.VOLTAGE,
        0x4000: ErrorRegister.TEMPERATURE,
        0x8000: ErrorRegister.COMMUNICATION,
        0xF000: ErrorRegister.MANUFACTURER,
    }
)


def register_bits(code: int) -> int:
    """The error register that goes with an active error: bit 0 (generic) and the bit of the code's class."""
    if code == EmergencyCode.NO_ERROR:
        return 0
    return ErrorRegister.GENERIC | _REGISTER_BITS.get(code & 0xF000, ErrorRegister.PROFILE)
