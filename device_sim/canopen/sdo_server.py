"""The server's side of the SDO protocol: a request in, the response out (CiA 301, 7.2.4.3).

Transfers are expedited or segmented; block transfer is refused with 0504 0001. One transfer is under way at most: a new
initiate replaces it, an abort from either side ends it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

from torquerig.driver.wire import sdo
from torquerig.driver.wire.sdo import AbortCode, SdoAbort

MAX_BYTES: Final = 4096


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


@dataclass(slots=True)
class _Upload:
    """A segmented upload under way: what is left to send."""

    index: int
    subindex: int
    rest: memoryview
    toggle: bool = False


@dataclass(slots=True)
class _Download:
    """A segmented download under way: what has come."""

    index: int
    subindex: int
    size: int | None
    buffer: bytearray = field(default_factory=bytearray)
    toggle: bool = False


class SdoServer:
    """Serves one object dictionary over one SDO channel.

    Attributes:
        malformed: Requests that had not 8 bytes; they get no answer.
        aborted: Transfers that the client aborted.
    """

    def __init__(
        self,
        access: ObjectAccess,
        *,
        size_of: Callable[[int, int], int | None] | None = None,
        max_bytes: int = MAX_BYTES,
    ) -> None:
        """A server without a transfer.

        Args:
            access: The object dictionary.
            size_of: Gives an object's fixed length [byte], or None; needed to read the expedited downloads of clients
                that leave their size open, which are taken as 4 bytes otherwise.
            max_bytes: Longest segmented download that is held.
        """
        self.malformed = 0
        self.aborted = 0
        self._access = access
        self._size_of = size_of
        self._max_bytes = max_bytes
        self._transfer: _Upload | _Download | None = None
        self._answers: Mapping[type, Callable[[Any], sdo.Response | None]] = {
            sdo.UploadInitiate: self._initiate_upload,
            sdo.UploadSegment: self._upload_segment,
            sdo.DownloadInitiate: self._initiate_download,
            sdo.DownloadSegment: self._download_segment,
            sdo.Abort: self._end,
            sdo.Unsupported: self._refuse,
        }

    def handle(self, data: bytes) -> bytes | None:
        """The response to a request; None when none is due: after an abort, or when the request is malformed."""
        request = sdo.decode_request(data)
        if request is None:
            self.malformed += 1
            return None
        index, subindex = self._object_of(request)
        try:
            response = self._answers[type(request)](request)
        except SdoAbort as abort:
            self._transfer = None
            response = sdo.Abort(index, subindex, abort.code)
        return None if response is None else sdo.encode(response)

    def reset(self) -> None:
        """Forgets the transfer under way, as an NMT reset or stop does."""
        self._transfer = None

    def _object_of(self, request: sdo.Request | sdo.Unsupported) -> tuple[int, int]:
        """The object that an abort has to name: the request's, else that of the transfer, else 0000:0."""
        named = self._transfer if isinstance(request, sdo.UploadSegment | sdo.DownloadSegment) else request
        return (0, 0) if named is None else (named.index, named.subindex)

    def _initiate_upload(self, request: sdo.UploadInitiate) -> sdo.Response:
        self._transfer = None
        data = self._access.read(request.index, request.subindex)
        if 1 <= len(data) <= sdo.EXPEDITED_LENGTH:
            return sdo.UploadInitiated(request.index, request.subindex, data, len(data))
        self._transfer = _Upload(request.index, request.subindex, memoryview(data))
        return sdo.UploadInitiated(request.index, request.subindex, None, len(data))

    def _upload_segment(self, request: sdo.UploadSegment) -> sdo.Response:
        transfer = self._transfer
        if not isinstance(transfer, _Upload):
            raise SdoAbort(AbortCode.COMMAND_SPECIFIER)
        _alternate(transfer, toggle=request.toggle)
        piece, transfer.rest = transfer.rest[: sdo.SEGMENT_LENGTH], transfer.rest[sdo.SEGMENT_LENGTH :]
        last = not transfer.rest
        if last:
            self._transfer = None
        return sdo.SegmentUploaded(request.toggle, bytes(piece), last)

    def _initiate_download(self, request: sdo.DownloadInitiate) -> sdo.Response:
        self._transfer = None
        if request.data is not None:
            self._access.write(request.index, request.subindex, self._expedited_data(request, request.data))
        elif request.size is not None and request.size > self._max_bytes:
            raise SdoAbort(AbortCode.OUT_OF_MEMORY)
        else:
            self._transfer = _Download(request.index, request.subindex, request.size)
        return sdo.DownloadInitiated(request.index, request.subindex)

    def _expedited_data(self, request: sdo.DownloadInitiate, data: bytes) -> bytes:
        """The data that count: all, unless the client left their number open and the object's type knows it."""
        if request.size is not None or self._size_of is None:
            return data
        return data[: self._size_of(request.index, request.subindex)]

    def _download_segment(self, request: sdo.DownloadSegment) -> sdo.Response:
        transfer = self._transfer
        if not isinstance(transfer, _Download):
            raise SdoAbort(AbortCode.COMMAND_SPECIFIER)
        _alternate(transfer, toggle=request.toggle)
        received = len(transfer.buffer) + len(request.data)
        if transfer.size is not None and received > transfer.size:
            raise SdoAbort(AbortCode.TOO_LONG)
        if received > self._max_bytes:
            raise SdoAbort(AbortCode.OUT_OF_MEMORY)
        transfer.buffer += request.data
        if request.last:
            if transfer.size is not None and received < transfer.size:
                raise SdoAbort(AbortCode.TOO_SHORT)
            self._transfer = None
            self._access.write(transfer.index, transfer.subindex, bytes(transfer.buffer))
        return sdo.SegmentDownloaded(request.toggle)

    def _end(self, _request: sdo.Abort) -> None:
        self.aborted += self._transfer is not None
        self._transfer = None

    def _refuse(self, _request: sdo.Unsupported) -> sdo.Response:
        raise SdoAbort(AbortCode.COMMAND_SPECIFIER)


def _alternate(transfer: _Upload | _Download, *, toggle: bool) -> None:
    """Checks the toggle bit of a segment and turns it for the next.

    Raises:
        SdoAbort: It is not the one that was due.
    """
    if toggle != transfer.toggle:
        raise SdoAbort(AbortCode.TOGGLE)
    transfer.toggle = not transfer.toggle
