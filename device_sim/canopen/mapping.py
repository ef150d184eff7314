"""Which objects a PDO carries: the mapping objects 16xx and 1Axx, changed at run time (CiA 301, 7.5.2.36, 7.5.2.38)."""

from collections.abc import Callable
from dataclasses import dataclass
from struct import Struct, calcsize

from torquerig.device_sim.canopen.object_store import Entry, ObjectStore
from torquerig.driver.wire.frame import MAX_DATA_LENGTH
from torquerig.driver.wire.pdo import split_mapping_entry
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort


@dataclass(frozen=True, slots=True)
class CompiledMapping:
    """A compiled mapping.

    Attributes:
        entries: The mapped objects; dummies are only gaps in the codec.
        codec: Packs and unpacks the values of `entries`.
        places: Where each of `entries` stands in the data: its first byte, and how many it has.
    """

    entries: tuple[Entry, ...]
    codec: Struct
    places: tuple[tuple[int, int], ...]


class MappingObject:
    """One mapping object, and the procedure by which it may change.

    The PDO must not exist (bit 31 of its COB-ID) and the number of objects must be 0 while entries are written.
    """

    __slots__ = ("_exists", "_index", "_inward", "_store")

    def __init__(self, store: ObjectStore, index: int, exists: Callable[[], bool], *, inward: bool) -> None:
        """Build it.

        Args:
            store: Objects of the node.
            index: Index of the mapping object.
            exists: Whether its PDO exists now.
            inward: It maps an RPDO; dummies are allowed.
        """
        self._store = store
        self._index = index
        self._exists = exists
        self._inward = inward
        store.guard(self._guard, index)

    @property
    def count(self) -> int:
        """How many objects are mapped."""
        return self._store.get(self._index)

    def compile(self) -> CompiledMapping:
        """The mapping as the object says now.

        Raises:
            SdoAbort: It is impossible, which only an EDS can bring about.
        """
        return self._compile(self.count)

    def _compile(self, count: int) -> CompiledMapping:
        entries: list[Entry] = []
        places: list[tuple[int, int]] = []
        codes = ["<"]
        at = 0
        for subindex in range(1, count + 1):
            found = self._resolve(subindex, self._store.get(self._index, subindex))
            if isinstance(found, Entry):
                entries.append(found)
                codes.append(found.code)
                places.append((at, calcsize(f"<{found.code}")))
            else:
                codes.append(f"{found}x")
            at = calcsize("".join(codes))
        codec = Struct("".join(codes))
        if codec.size > MAX_DATA_LENGTH:
            raise SdoAbort(AbortCode.PDO_LENGTH, self._index, 0)
        return CompiledMapping(tuple(entries), codec, tuple(places))

    def _resolve(self, subindex: int, value: int) -> Entry | int:
        """The object of a mapping entry, or the length of a dummy [byte].

        Raises:
            SdoAbort: 0602 0000, there is no such object or sub-index (CiA 301, 7.5.2.36: 0609 0011 would be about the
                mapping object itself); 0604 0041, it cannot be mapped so.
        """
        index, object_subindex, bits = split_mapping_entry(value)
        dummy = self._store.dummies.get(index) if object_subindex == 0 else None
        if dummy is not None:
            if not self._inward or bits != 8 * calcsize(f"<{dummy}"):
                raise SdoAbort(AbortCode.NOT_MAPPABLE, self._index, subindex)
            return bits // 8
        if (index, object_subindex) not in self._store:
            raise SdoAbort(AbortCode.NO_OBJECT, self._index, subindex)
        entry = self._store.find(index, object_subindex)
        suitable = entry.receivable if self._inward else entry.sendable
        if not suitable or entry.codec is None or bits != 8 * entry.codec.size:
            raise SdoAbort(AbortCode.NOT_MAPPABLE, self._index, subindex)
        return entry

    def _guard(self, subindex: int, value: int) -> None:
        if self._exists():
            raise SdoAbort(AbortCode.DEVICE_STATE, self._index, subindex)
        if subindex == 0:
            self._compile(value)
        elif self.count:
            raise SdoAbort(AbortCode.DEVICE_STATE, self._index, subindex)
        elif value:
            self._resolve(subindex, value)
