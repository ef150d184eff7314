"""Memory that a port's compiled code and the kernel share: frames, and the headers that point to them.

Layouts are Linux's for 64 bits: struct can_frame (linux/can.h), struct mmsghdr, struct iovec and struct cmsghdr
(bits/socket.h), struct pollfd (sys/poll.h).
"""

import select
import sys
from collections.abc import Iterable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.driver.bus.cyclic_kernels import BATCH, HEADER_SIZE, STAMP_SIZE

SUPPORTED: Final = sys.platform == "linux" and sys.byteorder == "little" and sys.maxsize > 1 << 32

CAN_FRAME: Final = np.dtype([("can_id", "u4"), ("length", "u1"), ("reserved", "u1", (3,)), ("data", "u1", (8,))])
POLLED: Final = np.dtype([("descriptor", "i4"), ("events", "i2"), ("revents", "i2")])
VECTOR: Final = np.dtype([("base", "u8"), ("size", "u8")])
HEADER: Final = np.dtype(
    {
        "names": ["vector", "vectors", "control", "control_size", "size"],
        "formats": ["u8", "u8", "u8", "u8", "u4"],
        "offsets": [16, 24, 32, 40, 56],
        "itemsize": HEADER_SIZE,
    }
)
STAMP: Final = np.dtype(
    [("size", "u8"), ("level", "i4"), ("kind", "i4"), ("seconds", "i8"), ("nanoseconds", "i8")], align=True
)
assert STAMP.itemsize == STAMP_SIZE  # noqa: S101  (what the kernels were told)

NOW: Final = [("now", "i8", (2,)), ("now_at", "u8"), ("polled_at", "u8"), ("polled_count", "i8")]
"""What every wire's record begins with: a struct timespec to work with, and what is waited for."""


def address(block: NDArray[np.void], *path: str | int) -> int:
    """Where a field of a record stands in memory.

    Args:
        block: The record, shape (1,).
        path: Name of the field, or index within it, from the outside in.
    """
    view: Any = block[0]
    for step in path:
        view = view[step : step + 1] if isinstance(step, int) else view[step]
    return int(np.asarray(view).ctypes.data)


def point(block: NDArray[np.void], headers: str, vectors: str, frames: str, size: int) -> None:
    """Have each header of a field point to its frame, by its vector.

    Args:
        block: The record, shape (1,).
        headers: Name of its headers.
        vectors: Name of its vectors.
        frames: Name of its frames.
        size: Bytes of a frame.
    """
    record = block[0]
    for k in range(len(record[headers])):
        record[vectors][k]["base"] = address(block, frames, k)
        record[vectors][k]["size"] = size
        record[headers][k]["vector"] = address(block, vectors, k)
        record[headers][k]["vectors"] = 1


def stamped(block: NDArray[np.void]) -> None:
    """Have each header for received frames point to room for its timestamp."""
    record = block[0]
    for k in range(BATCH):
        record["header_in"][k]["control"] = address(block, "stamp", k)


def poll_for(block: NDArray[np.void], descriptors: Iterable[int]) -> None:
    """Have some descriptors waited for."""
    record = block[0]
    count = 0
    for count, descriptor in enumerate(descriptors, start=1):
        record["polled"][count - 1] = (descriptor, select.POLLIN, 0)
    record["polled_count"] = count
    record["polled_at"] = address(block, "polled")
    record["now_at"] = address(block, "now")
