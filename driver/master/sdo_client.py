"""The client's side of an SDO transfer as a stepped machine: bytes in, bytes out, no waiting (CiA 301, 7.2.4.3).

    upload = SdoUpload(0x1018, 1)
    send(upload.request)
    while not upload.done:
        answer = upload.step(receive())
        if answer is not None:
            send(answer)

Time is the caller's: it decides how long to wait, and says goodbye with `abort`. When `step` raises because the server
is wrong, the server still has to be told: `farewell` holds that message.
"""

from typing import Final

from torquerig.driver.master.sdo_transfer import SdoTransfer
from torquerig.driver.wire import sdo
from torquerig.driver.wire.sdo import AbortCode

MAX_BYTES: Final = 1 << 20  # far above any object of a drive: a bound against a server that never ends


class SdoUpload(SdoTransfer):
    """Reads one object.

    Attributes:
        result: The object's bytes; complete once `done`.
        size_indicated: False after an expedited answer that left its length open: then `result` has 4 bytes, of which
            the object's type says how many count.
    """

    def __init__(self, index: int, subindex: int, *, max_bytes: int = MAX_BYTES) -> None:
        super().__init__(index, subindex, sdo.encode(sdo.UploadInitiate(index, subindex)))
        self.size_indicated = True
        self._buffer = bytearray()
        self._size: int | None = None
        self._max_bytes = max_bytes
        self._await(sdo.UploadInitiated, self._on_initiated)

    @property
    def result(self) -> bytes:
        """The bytes received so far."""
        return bytes(self._buffer)

    def _on_initiated(self, message: sdo.UploadInitiated) -> bytes | None:
        if message.data is not None:
            self._buffer += message.data
            self.size_indicated = message.size is not None
            self.done = True
            return None
        self._size = message.size
        if self._size is not None and self._size > self._max_bytes:
            self._give_up(AbortCode.OUT_OF_MEMORY)
        self._await(sdo.SegmentUploaded, self._on_segment)
        return sdo.encode(sdo.UploadSegment(self._toggle))

    def _on_segment(self, message: sdo.SegmentUploaded) -> bytes | None:
        self._check_toggle(toggle=message.toggle)
        self._buffer += message.data
        if self._size is not None and len(self._buffer) > self._size:
            self._give_up(AbortCode.TOO_LONG)
        if len(self._buffer) > self._max_bytes:
            self._give_up(AbortCode.OUT_OF_MEMORY)
        if not message.last:
            if not message.data:  # a server that goes on like this would never end
                self._give_up(AbortCode.GENERAL)
            return sdo.encode(sdo.UploadSegment(self._toggle))
        if self._size is not None and len(self._buffer) < self._size:
            self._give_up(AbortCode.TOO_SHORT)
        self.done = True
        return None


class SdoDownload(SdoTransfer):
    """Writes one object: expedited with 1 to 4 bytes, else in segments with the size announced."""

    def __init__(self, index: int, subindex: int, data: bytes) -> None:
        self._expedited = 1 <= len(data) <= sdo.EXPEDITED_LENGTH
        first = sdo.DownloadInitiate(index, subindex, bytes(data) if self._expedited else None, len(data))
        super().__init__(index, subindex, sdo.encode(first))
        self._data = bytes(data)
        self._position = 0
        self._await(sdo.DownloadInitiated, self._on_initiated)

    def _on_initiated(self, _message: sdo.DownloadInitiated) -> bytes | None:
        if self._expedited:
            self.done = True
            return None
        self._await(sdo.SegmentDownloaded, self._on_segment)
        return self._next_segment()

    def _on_segment(self, message: sdo.SegmentDownloaded) -> bytes | None:
        self._check_toggle(toggle=message.toggle)
        if self._position >= len(self._data):
            self.done = True
            return None
        return self._next_segment()

    def _next_segment(self) -> bytes:
        piece = self._data[self._position : self._position + sdo.SEGMENT_LENGTH]
        self._position += len(piece)
        return sdo.encode(sdo.DownloadSegment(self._toggle, piece, last=self._position >= len(self._data)))
