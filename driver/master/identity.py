"""Who a drive is: the identity object (CiA 301, 7.5.2.19)."""

from typing import Final, NamedTuple

from torquerig.driver.master.sdo_jobs import NUMBER_BYTES, Job, Upload
from torquerig.driver.wire.sdo import SdoAbort

IDENTITY: Final = 0x1018


class Identity(NamedTuple):
    """What a node says it is; None for what it does not say.

    Attributes:
        vendor: 1018:1, given by CiA; 0 is nobody's.
        product: 1018:2.
        revision: 1018:3.
        serial: 1018:4.
    """

    vendor: int | None
    product: int | None
    revision: int | None
    serial: int | None


def read_identity() -> Job[Identity]:
    """A job: who a node is; only the vendor has to be there."""
    vendor = yield from _number(1)
    product = yield from _number(2)
    revision = yield from _number(3)
    return Identity(vendor, product, revision, (yield from _number(4)))


def _number(subindex: int) -> Job[int | None]:
    try:
        return int.from_bytes((yield Upload(IDENTITY, subindex, NUMBER_BYTES)), "little")
    except SdoAbort:
        return None
