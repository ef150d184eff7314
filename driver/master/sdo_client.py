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

from collections.abc import Callable, Mapping
from typing import Any, Final, NoReturn

from torquerig.driver.wire import sdo
from torquerig.driver.wire.sdo import AbortCode, SdoAbort

MAX_BYTES: Final = 1 << 20  # far above any object of a drive: a bound against a server that never ends

_NOBODY: Final = (0, 0)  # the multiplexer of an abort from a server that did not even know what it was asked


class _Transfer:
    """What both directions share: the message owed, and which answers count.

    Attributes:
        index: The object.
        subindex: Its sub-index.
        request: The message to send first, and after each step the one sent last.
        farewell: The abort message owed to the server after this side gave up, else None.
        done: The transfer ended well.
        ignored: Answers that belong to no step of this transfer: late ones to an earlier transfer, or another client's.
    """

    def __init__(self, index: int, subindex: int, request: bytes) -> None:
        self.index = index
        self.subindex = subindex
        self.request = request
        self.farewell: bytes | None = None
        self.done = False
        self.ignored = 0
        self._failed = False
        self._toggle = False
        self._awaited: Mapping[type, Callable[[Any], bytes | None]] = {}

    def step(self, response: bytes) -> bytes | None:
        """The next request; None when the transfer is done, and also when the response was not for it.

        CiA 301 leaves open what a client does with an answer for another object or of another kind: it is counted in
        `ignored` and changes nothing, so that a late answer to a transfer that timed out cannot end this one.

        Args:
            response: The server's 8 bytes.

        Raises:
            SdoAbort: The server aborted, or broke the protocol; then `farewell` is owed to it.
        """
        message = sdo.decode_response(response)
        if self.done or self._failed or message is None:
            self.ignored += 1
            return None
        if isinstance(message, sdo.Unsupported):
            self._give_up(AbortCode.COMMAND_SPECIFIER)
        answer = self._awaited.get(type(message))
        if answer is None or self._is_foreign(message):
            self.ignored += 1
            return None
        request = answer(message)
        if request is not None:
            self.request = request
        return request

    def abort(self, code: AbortCode = AbortCode.TIMEOUT) -> bytes:
        """Ends the transfer and returns the abort message to send; for a caller whose patience is at its end."""
        self._failed = True
        self.farewell = sdo.encode(sdo.Abort(self.index, self.subindex, code))
        return self.farewell

    def _on_abort(self, message: sdo.Abort) -> NoReturn:
        self._failed = True
        raise SdoAbort(message.code, self.index, self.subindex)

    def _give_up(self, code: AbortCode) -> NoReturn:
        self.abort(code)
        raise SdoAbort(code, self.index, self.subindex)

    def _is_foreign(self, message: sdo.Response) -> bool:
        """Whether the message names another object; segments name none, and an abort may name nobody."""
        if isinstance(message, sdo.SegmentUploaded | sdo.SegmentDownloaded):
            return False
        named = (message.index, message.subindex)
        return named != (self.index, self.subindex) and not (isinstance(message, sdo.Abort) and named == _NOBODY)

    def _await(self, kind: type, answer: Callable[[Any], bytes | None]) -> None:
        """Makes one kind of message the next that counts; an abort always does."""
        self._awaited = {kind: answer, sdo.Abort: self._on_abort}

    def _check_toggle(self, *, toggle: bool) -> None:
        if toggle != self._toggle:
            self._give_up(AbortCode.TOGGLE)
        self._toggle = not self._toggle


class SdoUpload(_Transfer):
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


class SdoDownload(_Transfer):
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
