"""Process data: layouts of mapped objects, mapping entries, transmission types (CiA 301, 7.2.2 and 7.5.2.35 f.)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from struct import Struct, calcsize
from struct import error as StructError  # noqa: N812 - the module's own name for it says nothing here
from typing import Any, Final

from torquerig.driver.wire.frame import MAX_DATA_LENGTH

MAX_MAPPED: Final = 8  # objects of a whole byte each that a classic frame can hold

# transmission types (1400:2, 1800:2)
SYNC_ACYCLIC: Final = 0
SYNC_EVERY: Final = 1
SYNC_RTR: Final = 252
EVENT_RTR: Final = 253
EVENT_MANUFACTURER: Final = 254
EVENT_PROFILE: Final = 255
_STRUCT_CODES: Final = frozenset("?bBhHiIqQfd")
_CYCLIC: Final = range(1, 241)
_RESERVED: Final = range(241, 252)


@dataclass(frozen=True, slots=True)
class PdoField:
    """One mapped object.

    Attributes:
        index: Object, or the data type of a dummy (1 to 7).
        subindex: Its sub-index.
        struct_code: One letter of the struct module: "b B h H i I q Q f d ?".
    """

    index: int
    subindex: int
    struct_code: str


class PdoLayout:
    """How the data of a PDO are made up; one Struct, compiled once.

    Attributes:
        fields: The mapped objects, in the order of the mapping.
        size: Length of the data [byte].
        codec: The compiled Struct, for hot paths that pack into their own buffer.
    """

    __slots__ = ("codec", "fields", "size")

    def __init__(self, fields: Iterable[PdoField]) -> None:
        self.fields = tuple(fields)
        for field in self.fields:
            if field.struct_code not in _STRUCT_CODES:
                raise ValueError(f"object {field.index:04X}:{field.subindex} cannot be packed as {field.struct_code!r}")
        self.codec = Struct("<" + "".join(field.struct_code for field in self.fields))
        self.size = self.codec.size
        if self.size > MAX_DATA_LENGTH:
            raise ValueError(f"a PDO holds 8 bytes, these {len(self.fields)} objects have {self.size}")

    @property
    def mapping(self) -> tuple[int, ...]:
        """The entries of the mapping object (1600, 1A00), sub-indices 1 and up."""
        return tuple(
            mapping_entry(field.index, field.subindex, 8 * calcsize("<" + field.struct_code)) for field in self.fields
        )

    def pack(self, values: Sequence[float]) -> bytes:
        """The data of the PDO.

        Raises:
            ValueError: There is not one value for each field, or one does not fit; it is named.
        """
        try:
            return self.codec.pack(*values)
        except (StructError, OverflowError):
            raise ValueError(self._complaint(values)) from None

    def unpack(self, data: bytes) -> tuple[Any, ...] | None:
        """The values, or None when the data are too short; what exceeds the mapping is ignored (CiA 301, 7.2.2)."""
        return self.codec.unpack_from(data) if len(data) >= self.size else None

    def _complaint(self, values: Sequence[float]) -> str:
        if len(values) != len(self.fields):
            return f"this PDO has {len(self.fields)} values, not {len(values)}"
        field, value = next(pair for pair in zip(self.fields, values, strict=True) if not _fits(*pair))
        return f"{value!r} does not fit object {field.index:04X}:{field.subindex} of this PDO"


def mapping_entry(index: int, subindex: int, bits: int) -> int:
    """The mapping entry of an object: index, sub-index and length in bits, from the high to the low end.

    Raises:
        ValueError: A part does not fit its field.
    """
    if not (0 <= index <= 0xFFFF and 0 <= subindex <= 0xFF and 1 <= bits <= 0xFF):
        raise ValueError(f"no mapping entry for {index:#x}:{subindex} with {bits} bits")
    return index << 16 | subindex << 8 | bits


def split_mapping_entry(entry: int) -> tuple[int, int, int]:
    """Index, sub-index and length in bits out of a mapping entry; inverse of mapping_entry."""
    return entry >> 16 & 0xFFFF, entry >> 8 & 0xFF, entry & 0xFF


def is_cyclic(transmission_type: int) -> bool:
    """Whether a TPDO of this type goes out after every n-th SYNC, n being the type."""
    return transmission_type in _CYCLIC


def is_synchronous(transmission_type: int) -> bool:
    """Whether SYNC decides when the data are sampled (TPDO) or take effect (RPDO)."""
    return transmission_type in {SYNC_ACYCLIC, SYNC_RTR} or transmission_type in _CYCLIC


def allowed_for_rpdo(transmission_type: int) -> bool:
    """Whether an RPDO may have this type: 0 to 240, 254, 255 (252 and 253 ask by remote frame: TPDOs only)."""
    return SYNC_ACYCLIC <= transmission_type < _RESERVED.start or transmission_type in {
        EVENT_MANUFACTURER,
        EVENT_PROFILE,
    }


def allowed_for_tpdo(transmission_type: int) -> bool:
    """Whether a TPDO may have this type: all but the reserved 241 to 251."""
    return SYNC_ACYCLIC <= transmission_type <= EVENT_PROFILE and transmission_type not in _RESERVED


def _fits(field: PdoField, value: float) -> bool:
    try:
        Struct("<" + field.struct_code).pack(value)
    except (StructError, OverflowError):
        return False
    return True
