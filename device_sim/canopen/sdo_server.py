"""The server's side of the SDO protocol: a request in, the response out (CiA 301, 7.2.4.3).

Transfers are expedited, segmented or in blocks. One transfer is under way at most: a new initiate replaces it, an abort
from either side ends it. Only the segments of a block download cannot be told from an initiate, so that in their midst
nothing but an abort, or the time that `overdue` is told of, ends the transfer.
"""

from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol, TypeVar

from torquerig.device_sim.canopen.sdo_block_server import BlockDownload, BlockUpload, RestOfBlock
from torquerig.device_sim.canopen.sdo_segmented_server import SegmentedDownload, SegmentedUpload
from torquerig.driver.wire import sdo, sdo_block
from torquerig.driver.wire.sdo import AbortCode, SdoAbort
from torquerig.driver.wire.sdo_block_transfer import BlockReceiver, BlockSender

MAX_BYTES: Final = 4096

_Answer = sdo.Response | sdo_block.Message
_Transfer = SegmentedUpload | SegmentedDownload | BlockUpload | BlockDownload
_Kind = TypeVar("_Kind", SegmentedUpload, SegmentedDownload, BlockUpload, BlockDownload)


class ObjectAccess(Protocol):
    """The object dictionary as the server sees it."""

    def read(self, index: int, subindex: int) -> bytes:
        """The object's bytes.

        Raises:
            SdoAbort: It cannot be read; the code says why.
        """
        ...

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Writes the object.

        Raises:
            SdoAbort: It cannot be written so; the code says why.
        """
        ...


class SdoServer:
    """Serves one object dictionary over one SDO channel.

    Attributes:
        pending: What to send after the response that `handle` gave, in this order: the rest of a block, at most 126
            segments; the next request replaces it.
        block_size: Segments in a block of a download; a change goes with the next acknowledgement.
        malformed: Requests that had not 8 bytes; they get no answer.
        skipped: Segments of blocks that were not taken: out of sequence, or after one that was.
        refused: Requests that were answered with an abort.
        aborted: Transfers that the client aborted.
    """

    def __init__(
        self,
        access: ObjectAccess,
        *,
        size_of: Callable[[int, int], int | None] | None = None,
        max_bytes: int = MAX_BYTES,
        block_size: int = sdo_block.MAX_BLOCK_SIZE,
        crc: bool = True,
    ) -> None:
        """A server without a transfer.

        Args:
            access: The object dictionary.
            size_of: Gives an object's fixed length [byte], or None; needed to read the expedited downloads of clients
                that leave their size open, which are taken as 4 bytes otherwise.
            max_bytes: Longest segmented or block download that is held.
            block_size: Segments in a block of a download, 1 to 127.
            crc: Whether the check sum of block transfers can be formed.

        Raises:
            ValueError: The block size is out of its range.
        """
        self.pending: tuple[bytes, ...] = ()
        self.block_size = sdo_block.check_block_size(block_size)
        self.malformed = 0
        self.skipped = 0
        self.refused = 0
        self.aborted = 0
        self._access = access
        self._size_of = size_of
        self._max_bytes = max_bytes
        self._crc = crc
        self._transfer: _Transfer | None = None
        self._rest: RestOfBlock | None = None
        self._answers = self._answer_table()

    @property
    def receiving(self) -> bool:
        """Whether segments of a block download are due, and nothing else."""
        return isinstance(self._transfer, BlockDownload) and not self._transfer.receiver.complete

    def handle(self, data: bytes) -> bytes | None:
        """The response to a request, of which the rest may be `pending`.

        None when no response is due: after an abort, in the midst of a block, at the end of a block upload, or when the
        request is malformed.
        """
        self.pending = ()
        if self._rest is not None:
            if self._rest.goes_on(data):
                self.skipped += 1
                return None
            self._rest = None
        request = (sdo_block.decode_segment if self.receiving else sdo_block.decode_request)(data)
        if request is None:
            self.malformed += 1
            return None
        index, subindex = self._object_of(request)
        try:
            response = self._answers[type(request)](request)
        except SdoAbort as abort:
            if isinstance(request, sdo_block.Segment) and isinstance(self._transfer, BlockDownload):
                self._rest = RestOfBlock(request, self._transfer.receiver.block_size)
            self._transfer = None
            self.refused += 1
            response = sdo.Abort(index, subindex, abort.code)
        return None if response is None else sdo_block.encode(response)

    def overdue(self) -> bytes | None:
        """What to send when the client has been silent for long while the server is `receiving`, else None.

        It asks for the rest of the block; when that would not help, it aborts the transfer.
        """
        transfer = self._transfer
        if not isinstance(transfer, BlockDownload) or transfer.receiver.complete:
            return None
        acknowledge = transfer.receiver.overdue(self.block_size)
        if acknowledge is not None:
            return sdo_block.encode(acknowledge)
        self._transfer = None
        return sdo.encode(sdo.Abort(transfer.index, transfer.subindex, AbortCode.TIMEOUT))

    def reset(self) -> None:
        """Forgets the transfer under way, as an NMT reset or stop does."""
        self._transfer = self._rest = None
        self.pending = ()

    def _answer_table(self) -> Mapping[type, Callable[[Any], _Answer | None]]:
        return {
            sdo.UploadInitiate: self._initiate_upload,
            sdo.UploadSegment: self._upload_segment,
            sdo.DownloadInitiate: self._initiate_download,
            sdo.DownloadSegment: self._download_segment,
            sdo_block.ReceiverInitiate: self._initiate_block_upload,
            sdo_block.Start: self._go_on_with_block_upload,
            sdo_block.Acknowledge: self._go_on_with_block_upload,
            sdo_block.Ended: self._end_block_upload,
            sdo_block.SenderInitiate: self._initiate_block_download,
            sdo_block.Segment: self._take_block_segment,
            sdo_block.End: self._end_block_download,
            sdo.Abort: self._end,
            sdo.Unsupported: self._refuse,
        }

    def _object_of(self, request: sdo_block.Request | sdo_block.Segment | sdo.Unsupported) -> tuple[int, int]:
        """The object that an abort has to name: the request's, else that of the transfer, else 0000:0."""
        named = sdo_block.named_object(request)
        if named is not None:
            return named
        return (0, 0) if self._transfer is None else (self._transfer.index, self._transfer.subindex)

    def _initiate_upload(self, request: sdo.UploadInitiate) -> _Answer:
        self._transfer = None
        return self._begin_upload(request, self._access.read(request.index, request.subindex))

    def _begin_upload(self, request: sdo.UploadInitiate | sdo_block.ReceiverInitiate, data: bytes) -> _Answer:
        if 1 <= len(data) <= sdo.EXPEDITED_LENGTH:
            return sdo.UploadInitiated(request.index, request.subindex, data, len(data))
        self._transfer = SegmentedUpload(request.index, request.subindex, data)
        return sdo.UploadInitiated(request.index, request.subindex, None, len(data))

    def _upload_segment(self, request: sdo.UploadSegment) -> _Answer:
        segment = self._under_way(SegmentedUpload).next(request)
        if segment.last:
            self._transfer = None
        return segment

    def _initiate_download(self, request: sdo.DownloadInitiate) -> _Answer:
        self._transfer = None
        if request.data is not None:
            self._access.write(request.index, request.subindex, self._expedited_data(request, request.data))
        else:
            self._check_size(request.size)
            self._transfer = SegmentedDownload(request.index, request.subindex, request.size, self._max_bytes)
        return sdo.DownloadInitiated(request.index, request.subindex)

    def _expedited_data(self, request: sdo.DownloadInitiate, data: bytes) -> bytes:
        """The data that count: all, unless the client left their number open and the object's type knows it."""
        if request.size is not None or self._size_of is None:
            return data
        return data[: self._size_of(request.index, request.subindex)]

    def _download_segment(self, request: sdo.DownloadSegment) -> _Answer:
        transfer = self._under_way(SegmentedDownload)
        data = transfer.take(request)
        if data is not None:
            self._transfer = None
            self._access.write(transfer.index, transfer.subindex, data)
        return sdo.SegmentDownloaded(request.toggle)

    def _initiate_block_upload(self, request: sdo_block.ReceiverInitiate) -> _Answer:
        self._transfer = None
        if not 1 <= request.block_size <= sdo_block.MAX_BLOCK_SIZE:
            raise SdoAbort(AbortCode.BLOCK_SIZE)
        data = self._access.read(request.index, request.subindex)
        if request.switch_threshold > 0 and len(data) <= request.switch_threshold:
            return self._begin_upload(request, data)
        crc = self._offers_crc(request)
        self._transfer = BlockUpload(request, BlockSender(data, crc=crc))
        return sdo_block.SenderInitiate(request.index, request.subindex, crc, len(data))

    def _go_on_with_block_upload(self, request: sdo_block.Start | sdo_block.Acknowledge) -> _Answer:
        first, *rest = self._under_way(BlockUpload).answer(request)
        self.pending = tuple(map(sdo_block.encode, rest))
        return first

    def _end_block_upload(self, request: sdo_block.Ended) -> None:
        self._under_way(BlockUpload).end(request)
        self._transfer = None

    def _initiate_block_download(self, request: sdo_block.SenderInitiate) -> _Answer:
        self._transfer = None
        self._check_size(request.size)
        crc = self._offers_crc(request)
        receiver = BlockReceiver(self.block_size, size=request.size, crc=crc, max_bytes=self._max_bytes)
        self._transfer = BlockDownload(request, receiver)
        return sdo_block.ReceiverInitiate(request.index, request.subindex, crc, self.block_size)

    def _offers_crc(self, request: sdo_block.ReceiverInitiate | sdo_block.SenderInitiate) -> bool:
        """Whether to offer the check sum: not to a client without, for some take the offer alone for the agreement."""
        return self._crc and request.crc

    def _take_block_segment(self, segment: sdo_block.Segment) -> _Answer | None:
        receiver = self._under_way(BlockDownload).receiver
        skipped = receiver.skipped
        acknowledge = receiver.take(segment, self.block_size)
        self.skipped += receiver.skipped - skipped
        return acknowledge

    def _end_block_download(self, request: sdo_block.End) -> _Answer:
        transfer = self._under_way(BlockDownload)
        self._transfer = None
        self._access.write(transfer.index, transfer.subindex, transfer.receiver.finish(request))
        return sdo_block.Ended()

    def _under_way(self, kind: type[_Kind]) -> _Kind:
        """The transfer under way, which has to be of this kind.

        Raises:
            SdoAbort: It is not.
        """
        if not isinstance(self._transfer, kind):
            raise SdoAbort(AbortCode.COMMAND_SPECIFIER)
        return self._transfer

    def _check_size(self, size: int | None) -> None:
        if size is not None and size > self._max_bytes:
            raise SdoAbort(AbortCode.OUT_OF_MEMORY)

    def _end(self, _request: sdo.Abort) -> None:
        self.aborted += self._transfer is not None
        self._transfer = None

    def _refuse(self, _request: sdo.Unsupported) -> _Answer:
        raise SdoAbort(AbortCode.COMMAND_SPECIFIER)
