"""The client's side of SDO block transfers, stepped like the plain ones (CiA 301, 7.2.4.3.8 to 7.2.4.3.16).

A step may give a whole block, and the last one gives a message although the transfer is done:

    upload = SdoBlockUpload(0x1018, 1)
    send(upload.request)
    while not upload.done:
        answer = upload.step(receive())
        if answer is not None:
            send(answer, *upload.pending)

The plain machines run by the same lines.
"""

from functools import partial

from torquerig.driver.master.sdo_client import MAX_BYTES, SdoDownload, SdoUpload
from torquerig.driver.wire import sdo, sdo_block
from torquerig.driver.wire.sdo import AbortCode
from torquerig.driver.wire.sdo_block import MAX_BLOCK_SIZE
from torquerig.driver.wire.sdo_block_transfer import BlockReceiver, BlockSender


class SdoBlockUpload(SdoUpload):
    """Reads one object in blocks.

    Attributes:
        block_size: Segments in a block; a change goes with the next acknowledgement.
        ignored: Counts also the segments out of sequence; the server is asked to send them again.
    """

    def __init__(
        self,
        index: int,
        subindex: int,
        *,
        block_size: int = MAX_BLOCK_SIZE,
        switch_threshold: int = 0,
        crc: bool = True,
        fall_back: bool = False,
        max_bytes: int = MAX_BYTES,
    ) -> None:
        """An upload whose request is still to be sent.

        Args:
            index: The object.
            subindex: Its sub-index.
            block_size: Segments in a block, 1 to 127.
            switch_threshold: Up to how many bytes the server may answer as to a plain upload, 0 (never) to 255.
            crc: Whether the check sum is wanted; it is used if the server can form it.
            fall_back: Whether a plain upload will do if the server has no block upload.
            max_bytes: Longest object that is taken.

        Raises:
            ValueError: A number is out of its range.
        """
        super().__init__(index, subindex, max_bytes=max_bytes)
        self.block_size = block_size
        self._crc = crc
        self._plain_request = self.request if fall_back else None
        self._receiver: BlockReceiver | None = None  # in the midst of the blocks
        initiate = sdo_block.ReceiverInitiate(index, subindex, crc, block_size, switch_threshold)
        self.request = sdo_block.encode(initiate)
        self._decode = sdo_block.decode_response
        self._awaited = {sdo_block.SenderInitiate: partial(self._on_offer, block_size), sdo.Abort: self._on_refused}
        if fall_back or switch_threshold:
            self._awaited = {**self._awaited, sdo.UploadInitiated: self._on_switched}

    @property
    def receiving(self) -> bool:
        """Whether the segments of a block are due."""
        return self._receiver is not None and not self._failed

    def overdue(self) -> bytes | None:
        """The message that asks again for the rest of a block that does not come; None when only `abort` is left.

        It is for a line that fell silent: what is still on its way would come twice.
        """
        if self._receiver is None or self._failed:
            return None
        message = self._receiver.overdue(self.block_size)
        return None if message is None else sdo_block.encode(message)

    def _on_refused(self, message: sdo.Abort) -> bytes | None:
        if message.code != AbortCode.COMMAND_SPECIFIER or self._plain_request is None:
            return self._on_abort(message)
        self._go_on_plainly()
        return self._plain_request

    def _on_switched(self, message: sdo.UploadInitiated) -> bytes | None:
        self._go_on_plainly()
        return self._on_initiated(message)

    def _go_on_plainly(self) -> None:
        self._decode = sdo.decode_response
        self._await(sdo.UploadInitiated, self._on_initiated)

    def _on_offer(self, block_size: int, message: sdo_block.SenderInitiate) -> bytes:
        if message.size is not None and message.size > self._max_bytes:
            self._give_up(AbortCode.OUT_OF_MEMORY)
        crc = self._crc and message.crc
        self._receiver = receiver = BlockReceiver(block_size, size=message.size, crc=crc, max_bytes=self._max_bytes)
        self._decode = sdo_block.decode_segment
        self._await(sdo_block.Segment, partial(self._on_block_segment, receiver))
        return sdo_block.encode(sdo_block.Start())

    def _on_block_segment(self, receiver: BlockReceiver, message: sdo_block.Segment) -> bytes | None:
        skipped = receiver.skipped
        acknowledge = receiver.take(message, self.block_size)
        self.ignored += receiver.skipped - skipped
        if receiver.complete:
            self._receiver = None
            self._decode = sdo_block.decode_response
            self._await(sdo_block.End, partial(self._on_end, receiver))
        return None if acknowledge is None else sdo_block.encode(acknowledge)

    def _on_end(self, receiver: BlockReceiver, message: sdo_block.End) -> bytes:
        self._buffer[:] = receiver.finish(message)
        self.done = True
        return sdo_block.encode(sdo_block.Ended())


class SdoBlockDownload(SdoDownload):
    """Writes one object in blocks."""

    def __init__(
        self,
        index: int,
        subindex: int,
        data: bytes,
        *,
        indicate_size: bool = True,
        crc: bool = True,
        fall_back: bool = False,
    ) -> None:
        """A download whose request is still to be sent.

        Args:
            index: The object.
            subindex: Its sub-index.
            data: What to write.
            indicate_size: Whether to announce the length.
            crc: Whether to form the check sum; it is used if the server wants it.
            fall_back: Whether a plain download will do if the server has no block download.

        Raises:
            ValueError: No object has such an index or sub-index.
        """
        super().__init__(index, subindex, data)
        self._crc = crc
        self._plain_request = self.request if fall_back else None
        size = len(data) if indicate_size else None
        self.request = sdo_block.encode(sdo_block.SenderInitiate(index, subindex, crc, size))
        self._decode = sdo_block.decode_response
        self._awaited = {sdo_block.ReceiverInitiate: self._on_accepted, sdo.Abort: self._on_refused}

    def _on_refused(self, message: sdo.Abort) -> bytes | None:
        if message.code != AbortCode.COMMAND_SPECIFIER or self._plain_request is None:
            return self._on_abort(message)
        self._decode = sdo.decode_response
        self._await(sdo.DownloadInitiated, self._on_initiated)
        return self._plain_request

    def _on_accepted(self, message: sdo_block.ReceiverInitiate) -> bytes:
        sender = BlockSender(self._data, crc=self._crc and message.crc)
        self._await(sdo_block.Acknowledge, partial(self._on_acknowledged, sender))
        return self._burst(sender.block(message.block_size))

    def _on_acknowledged(self, sender: BlockSender, message: sdo_block.Acknowledge) -> bytes:
        answer = sender.answer(message)
        if sender.ended:
            self._await(sdo_block.Ended, self._on_ended)
        return self._burst(answer)

    def _on_ended(self, _message: sdo_block.Ended) -> None:
        self.done = True
