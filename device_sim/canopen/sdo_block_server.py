"""Block transfers that an SDO server has under way (CiA 301, 7.2.4.3.8 to 7.2.4.3.16)."""

from collections.abc import Sequence

from torquerig.driver.wire import sdo_block
from torquerig.driver.wire.sdo import AbortCode, SdoAbort
from torquerig.driver.wire.sdo_block_transfer import BlockReceiver, BlockSender


class BlockUpload:
    """A block upload under way: what is left to send, and which request is due."""

    def __init__(self, request: sdo_block.ReceiverInitiate, sender: BlockSender) -> None:
        self.index = request.index
        self.subindex = request.subindex
        self._sender = sender
        self._block_size = request.block_size
        self._due: type = sdo_block.Start

    def answer(self, request: sdo_block.Start | sdo_block.Acknowledge) -> Sequence[sdo_block.Message]:
        """The first block after the start; after an acknowledgement the next block, or the end.

        Raises:
            SdoAbort: Another request is due, or the sender finds fault with the acknowledgement.
        """
        self._check_due(type(request))
        if isinstance(request, sdo_block.Start):
            self._due = sdo_block.Acknowledge
            return self._sender.block(self._block_size)
        answer = self._sender.answer(request)
        if self._sender.ended:
            self._due = sdo_block.Ended
        return answer

    def end(self, _request: sdo_block.Ended) -> None:
        """All has arrived.

        Raises:
            SdoAbort: It cannot have.
        """
        self._check_due(sdo_block.Ended)

    def _check_due(self, kind: type) -> None:
        if kind is not self._due:
            raise SdoAbort(AbortCode.COMMAND_SPECIFIER)


class BlockDownload:
    """A block download under way: what has come."""

    def __init__(self, request: sdo_block.SenderInitiate, receiver: BlockReceiver) -> None:
        self.index = request.index
        self.subindex = request.subindex
        self.receiver = receiver


class RestOfBlock:
    """The rest of a block after a segment with an impossible number.

    Such a client may go on until it hears of the abort, and its segments must not be taken for requests: the one
    numbered 35 looks like an expedited download to whatever object its data happen to name.
    """

    def __init__(self, last_heard: sdo_block.Segment, block_size: int) -> None:
        self._sequence = last_heard.sequence
        self._end = block_size if last_heard.sequence <= block_size else sdo_block.MAX_BLOCK_SIZE
        self._over = last_heard.last

    def goes_on(self, data: bytes) -> bool:
        """Whether it goes on with these bytes, which must bear the next number."""
        message = sdo_block.decode_segment(data)
        if self._over or self._sequence >= self._end or not isinstance(message, sdo_block.Segment):
            return False
        self._sequence += 1
        self._over = message.last
        return message.sequence == self._sequence
