"""What all SDO transfers of a client share: the message owed, which answers count, and how a transfer ends."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NoReturn

from torquerig.driver.wire import sdo, sdo_block
from torquerig.driver.wire.sdo import AbortCode, SdoAbort

_NOBODY: Final = (0, 0)  # the multiplexer of an abort from a server that did not even know what it was asked

Answer = Callable[[Any], bytes | None]
Incoming = sdo_block.Response | sdo_block.Segment | sdo.Unsupported


class SdoTransfer:
    """One transfer as a stepped machine: bytes in, bytes out, no waiting.

    Attributes:
        index: The object.
        subindex: Its sub-index.
        request: The message to send first, and after each step the first one that it gave.
        pending: What to send after the message that the last step gave, in this order: the rest of a block; the next
            step replaces it.
        farewell: The abort message owed to the server after this side gave up, else None.
        done: The transfer ended well.
        ignored: Answers that belong to no step of this transfer: late ones to an earlier transfer, or another client's.
    """

    def __init__(self, index: int, subindex: int, request: bytes) -> None:
        self.index = index
        self.subindex = subindex
        self.request = request
        self.pending: tuple[bytes, ...] = ()
        self.farewell: bytes | None = None
        self.done = False
        self.ignored = 0
        self._failed = False
        self._toggle = False
        self._awaited: Mapping[type, Answer] = {}
        self._decode: Callable[[bytes], Incoming | None] = sdo.decode_response

    def step(self, response: bytes) -> bytes | None:
        """The next request; None when there is none, and also when the response was not for this transfer.

        CiA 301 leaves open what a client does with an answer for another object or of another kind: it is counted in
        `ignored` and changes nothing, so that a late answer to a transfer that timed out cannot end this one.

        Args:
            response: The server's 8 bytes.

        Raises:
            SdoAbort: The server aborted, or broke the protocol; then `farewell` is owed to it.
        """
        self.pending = ()
        message = self._decode(response)
        if self.done or self._failed or message is None:
            self.ignored += 1
            return None
        if isinstance(message, sdo.Unsupported):
            self._give_up(AbortCode.COMMAND_SPECIFIER)
        answer = self._awaited.get(type(message))
        if answer is None or self._is_foreign(message):
            self.ignored += 1
            return None
        try:
            request = answer(message)
        except SdoAbort as abort:
            if self._failed:
                raise
            self._give_up(abort.code)
        if request is not None:
            self.request = request
        return request

    def abort(self, code: int = AbortCode.TIMEOUT) -> bytes:
        """Ends the transfer and returns the abort message to send; for a caller whose patience is at its end."""
        self._failed = True
        self.pending = ()
        self.farewell = sdo.encode(sdo.Abort(self.index, self.subindex, code))
        return self.farewell

    def _on_abort(self, message: sdo.Abort) -> bytes | None:
        self._failed = True
        raise SdoAbort(message.code, self.index, self.subindex)

    def _give_up(self, code: int) -> NoReturn:
        self.abort(code)
        raise SdoAbort(code, self.index, self.subindex)

    def _is_foreign(self, message: Incoming) -> bool:
        """Whether the message names another object; segments name none, and an abort may name nobody."""
        named = sdo_block.named_object(message)
        if named is None or (isinstance(message, sdo.Abort) and named == _NOBODY):
            return False
        return named != (self.index, self.subindex)

    def _await(self, kind: type, answer: Answer) -> None:
        """Makes one kind of message the next that counts; an abort always does."""
        self._awaited = {kind: answer, sdo.Abort: self._on_abort}

    def _check_toggle(self, *, toggle: bool) -> None:
        if toggle != self._toggle:
            self._give_up(AbortCode.TOGGLE)
        self._toggle = not self._toggle

    def _burst(self, messages: Sequence[sdo_block.Message]) -> bytes:
        """The first of several messages; the others become pending."""
        first, *rest = map(sdo_block.encode, messages)
        self.pending = tuple(rest)
        return first
