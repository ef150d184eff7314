"""What a node remembers without power: objects 1010 (store) and 1011 (restore); CiA 301, 7.5.2.13 f."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Final

from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort

STORE: Final = 0x1010
RESTORE: Final = 0x1011
SAVE_SIGNATURE: Final = int.from_bytes(b"save", "little")
LOAD_SIGNATURE: Final = int.from_bytes(b"load", "little")
ON_COMMAND: Final = 1  # what both objects read: stores or restores when told, not by itself
_HISTORY: Final = 0x1003


class Storage:
    """Non-volatile memory: survives a power cycle, and is used at the next reset."""

    __slots__ = ("_excluded", "_saved", "_store")

    def __init__(self, store: ObjectStore, volatile: Iterable[int]) -> None:
        """Build it empty.

        Args:
            store: Objects of the node.
            volatile: Indices of objects that are commands, not parameters: they are never stored.
        """
        self._store = store
        self._saved: dict[tuple[int, int], int] = {}
        self._excluded = frozenset({*volatile, _HISTORY, STORE, RESTORE})
        self._install(STORE, SAVE_SIGNATURE, self._save)
        self._install(RESTORE, LOAD_SIGNATURE, self._saved.clear)

    @property
    def saved(self) -> Mapping[tuple[int, int], int]:
        """The stored values by index and sub-index."""
        return MappingProxyType(self._saved)

    def _install(self, index: int, signature: int, action: Callable[[], None]) -> None:
        def check(subindex: int, value: int) -> None:
            if value != signature:
                raise SdoAbort(AbortCode.CANNOT_STORE, index, subindex)

        self._store.guard(check, index)
        self._store.watch(lambda _at_ns, _effect_ns: action(), index)
        self._store.source(lambda _at_ns: ON_COMMAND, index, 1)

    def _save(self) -> None:
        for entry in self._store:
            if entry.writable and entry.codec is not None and entry.index not in self._excluded:
                self._saved[entry.index, entry.subindex] = self._store.values[entry.slot]
