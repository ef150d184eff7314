"""The object dictionary of a node with its values: flat, typed, with the access rules of CiA 301.

SDO comes in by index and sub-index (`read`, `write`). PDOs and the device itself know the slots of their objects and
use `values` directly, at the cost of a list access.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from struct import Struct
from typing import Final

import canopen
from canopen.objectdictionary import ODVariable, datatypes

from torquerig.device_sim.canopen.timers import Timers
from torquerig.driver.wire.dictionary import struct_code
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort

_TEXT_TYPES: Final = frozenset({datatypes.VISIBLE_STRING, datatypes.OCTET_STRING, datatypes.DOMAIN})
_FIRST_OBJECT: Final = 0x1000  # below are the data types, which are no objects
_PDO_CODES: Final = frozenset("bBhHiIqQ")

Source = Callable[[int], int]  # time [ns] -> value at that time
Guard = Callable[[int, int], None]  # sub-index, value: raises SdoAbort to refuse it
Watcher = Callable[[int, int], None]  # time of the write [ns], time from which the device acts on it [ns]


@dataclass(frozen=True, slots=True)
class Entry:
    """One object of the dictionary, without its value.

    Attributes:
        index: Index.
        subindex: Sub-index.
        slot: Place of its value in `ObjectStore.values` (numbers) or `ObjectStore.texts` (strings).
        codec: How the number is packed; None for a string.
        code: Letter of the struct module; empty for a string.
        access: "ro", "wo", "rw", "rwr", "rww" or "const" (CiA 306).
        mappable: Whether the EDS allows it in a PDO.
        low: Least value allowed, or None.
        high: Greatest value allowed, or None.
    """

    index: int
    subindex: int
    slot: int
    codec: Struct | None
    code: str
    access: str
    mappable: bool = False
    low: int | None = None
    high: int | None = None

    @property
    def readable(self) -> bool:
        """Whether SDO may read it."""
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        """Whether SDO may write it."""
        return self.access in {"wo", "rw", "rwr", "rww"}

    @property
    def sendable(self) -> bool:
        """Whether a TPDO may carry it."""
        return self.mappable and self.access not in {"wo", "rww"} and self.code in _PDO_CODES

    @property
    def receivable(self) -> bool:
        """Whether an RPDO may carry it."""
        return self.mappable and self.access in {"wo", "rw", "rww"} and self.code in _PDO_CODES


class ObjectStore:
    """Objects and values of one node; satisfies sdo_server.ObjectAccess.

    A source gives the value of an object that the device measures. A guard sees a value before it is written and may
    refuse it. A watcher is told after a write, by SDO or PDO, even of the value that was there already.

    Attributes:
        values: Numbers by slot.
        texts: Strings by slot.
        sources: Sources by slot.
        dummies: Letters of the struct module by index of the data types that an RPDO may skip (DummyUsage).
        reaction_ns: Time from a write that SYNC did not release until the device acts on it [ns].
    """

    __slots__ = (
        "_defaults",
        "_entries",
        "_guards",
        "_indices",
        "_timers",
        "_watchers",
        "dummies",
        "reaction_ns",
        "sources",
        "texts",
        "values",
    )

    def __init__(self, dictionary: canopen.ObjectDictionary, timers: Timers, *, reaction_ns: int = 0) -> None:
        self.reaction_ns = reaction_ns
        self.values: list[int] = []
        self.texts: list[bytes] = []
        self.sources: dict[int, Source] = {}
        self.dummies: dict[int, str] = {}
        self._timers = timers
        self._entries: dict[tuple[int, int], Entry] = {}
        self._indices: set[int] = set()
        self._defaults: dict[tuple[int, int], int] = {}
        self._guards: dict[int, list[Guard]] = {}
        self._watchers: dict[int, list[Watcher]] = {}
        for item in dictionary.indices.values():
            for variable in [item] if isinstance(item, ODVariable) else item.subindices.values():
                self._add_variable(variable)

    def _add_variable(self, variable: ODVariable) -> None:
        default = variable.default
        if variable.index < _FIRST_OBJECT:
            self.dummies[variable.index] = struct_code(variable)
            return
        if variable.data_type in _TEXT_TYPES:
            text = default.encode("ascii") if isinstance(default, str) else bytes(default or b"")
            slot = len(self.texts)
            self.texts.append(text)
            entry = Entry(variable.index, variable.subindex, slot, None, "", variable.access_type)
            self._entries[entry.index, entry.subindex] = entry
            self._indices.add(entry.index)
            return
        self.add(
            variable.index,
            variable.subindex,
            struct_code(variable),
            variable.access_type,
            mappable=variable.pdo_mappable,
            low=variable.min,
            high=variable.max,
            default=default or 0,
        )

    def add(
        self,
        index: int,
        subindex: int,
        code: str,
        access: str,
        *,
        mappable: bool = False,
        low: int | None = None,
        high: int | None = None,
        default: int = 0,
    ) -> None:
        """Add a number to the dictionary; the arguments are the attributes of Entry."""
        codec = Struct("<" + code)
        self._entries[index, subindex] = Entry(
            index, subindex, len(self.values), codec, code, access, mappable, low, high
        )
        self._indices.add(index)
        self._defaults[index, subindex] = default
        self.values.append(default)

    def personalise(self, value: int, index: int, subindex: int = 0) -> None:
        """Give this very device another power-on value than the EDS tells, such as its serial number."""
        self._defaults[index, subindex] = value
        self.set(value, index, subindex)

    def __iter__(self) -> Iterator[Entry]:
        return iter(self._entries.values())

    def __contains__(self, address: tuple[int, int]) -> bool:
        return address in self._entries

    def find(self, index: int, subindex: int = 0) -> Entry:
        """The object.

        Raises:
            SdoAbort: There is none: 0602 0000, or 0609 0011 when only the sub-index is missing.
        """
        entry = self._entries.get((index, subindex))
        if entry is None:
            code = AbortCode.NO_SUBINDEX if index in self._indices else AbortCode.NO_OBJECT
            raise SdoAbort(code, index, subindex)
        return entry

    def slot(self, index: int, subindex: int = 0) -> int:
        """Where the object's value stands."""
        return self.find(index, subindex).slot

    def get(self, index: int, subindex: int = 0) -> int:
        """The number that an object holds now, sources not asked."""
        return self.values[self.find(index, subindex).slot]

    def set(self, value: int, index: int, subindex: int = 0) -> None:
        """Change a number as the device itself does: no access rule, guard or watcher."""
        self.values[self.find(index, subindex).slot] = value

    def source(self, source: Source, index: int, subindex: int = 0) -> None:
        """Let an object be measured: `source` is asked for its value whenever it is read or sampled."""
        self.sources[self.find(index, subindex).slot] = source

    def guard(self, guard: Guard, index: int) -> None:
        """Let `guard` see every value before it is written to a sub-index of an object."""
        self._guards.setdefault(index, []).append(guard)

    def watch(self, watcher: Watcher, *indices: int) -> None:
        """Let `watcher` be told after every write to one of the objects."""
        for index in indices:
            self._watchers.setdefault(index, []).append(watcher)

    def watchers(self, index: int) -> tuple[Watcher, ...]:
        """Who is told of writes to an object."""
        return tuple(self._watchers.get(index, ()))

    def is_checked(self, entry: Entry) -> bool:
        """Whether there are values of the object's type that `check` refuses."""
        return entry.low is not None or entry.high is not None or entry.index in self._guards

    def check(self, entry: Entry, value: int) -> None:
        """Let limits and guards see a value.

        Raises:
            SdoAbort: It must not be written: 0609 0031 too high, 0609 0032 too low, or what a guard says.
        """
        if entry.high is not None and value > entry.high:
            raise SdoAbort(AbortCode.VALUE_TOO_HIGH, entry.index, entry.subindex)
        if entry.low is not None and value < entry.low:
            raise SdoAbort(AbortCode.VALUE_TOO_LOW, entry.index, entry.subindex)
        for guard in self._guards.get(entry.index, ()):
            guard(entry.subindex, value)

    def read(self, index: int, subindex: int) -> bytes:
        """The bytes that an SDO upload gives.

        Raises:
            SdoAbort: The object does not exist, is write-only, or has no data now.
        """
        entry = self.find(index, subindex)
        if not entry.readable:
            raise SdoAbort(AbortCode.WRITE_ONLY, index, subindex)
        if entry.codec is None:
            return self.texts[entry.slot]
        source = self.sources.get(entry.slot)
        if source is not None:
            self.values[entry.slot] = source(self._timers.now_ns)
        return entry.codec.pack(self.values[entry.slot])

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Do what an SDO download asks.

        Raises:
            SdoAbort: The object does not exist, is read-only, has another length, or refuses the value.
        """
        entry = self.find(index, subindex)
        if not entry.writable:
            raise SdoAbort(AbortCode.READ_ONLY, index, subindex)
        if entry.codec is None:
            self.texts[entry.slot] = data
            return
        if len(data) != entry.codec.size:
            code = AbortCode.TOO_LONG if len(data) > entry.codec.size else AbortCode.TOO_SHORT
            raise SdoAbort(code, index, subindex)
        value: int = entry.codec.unpack(data)[0]
        self.check(entry, value)
        self.values[entry.slot] = value
        at_ns = self._timers.now_ns
        for watcher in self._watchers.get(index, ()):
            watcher(at_ns, at_ns + self.reaction_ns)

    def size_of(self, index: int, subindex: int) -> int | None:
        """Length of an object [byte]; None for a string, or when there is no such object."""
        entry = self._entries.get((index, subindex))
        return entry.codec.size if entry is not None and entry.codec is not None else None

    def restore(self, indices: range, stored: Mapping[tuple[int, int], int]) -> None:
        """Give all numbers of a range of indices their power-on values: the stored ones, else the defaults."""
        for key, default in self._defaults.items():
            if key[0] in indices:
                self.values[self._entries[key].slot] = stored.get(key, default)
