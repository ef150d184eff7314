"""Homing on the current position: methods 37 and, its former number, 35 (objects 607C, 6098)."""

from typing import Final

from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.device_sim.drive import objects
from torquerig.device_sim.drive.encoder import Encoder
from torquerig.driver.wire.cia402 import HOMING_ATTAINED, HOMING_ERROR, TARGET_REACHED
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort

_METHODS: Final = frozenset({35, 37})


class Homing:
    """Says that the machine stands where it is known to stand: 6064 becomes 607C, and nothing moves.

    It fails (statusword bit 13) on a motor that turns or an encoder that is lost.
    """

    __slots__ = ("_encoder", "_fastest", "_store", "attained", "failed")

    def __init__(self, store: ObjectStore, encoder: Encoder, fastest: float) -> None:
        """Build it.

        Args:
            store: Objects of the drive.
            encoder: The encoder whose position it sets.
            fastest: Speed beyond which it fails [counts/s].
        """
        self._store = store
        self._encoder = encoder
        self._fastest = fastest
        self.attained = False
        self.failed = False
        store.guard(self._guard, objects.HOMING_METHOD)

    def power_on(self) -> None:
        """Begin: homing was never done."""
        self.attained = False
        self.failed = False

    def start(self, at_ns: int) -> None:
        """Set the position now."""
        self.failed = self._encoder.lost or abs(self._encoder.velocity(at_ns)) > self._fastest
        self.attained = not self.failed
        if self.attained:
            self._encoder.set_position(self._store.get(objects.HOME_OFFSET), at_ns)

    @property
    def status_bits(self) -> int:
        """Statusword bits 10, 12 and 13: attained; error, standing; or not started."""
        if self.attained:
            return HOMING_ATTAINED | TARGET_REACHED
        return HOMING_ERROR | TARGET_REACHED if self.failed else TARGET_REACHED

    def _guard(self, subindex: int, value: int) -> None:
        if value not in _METHODS:
            raise SdoAbort(AbortCode.INVALID_VALUE, objects.HOMING_METHOD, subindex)
