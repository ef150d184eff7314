"""The SDO machines of client and server against each other, with messages lost, doubled, spoilt and invented between.

Both are sans I/O, so they meet here what no bus would let through: messages of any length, at any time.
"""

from collections import Counter, deque
from collections.abc import Callable, Sequence
from typing import Final

from fuzz_log import MICROSECOND, Timed
from fuzz_memory import footprint
from fuzz_source import Source, choose, in_one_of

from torquerig.device_sim.canopen.sdo_server import SdoServer
from torquerig.driver.master.sdo_block_client import SdoBlockDownload, SdoBlockUpload
from torquerig.driver.master.sdo_client import SdoDownload, SdoUpload
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sdo import AbortCode, SdoAbort

Client = SdoUpload | SdoDownload | SdoBlockUpload | SdoBlockDownload
OBJECT: Final = (0x2000, 1)
LONGEST: Final = 400  # messages of one transfer, after which nobody says anything any more
BUFFERS: Final = 3_000  # elements and bytes that client and server may hold together
_MAX_BYTES: Final = 1000
_LENGTHS: Final = (0, 1, 4, 5, 7, 8, 14, 100, 889, 890, _MAX_BYTES)


class Shelf:
    """One object; any other does not exist."""

    def __init__(self, value: bytes) -> None:
        self.value = value

    def read(self, index: int, subindex: int) -> bytes:
        """Its bytes."""
        if (index, subindex) != OBJECT:
            raise SdoAbort(AbortCode.NO_OBJECT, index, subindex)
        return self.value

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Hold others."""
        if (index, subindex) != OBJECT:
            raise SdoAbort(AbortCode.NO_OBJECT, index, subindex)
        self.value = data


class SdoTarget:
    """Clients, one after the other, of one server that never forgets what a client before did to it.

    Attributes:
        messages: How many the machines were given.
        log: The messages of the last transfer as frames, one a microsecond: to be read, for no bus carried them.
        outcomes: How the transfers ended.
    """

    def __init__(self, source: Source) -> None:
        self.messages = 0
        self.log: list[Timed] = []
        self.outcomes: Counter[str] = Counter()
        self._source = source
        self._shelf = Shelf(b"")
        self._server = SdoServer(self._shelf, size_of=lambda *_: None, max_bytes=_MAX_BYTES)
        self._harm = 0

    def session(self) -> None:
        """One transfer; if nobody disturbed it, it does what it should."""
        source = self._source
        self._harm = choose(source, (0, 0, 2, 5, 20))
        data = source.octets(choose(source, _LENGTHS))
        before = self._shelf.value
        client = choose(source, _CLIENTS)(source, data)
        self.log.clear()
        outcome = self._transfer(client)
        self.outcomes["done" if client.done else "silent" if outcome is None else "aborted"] += 1
        if not self._harm:
            assert client.done, f"{client} failed undisturbed: {outcome}"
            assert self._shelf.value == (before if isinstance(client, SdoUpload) else data)
            assert not isinstance(client, SdoUpload) or client.result[: len(before)] == before
        assert footprint((client, self._server)).elements <= BUFFERS + len(data) + len(before)
        self._server.handle(client.abort())  # so that the next one begins with a server at rest

    def _transfer(self, client: Client) -> SdoAbort | None:
        to_server, to_client = deque([client.request]), deque[bytes]()
        for _ in range(LONGEST):
            if to_server:
                for request in self._harmed(0x601, to_server.popleft()):
                    to_client += self._said(self._server.handle(request), self._server.pending)
            elif to_client:
                try:
                    for response in self._harmed(0x581, to_client.popleft()):
                        to_server += self._said(self._step(client, response), client.pending)
                except SdoAbort as abort:
                    self._step(client, self._source.octets(8))  # nothing that comes later changes anything
                    return abort
            elif message := self._server.overdue():
                to_client.append(message)
            else:
                return None
        return None

    def _step(self, client: Client, response: bytes) -> bytes | None:
        over = client.done or client.farewell is not None
        ignored = client.ignored
        request = client.step(response)
        assert not over or (request is None and client.ignored == ignored + 1), "a client that is done goes on"
        assert request is None or len(request) == 8, request
        return request

    def _said(self, first: bytes | None, more: Sequence[bytes]) -> list[bytes]:
        assert all(len(message) == 8 for message in more)
        return [] if first is None else [first, *more]

    def _harmed(self, can_id: int, message: bytes) -> list[bytes]:
        """What becomes of a message."""
        source, messages = self._source, [message]
        if self._harm and in_one_of(source, 100 // self._harm):
            spoilt = bytearray(message)
            spoilt[source.integer(0, 7)] ^= 1 << source.integer(0, 7)
            invented = source.octets(source.integer(0, 9))
            choices = ([], [message, message], [bytes(spoilt)], [invented, message], [message, invented])
            messages = choose(source, choices)
        self.messages += len(messages)
        self.log += [Timed(len(self.log) * MICROSECOND, Frame(can_id, each)) for each in messages]
        return messages


def _block_upload(source: Source, _data: bytes) -> Client:
    size, threshold = source.integer(1, 127), choose(source, (0, 0, 4, 255))
    crc, fall_back = in_one_of(source, 2), in_one_of(source, 2)
    return SdoBlockUpload(*OBJECT, block_size=size, switch_threshold=threshold, crc=crc, fall_back=fall_back)


def _block_download(source: Source, data: bytes) -> Client:
    sized, crc, fall_back = (in_one_of(source, 2) for _ in range(3))
    return SdoBlockDownload(*OBJECT, data, indicate_size=sized, crc=crc, fall_back=fall_back)


_CLIENTS: Final[tuple[Callable[[Source, bytes], Client], ...]] = (
    lambda _source, _data: SdoUpload(*OBJECT, max_bytes=_MAX_BYTES),
    lambda _source, data: SdoDownload(*OBJECT, data),
    _block_upload,
    _block_download,
)
