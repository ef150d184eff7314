"""Where a fuzzer's decisions come from: a seed, a coverage-guided fuzzer's bytes, or hypothesis, which can shrink."""

import random
from collections.abc import Sequence
from typing import Protocol, TypeVar

T = TypeVar("T")


class Source(Protocol):
    """Decides."""

    @property
    def exhausted(self) -> bool:
        """Whether nothing is left to decide by."""
        ...

    def integer(self, low: int, high: int) -> int:
        """A number from `low` to `high`, both included."""
        ...

    def octets(self, length: int) -> bytes:
        """So many bytes."""
        ...


class SeededSource:
    """Decides by a seed, and never ends: the same seed, the same decisions."""

    exhausted = False

    def __init__(self, seed: int | str) -> None:
        self._random = random.Random(seed)

    def integer(self, low: int, high: int) -> int:
        """A number from `low` to `high`, all equally likely."""
        return low + int(self._random.random() * (high - low + 1))

    def octets(self, length: int) -> bytes:
        """So many bytes, all equally likely."""
        return self._random.randbytes(length)


class OctetSource:
    """Decides by given bytes; when they are used up, everything is at its least."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._used = 0

    @property
    def exhausted(self) -> bool:
        """Whether all bytes are used."""
        return self._used >= len(self._data)

    def integer(self, low: int, high: int) -> int:
        """A number from as many bytes as its range needs, so that a byte of the input means one decision."""
        span = high - low
        length = (span.bit_length() + 7) // 8
        return low + int.from_bytes(self.octets(length), "little") % (span + 1)

    def octets(self, length: int) -> bytes:
        """The next bytes, zeros beyond the end."""
        taken = self._data[self._used : self._used + length]
        self._used += length
        return taken.ljust(length, b"\0")


def choose(source: Source, options: Sequence[T]) -> T:
    """One of several."""
    return options[source.integer(0, len(options) - 1)]


def in_one_of(source: Source, times: int) -> bool:
    """True once in so many times; False is the least that a source can decide."""
    return source.integer(0, times - 1) == times - 1
