"""Segmented transfers that an SDO server has under way (CiA 301, 7.2.4.3.4 and 7.2.4.3.7)."""

from torquerig.driver.wire import sdo
from torquerig.driver.wire.sdo import AbortCode, SdoAbort


class SegmentedUpload:
    """A segmented upload under way: what is left to send."""

    def __init__(self, index: int, subindex: int, data: bytes) -> None:
        self.index = index
        self.subindex = subindex
        self._rest = memoryview(data)
        self._toggle = False

    def next(self, request: sdo.UploadSegment) -> sdo.SegmentUploaded:
        """The next segment.

        Raises:
            SdoAbort: The toggle bit does not alternate.
        """
        _check_toggle(request.toggle, self._toggle)
        self._toggle = not self._toggle
        piece, self._rest = self._rest[: sdo.SEGMENT_LENGTH], self._rest[sdo.SEGMENT_LENGTH :]
        return sdo.SegmentUploaded(request.toggle, bytes(piece), last=not self._rest)


class SegmentedDownload:
    """A segmented download under way: what has come."""

    def __init__(self, index: int, subindex: int, size: int | None, max_bytes: int) -> None:
        self.index = index
        self.subindex = subindex
        self._size = size
        self._max_bytes = max_bytes
        self._buffer = bytearray()
        self._toggle = False

    def take(self, request: sdo.DownloadSegment) -> bytes | None:
        """Takes a segment; all the data after the last one, else None.

        Raises:
            SdoAbort: The toggle bit does not alternate, or the data have not the announced length, or are too long.
        """
        _check_toggle(request.toggle, self._toggle)
        self._toggle = not self._toggle
        received = len(self._buffer) + len(request.data)
        if self._size is not None and received > self._size:
            raise SdoAbort(AbortCode.TOO_LONG)
        if received > self._max_bytes:
            raise SdoAbort(AbortCode.OUT_OF_MEMORY)
        self._buffer += request.data
        if not request.last:
            return None
        if self._size is not None and received < self._size:
            raise SdoAbort(AbortCode.TOO_SHORT)
        return bytes(self._buffer)


def _check_toggle(toggle: bool, due: bool) -> None:  # noqa: FBT001 - the bit itself
    if toggle != due:
        raise SdoAbort(AbortCode.TOGGLE)
