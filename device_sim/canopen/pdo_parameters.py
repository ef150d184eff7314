"""How a PDO is exchanged: the communication objects 14xx and 18xx (CiA 301, 7.5.2.35 and 7.5.2.37)."""

from collections.abc import Callable
from typing import Final

from torquerig.device_sim.canopen.emergency import INHIBIT_UNIT, guard_cob_id
from torquerig.device_sim.canopen.heartbeat import MS
from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.driver.wire import cob
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort

COB_ID: Final = 1
TRANSMISSION_TYPE: Final = 2
INHIBIT_TIME: Final = 3
EVENT_TIMER: Final = 5


class PdoParameters:
    """One communication object, with the rules of its values."""

    __slots__ = ("_allowed", "_index", "_mapped", "_store")

    def __init__(
        self, store: ObjectStore, index: int, allowed: Callable[[int], bool], mapped: Callable[[], int]
    ) -> None:
        """Build it.

        Args:
            store: Objects of the node.
            index: Index of the communication object.
            allowed: Whether the PDO may have a transmission type.
            mapped: How many objects its mapping has now.
        """
        self._store = store
        self._index = index
        self._allowed = allowed
        self._mapped = mapped
        guard = guard_cob_id(store, index)
        store.guard(lambda subindex, value: guard(subindex, value) if subindex == COB_ID else None, index)
        store.guard(self._guard, index)

    @property
    def exists(self) -> bool:
        """Whether the PDO exists: bit 31 of its COB-ID is clear."""
        return cob.is_valid(self._store.get(self._index, COB_ID))

    @property
    def cob_id(self) -> int:
        """The PDO's identifier."""
        return cob.identifier(self._store.get(self._index, COB_ID))

    @property
    def remote_allowed(self) -> bool:
        """Whether it may be asked for by a remote frame."""
        return not self._store.get(self._index, COB_ID) & cob.NO_RTR

    @property
    def transmission_type(self) -> int:
        """When data are sampled and sent, or take effect."""
        return self._store.get(self._index, TRANSMISSION_TYPE)

    @property
    def inhibit_ns(self) -> int:
        """Least time between two transmissions."""
        return self._store.get(self._index, INHIBIT_TIME) * INHIBIT_UNIT

    @property
    def event_ns(self) -> int:
        """TPDO: greatest time between two transmissions; RPDO: deadline of the next reception; 0: none."""
        return self._store.get(self._index, EVENT_TIMER) * MS

    def _guard(self, subindex: int, value: int) -> None:
        refused = False
        if subindex == COB_ID:
            refused = cob.is_valid(value) and self._mapped() == 0
        elif subindex == TRANSMISSION_TYPE:
            refused = not self._allowed(value)
        elif subindex == INHIBIT_TIME:
            refused = self.exists and value != self._store.get(self._index, INHIBIT_TIME)
        if refused:
            raise SdoAbort(AbortCode.INVALID_VALUE, self._index, subindex)
