"""The two ends of a block transfer, whichever of them is the client (CiA 301, 7.2.4.3.10 and 7.2.4.3.14).

A block is a run of segments numbered from 1 that gets one acknowledgement, which names the last segment before the
first gap. The next block begins with the segment after that one, numbered 1 again.
"""

from binascii import crc_hqx
from typing import Final

from torquerig.driver.wire.sdo import SEGMENT_LENGTH, AbortCode, SdoAbort
from torquerig.driver.wire.sdo_block import MAX_BLOCK_SIZE, Acknowledge, End, Segment

MAX_FRUITLESS: Final = 16
"""So many blocks in a row without a segment that arrives are the end: a transfer must not go on for ever."""


def check_sum(data: bytes) -> int:
    """The check sum of a block transfer: x^16 + x^12 + x^5 + 1 from 0 (CiA 301, 7.2.4.3.16)."""
    return crc_hqx(data, 0)


class _Patience:
    """Counts blocks in a row of which nothing arrived."""

    def __init__(self) -> None:
        self._fruitless = 0

    @property
    def over(self) -> bool:
        """Whether one more such block is one too many."""
        return self._fruitless >= MAX_FRUITLESS

    def judge(self, arrived: int) -> None:
        """Takes the number of segments that arrived of a block.

        Raises:
            SdoAbort: Nothing has arrived for too long.
        """
        if not arrived and self.over:
            raise SdoAbort(AbortCode.SEQUENCE_NUMBER)
        self._fruitless = 0 if arrived else self._fruitless + 1


class BlockSender:
    """Cuts data into blocks, and sends again what did not arrive.

    Attributes:
        ended: All has arrived, and the end has been said.
    """

    def __init__(self, data: bytes, *, crc: bool) -> None:
        """A sender of which nothing has arrived.

        Args:
            data: What to send.
            crc: Whether the receiver checks the sum.
        """
        self.ended = False
        self._data = data
        self._crc = crc
        self._segments = max(1, -(-len(data) // SEGMENT_LENGTH))  # even nothing takes one, to say that it is the last
        self._arrived = 0
        self._sent = 0  # segments of the block under way
        self._patience = _Patience()

    def block(self, block_size: int) -> tuple[Segment, ...]:
        """The next block, of so many segments or fewer.

        Raises:
            SdoAbort: The receiver's block size is not 1 to 127.
        """
        if not 1 <= block_size <= MAX_BLOCK_SIZE:
            raise SdoAbort(AbortCode.BLOCK_SIZE)
        first, end = self._arrived, min(self._arrived + block_size, self._segments)
        self._sent = end - first
        return tuple(
            Segment(
                number - first + 1,
                self._data[number * SEGMENT_LENGTH : (number + 1) * SEGMENT_LENGTH],
                last=number + 1 == self._segments,
            )
            for number in range(first, end)
        )

    def answer(self, message: Acknowledge) -> tuple[Segment, ...] | tuple[End]:
        """What comes after an acknowledgement: the next block, or the end; nobody needs a block size with the last one.

        Raises:
            SdoAbort: It names a segment that was not sent, or nothing has arrived for too long, or its block size is
                not 1 to 127.
        """
        if message.sequence > self._sent:
            raise SdoAbort(AbortCode.SEQUENCE_NUMBER)
        self._patience.judge(message.sequence)
        self._arrived += message.sequence
        if self._arrived < self._segments:
            return self.block(message.block_size)
        self.ended = True
        unused = self._segments * SEGMENT_LENGTH - len(self._data)
        return (End(unused, check_sum(self._data) if self._crc else 0),)


class BlockReceiver:
    """Puts the segments of blocks together.

    Attributes:
        block_size: Segments in the block under way.
        complete: The last segment has arrived.
        skipped: Segments out of sequence, which were not taken.
    """

    def __init__(self, block_size: int, *, size: int | None, crc: bool, max_bytes: int) -> None:
        """A receiver to which nothing has come.

        Args:
            block_size: Segments in the first block.
            size: The length that the sender announced [byte], None when it did not.
            crc: Whether the sender forms the sum.
            max_bytes: The most that is held.
        """
        self.complete = False
        self.skipped = 0
        self.block_size = block_size
        self._size = size
        self._crc = crc
        self._max_bytes = max_bytes
        self._buffer = bytearray()
        self._taken = 0  # segments of the block under way
        self._fault: AbortCode | None = None
        self._patience = _Patience()

    def take(self, segment: Segment, next_block_size: int) -> Acknowledge | None:
        """Takes a segment; after the last one of a block, whatever is missing, comes the acknowledgement.

        Data that are too long raise there too, when the sender is at rest: in the midst of a block the segments still
        on their way would be taken for messages of the next transfer.

        Raises:
            SdoAbort: The number is not 1 to the block size, the data are longer than announced or than can be held, or
                nothing has arrived for too long.
        """
        if not 1 <= segment.sequence <= self.block_size:
            raise SdoAbort(AbortCode.SEQUENCE_NUMBER)
        if segment.sequence == self._taken + 1:
            self._taken += 1
            self._keep(segment)
        else:
            self.skipped += 1
        if segment.last or segment.sequence == self.block_size:
            if self._fault is not None:
                raise SdoAbort(self._fault)
            return self._acknowledge(next_block_size)
        return None

    def overdue(self, next_block_size: int) -> Acknowledge | None:
        """The acknowledgement when the rest of a block does not come; None when that would not help.

        After a block of which nothing came, what was lost may also be the acknowledgement of the one before, which then
        comes twice. That is risked only where the sum or the length will show it, and not for ever.
        """
        detectable = self._crc or self._size is not None or not self._buffer
        if self.complete or self._fault is not None or (not self._taken and (self._patience.over or not detectable)):
            return None
        return self._acknowledge(next_block_size)

    def finish(self, message: End) -> bytes:
        """The data, once all is there.

        Raises:
            SdoAbort: The sum is wrong, or the length is not the announced one, or too great.
        """
        data = bytes(self._buffer[: len(self._buffer) - message.unused])
        if self._crc and check_sum(data) != message.crc:
            raise SdoAbort(AbortCode.CRC)
        fault = self._fault_of_length(len(data))
        if fault is not None:
            raise SdoAbort(fault)
        if self._size is not None and len(data) < self._size:
            raise SdoAbort(AbortCode.TOO_SHORT)
        return data

    def _keep(self, segment: Segment) -> None:
        if self._fault is not None:
            return
        self._buffer += segment.data
        self.complete = segment.last
        if not segment.last:  # how much of the last one counts, only the end says
            self._fault = self._fault_of_length(len(self._buffer))

    def _fault_of_length(self, length: int) -> AbortCode | None:
        if self._size is not None and length > self._size:
            return AbortCode.TOO_LONG
        return AbortCode.OUT_OF_MEMORY if length > self._max_bytes else None

    def _acknowledge(self, next_block_size: int) -> Acknowledge:
        taken, self._taken = self._taken, 0
        self._patience.judge(taken)
        self.block_size = next_block_size
        return Acknowledge(taken, next_block_size)
