"""Why an SDO transfer ends early: the abort codes of CiA 301 and the exception that carries one."""

from enum import IntEnum
from typing import Final

from torquerig.driver.errors import TorqueRigError


class AbortCode(IntEnum):
    """All abort codes of CiA 301."""

    TOGGLE = 0x05030000
    TIMEOUT = 0x05040000
    COMMAND_SPECIFIER = 0x05040001
    BLOCK_SIZE = 0x05040002
    SEQUENCE_NUMBER = 0x05040003
    CRC = 0x05040004
    OUT_OF_MEMORY = 0x05040005
    UNSUPPORTED_ACCESS = 0x06010000
    WRITE_ONLY = 0x06010001
    READ_ONLY = 0x06010002
    NO_OBJECT = 0x06020000
    NOT_MAPPABLE = 0x06040041
    PDO_LENGTH = 0x06040042
    PARAMETER_INCOMPATIBLE = 0x06040043
    INTERNAL_INCOMPATIBLE = 0x06040047
    HARDWARE = 0x06060000
    LENGTH = 0x06070010
    TOO_LONG = 0x06070012
    TOO_SHORT = 0x06070013
    NO_SUBINDEX = 0x06090011
    INVALID_VALUE = 0x06090030
    VALUE_TOO_HIGH = 0x06090031
    VALUE_TOO_LOW = 0x06090032
    MAXIMUM_BELOW_MINIMUM = 0x06090036
    NO_RESOURCE = 0x060A0023
    GENERAL = 0x08000000
    CANNOT_STORE = 0x08000020
    LOCAL_CONTROL = 0x08000021
    DEVICE_STATE = 0x08000022
    NO_DICTIONARY = 0x08000023
    NO_DATA = 0x08000024


_WORDS: Final = {
    AbortCode.TOGGLE: "toggle bit not alternated",
    AbortCode.TIMEOUT: "SDO protocol timed out",
    AbortCode.COMMAND_SPECIFIER: "command specifier not valid or unknown",
    AbortCode.BLOCK_SIZE: "invalid block size",
    AbortCode.SEQUENCE_NUMBER: "invalid sequence number",
    AbortCode.CRC: "CRC error",
    AbortCode.OUT_OF_MEMORY: "out of memory",
    AbortCode.UNSUPPORTED_ACCESS: "unsupported access to an object",
    AbortCode.WRITE_ONLY: "attempt to read a write-only object",
    AbortCode.READ_ONLY: "attempt to write a read-only object",
    AbortCode.NO_OBJECT: "object does not exist",
    AbortCode.NOT_MAPPABLE: "object cannot be mapped to the PDO",
    AbortCode.PDO_LENGTH: "mapped objects would exceed the PDO's length",
    AbortCode.PARAMETER_INCOMPATIBLE: "general parameter incompatibility",
    AbortCode.INTERNAL_INCOMPATIBLE: "general internal incompatibility in the device",
    AbortCode.HARDWARE: "access failed due to a hardware error",
    AbortCode.LENGTH: "data type or length does not match",
    AbortCode.TOO_LONG: "data type does not match: too long",
    AbortCode.TOO_SHORT: "data type does not match: too short",
    AbortCode.NO_SUBINDEX: "sub-index does not exist",
    AbortCode.INVALID_VALUE: "invalid value",
    AbortCode.VALUE_TOO_HIGH: "value too high",
    AbortCode.VALUE_TOO_LOW: "value too low",
    AbortCode.MAXIMUM_BELOW_MINIMUM: "maximum is below minimum",
    AbortCode.NO_RESOURCE: "resource not available: SDO connection",
    AbortCode.GENERAL: "general error",
    AbortCode.CANNOT_STORE: "data cannot be transferred or stored",
    AbortCode.LOCAL_CONTROL: "data cannot be transferred or stored because of local control",
    AbortCode.DEVICE_STATE: "data cannot be transferred or stored in the present device state",
    AbortCode.NO_DICTIONARY: "no object dictionary is present",
    AbortCode.NO_DATA: "no data available",
}


def describe(code: int) -> str:
    """The abort code in words; "unknown reason" for a code that CiA 301 does not have."""
    return next((words for known, words in _WORDS.items() if known == code), "unknown reason")


class SdoAbort(TorqueRigError, RuntimeError):
    """An SDO transfer was aborted.

    Attributes:
        code: The abort code; any 32-bit number may come from a foreign drive.
        index: The object, None where it is not known.
        subindex: Its sub-index, None where it is not known.
    """

    def __init__(self, code: int, index: int | None = None, subindex: int | None = None) -> None:
        super().__init__(code, index, subindex)
        self.code = code
        self.index = index
        self.subindex = subindex

    def __str__(self) -> str:
        what = "" if self.index is None else f" of {self.index:04X}:{self.subindex or 0}"
        return f"SDO transfer{what} aborted: {describe(self.code)} ({self.code:#010x})"
