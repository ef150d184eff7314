"""The SYNC consumer: identifier, counter and window (CiA 301, 7.2.5; objects 1005, 1006, 1007, 1019)."""

from typing import Final

from torquerig.device_sim.canopen.emergency import EmergencyProducer
from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.driver.wire import cob
from torquerig.driver.wire.emcy import EmergencyCode
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort
from torquerig.driver.wire.sync import COUNTER_OVERFLOWS

COB_ID: Final = 0x1005
CYCLE_PERIOD: Final = 0x1006
WINDOW_LENGTH: Final = 0x1007
COUNTER_OVERFLOW: Final = 0x1019
US: Final = 1_000  # [ns]


class SyncConsumer:
    """Tells what of the SYNC identifier's frames is a SYNC.

    Attributes:
        last_ns: When the last SYNC came, None before the first since boot-up.
        count: SYNCs since boot-up.
        wrong_length: Frames whose length does not fit 1019.
    """

    __slots__ = (
        "_complained",
        "_emergency",
        "_overflow",
        "_period",
        "_store",
        "_values",
        "_window",
        "count",
        "last_ns",
        "wrong_length",
    )

    def __init__(self, store: ObjectStore, emergency: EmergencyProducer) -> None:
        self._store = store
        self._values = store.values
        self._emergency = emergency
        self._complained = False
        self._period = store.slot(CYCLE_PERIOD)
        self._window = store.slot(WINDOW_LENGTH)
        self._overflow = store.slot(COUNTER_OVERFLOW)
        self.last_ns: int | None = None
        self.count = 0
        self.wrong_length = 0
        store.guard(self._guard_cob_id, COB_ID)
        store.guard(self._guard_overflow, COUNTER_OVERFLOW)

    @property
    def cob_id(self) -> int:
        """The identifier of SYNC."""
        return cob.identifier(self._store.get(COB_ID))

    @property
    def period_ns(self) -> int:
        """The communication cycle period, 0 when it is not told."""
        return self._values[self._period] * US

    def reset(self) -> None:
        """Begin as after boot-up."""
        self.last_ns = None
        self.count = 0

    def accept(self, frame: Frame, at_ns: int) -> bool:
        """Whether a frame on the SYNC identifier is a SYNC: 1 byte long when 1019 asks for a counter, else empty."""
        if len(frame.data) != self.length:
            self.wrong_length += 1
            self._complained = True
            self._emergency.report(EmergencyCode.SYNC_LENGTH, at_ns)
            return False
        if self._complained:
            self._complained = False
            self._emergency.clear(EmergencyCode.SYNC_LENGTH, at_ns)
        self.last_ns = at_ns
        self.count += 1
        return True

    @property
    def length(self) -> int:
        """Bytes that a SYNC has."""
        return 1 if self._values[self._overflow] else 0

    @property
    def is_plain(self) -> bool:
        """Whether there is no window to heed, and nothing that the last SYNC was told of."""
        return not (self._complained or self._values[self._window])

    def take_back(self, count: int, last_ns: int) -> None:
        """Go on from where a steady cycle ended."""
        self.count, self.last_ns = count, last_ns

    def window_closed(self, at_ns: int) -> bool:
        """Whether synchronous PDOs come too late now (1007; 0 means never)."""
        window_us = self._values[self._window]
        return window_us > 0 and self.last_ns is not None and at_ns > self.last_ns + window_us * US

    def _guard_cob_id(self, subindex: int, value: int) -> None:
        """This node generates no SYNC, and knows 11-bit identifiers only."""
        if value & (cob.NO_RTR | cob.EXTENDED) or cob.is_restricted(cob.identifier(value)):
            raise SdoAbort(AbortCode.INVALID_VALUE, COB_ID, subindex)

    def _guard_overflow(self, subindex: int, value: int) -> None:
        """The counter changes only while no cycle period is set (CiA 301, 7.5.2.22)."""
        if self._store.get(CYCLE_PERIOD):
            raise SdoAbort(AbortCode.DEVICE_STATE, COUNTER_OVERFLOW, subindex)
        if value and value not in COUNTER_OVERFLOWS:
            raise SdoAbort(AbortCode.INVALID_VALUE, COUNTER_OVERFLOW, subindex)
