"""SYNC, without and with its counter (CiA 301, 7.2.5)."""

from typing import Final, NamedTuple

from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Frame

SYNC_FRAME: Final = Frame(cob.SYNC)
COUNTER_OVERFLOWS: Final = range(2, 241)  # values of 1019 that make SYNC carry a counter; 0 means none


class Sync(NamedTuple):
    """A SYNC message; its counter runs from 1 to the overflow value 1019, and is None when SYNC has no data."""

    counter: int | None


def encode_sync(counter: int | None = None, *, cob_id: int = cob.SYNC) -> Frame:
    """A SYNC message.

    Args:
        counter: 1 to 240, or None for a SYNC without data.
        cob_id: Identifier out of 1005.

    Raises:
        ValueError: The counter is out of its range.
    """
    if counter is None:
        return Frame(cob_id)
    if not 1 <= counter < COUNTER_OVERFLOWS.stop:
        raise ValueError(f"a SYNC counter is 1 to 240, not {counter}")
    return Frame(cob_id, bytes((counter,)))


def decode_sync(frame: Frame, *, cob_id: int = cob.SYNC) -> Sync | None:
    """The SYNC in a frame, or None when it is none, or has more than the counter's byte."""
    if frame.can_id != cob_id or frame.remote or frame.extended or len(frame.data) > 1:
        return None
    return Sync(frame.data[0] if frame.data else None)
