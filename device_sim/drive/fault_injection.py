"""Faults on demand: object 2F00, which the EDS of the drive does not have because a real drive has none."""

from collections.abc import Callable
from enum import IntEnum
from typing import Final

from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.device_sim.drive import objects
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort


class Injection(IntEnum):
    """What a write to 2F00 makes happen. All but overcurrent last until CLEAR, and keep the fault from being reset.

    CLEAR: everything is in order again; the drive stays in fault until it is reset.
    OVERCURRENT: the power stage trips once: EMCY 0x2310.
    ENCODER_LOSS: the encoder's cable breaks, the position stands still: EMCY 0x7305.
    MOTOR_TEMPERATURE: the motor's sensor reads beyond its maximum: EMCY 0x4310.
    DEVICE_TEMPERATURE: the power stage's sensor reads beyond its maximum: EMCY 0x4210.
    UNDERVOLTAGE: the DC link breaks down: EMCY 0x3220.
    OVERVOLTAGE: the DC link rises beyond its maximum: EMCY 0x3210.
    """

    CLEAR = 0
    OVERCURRENT = 1
    ENCODER_LOSS = 2
    MOTOR_TEMPERATURE = 3
    DEVICE_TEMPERATURE = 4
    UNDERVOLTAGE = 5
    OVERVOLTAGE = 6


def install(store: ObjectStore, inject: Callable[[Injection, int], None]) -> None:
    """Add 2F00 to a drive's objects.

    Args:
        store: Objects of the drive.
        inject: Takes what shall happen, and when.
    """
    store.add(objects.FAULT_INJECTION, 0, "I", "wo")
    slot = store.slot(objects.FAULT_INJECTION)

    def check(subindex: int, value: int) -> None:
        if value not in _VALUES:
            raise SdoAbort(AbortCode.INVALID_VALUE, objects.FAULT_INJECTION, subindex)

    store.guard(check, objects.FAULT_INJECTION)
    store.watch(lambda at_ns, _effect_ns: inject(Injection(store.values[slot]), at_ns), objects.FAULT_INJECTION)


_VALUES: Final = frozenset(Injection)
