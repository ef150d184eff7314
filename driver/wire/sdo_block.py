"""Service data: the messages of block transfers (CiA 301, 7.2.4.3.8 to 7.2.4.3.15).

Upload and download are mirror images: whoever sends the data speaks with the specifier 6, client or server, and whoever
receives them with the specifier 5. So one set of messages serves both ways; each names the services that it is.

The segments of a block have no specifier: only who is in the midst of a block may decode them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from struct import Struct
from types import MappingProxyType
from typing import Any, Final

from torquerig.driver.wire import sdo
from torquerig.driver.wire.sdo import MESSAGE_LENGTH, SEGMENT_LENGTH, Abort, Unsupported

MAX_BLOCK_SIZE: Final = 127  # segments; their numbers have 7 bits

_SENDER: Final = 6 << 5
_RECEIVER: Final = 5 << 5
_SUBCOMMANDS: Final = MappingProxyType({6: 0x01, 5: 0x03})  # which bits of the first byte hold it
_CRC: Final = 0x04
_SIZED: Final = 0x02
_LAST: Final = 0x80
_SEQUENCE: Final = 0x7F
_ABORT: Final = 0x80  # the last segment with the number 0, which no segment has

_NUMBER: Final = Struct("<I")
_SIZES: Final = Struct("<BB2x")
_ACKNOWLEDGE: Final = Struct("<BBB5x")
_END: Final = Struct("<BH5x")


@dataclass(frozen=True, slots=True)
class SenderInitiate:
    """Initiate block download request, initiate block upload response: data are there to be sent.

    crc says whether the sender can form a check sum; size is the announced length [byte], None when not indicated.
    """

    index: int
    subindex: int
    crc: bool
    size: int | None


@dataclass(frozen=True, slots=True)
class ReceiverInitiate:
    """Initiate block upload request, initiate block download response: how data shall be sent.

    crc says whether the receiver can form a check sum; block_size is the number of segments in a block. Only in a
    request: with up to switch_threshold bytes the server may answer as to a plain upload; 0 forbids it.
    """

    index: int
    subindex: int
    crc: bool
    block_size: int
    switch_threshold: int = 0


@dataclass(frozen=True, slots=True)
class Start:
    """Second request of the initiate block upload protocol: now send."""


@dataclass(frozen=True, slots=True)
class Segment:
    """Sub-block segment: up to 7 bytes, always 7 when decoded; sequence counts from 1 in each block."""

    sequence: int
    data: bytes
    last: bool


@dataclass(frozen=True, slots=True)
class Acknowledge:
    """Sub-block response: up to which segment the block arrived, 0 for none, and the size of the next block."""

    sequence: int
    block_size: int


@dataclass(frozen=True, slots=True)
class End:
    """End block download request, end block upload response: all is sent.

    unused counts the bytes without data in the last segment; crc is 0 unless both sides can form it.
    """

    unused: int
    crc: int


@dataclass(frozen=True, slots=True)
class Ended:
    """End block upload request, end block download response: all has arrived."""


Message = SenderInitiate | ReceiverInitiate | Start | Segment | Acknowledge | End | Ended
Request = sdo.Request | SenderInitiate | ReceiverInitiate | Start | Acknowledge | End | Ended
Response = sdo.Response | SenderInitiate | ReceiverInitiate | Acknowledge | End | Ended

_NAMELESS: Final = (
    *(sdo.DownloadSegment, sdo.UploadSegment, sdo.SegmentDownloaded, sdo.SegmentUploaded),
    *(Start, Segment, Acknowledge, End, Ended),
)


def encode(message: Message | sdo.Request | sdo.Response) -> bytes:
    """The 8 bytes of a message, of any transfer.

    Raises:
        ValueError: A field does not fit its place in the message.
    """
    return _ENCODERS.get(type(message), sdo.encode)(message)


def decode_request(data: bytes) -> Request | Unsupported | None:
    """What a client says outside of a block, of any transfer; None when it is not 8 bytes long."""
    message = sdo.decode_request(data)
    return _decode(message, data, _REQUESTS) if isinstance(message, Unsupported) else message


def decode_response(data: bytes) -> Response | Unsupported | None:
    """What a server says outside of a block, of any transfer; None when it is not 8 bytes long."""
    message = sdo.decode_response(data)
    return _decode(message, data, _RESPONSES) if isinstance(message, Unsupported) else message


def decode_segment(data: bytes) -> Segment | Abort | None:
    """What the sender says in the midst of a block, where all is a segment but an abort; None when not 8 bytes long."""
    if len(data) != MESSAGE_LENGTH:
        return None
    if data[0] == _ABORT:
        return Abort(data[1] | data[2] << 8, data[3], _NUMBER.unpack_from(data, 4)[0])
    return Segment(data[0] & _SEQUENCE, bytes(data[1:]), bool(data[0] & _LAST))


def named_object(message: Request | Response | Segment | Unsupported) -> tuple[int, int] | None:
    """Index and sub-index in a message; None when its kind has no place for them."""
    if isinstance(message, _NAMELESS):
        return None
    return message.index, message.subindex


def _check(name: str, value: int, lowest: int, highest: int) -> int:
    if not lowest <= value <= highest:
        raise ValueError(f"{name} is {lowest} to {highest}, not {value}")
    return value


def check_block_size(block_size: int) -> int:
    """Returns the block size, which is 1 to 127 segments.

    Raises:
        ValueError: It is not.
    """
    return _check("a block size", block_size, 1, MAX_BLOCK_SIZE)


def _encode_sender_initiate(message: SenderInitiate) -> bytes:
    head = _SENDER | _CRC * message.crc | _SIZED * (message.size is not None)
    return _encode_named(head, message, sdo.encode_number(message.size or 0))


def _encode_receiver_initiate(message: ReceiverInitiate) -> bytes:
    threshold = _check("a protocol switch threshold", message.switch_threshold, 0, 0xFF)
    sizes = _SIZES.pack(check_block_size(message.block_size), threshold)
    return _encode_named(_RECEIVER | _CRC * message.crc, message, sizes)


def _encode_named(head: int, message: SenderInitiate | ReceiverInitiate, tail: bytes) -> bytes:
    return bytes((head,)) + sdo.encode_multiplexer(message.index, message.subindex) + tail


def _encode_segment(message: Segment) -> bytes:
    _check("the length of a segment", len(message.data), 0, SEGMENT_LENGTH)
    head = _check("a sequence number", message.sequence, 1, MAX_BLOCK_SIZE) | _LAST * message.last
    return bytes((head, *message.data)).ljust(MESSAGE_LENGTH, b"\0")


def _encode_acknowledge(message: Acknowledge) -> bytes:
    sequence = _check("an acknowledged sequence number", message.sequence, 0, MAX_BLOCK_SIZE)
    return _ACKNOWLEDGE.pack(_RECEIVER | 2, sequence, check_block_size(message.block_size))


def _encode_end(message: End) -> bytes:
    unused = _check("the number of unused bytes", message.unused, 0, SEGMENT_LENGTH)
    return _END.pack(_SENDER | unused << 2 | 1, _check("a check sum", message.crc, 0, 0xFFFF))


def _encode_bare(subcommand: int) -> bytes:
    return bytes((_RECEIVER | subcommand,)).ljust(MESSAGE_LENGTH, b"\0")


_Decoder = Callable[[Unsupported, bytes], Any]


def _decode(plain: Unsupported, data: bytes, decoders: Mapping[tuple[int, int], _Decoder]) -> Any:  # noqa: ANN401
    """The block message behind what plain transfers do not know, or that itself."""
    subcommand = data[0] & _SUBCOMMANDS.get(plain.specifier, 0)
    decoder = decoders.get((plain.specifier, subcommand))
    return plain if decoder is None else decoder(plain, data)


def _decode_sender_initiate(plain: Unsupported, data: bytes) -> SenderInitiate:
    size = _NUMBER.unpack_from(data, 4)[0] if data[0] & _SIZED else None
    return SenderInitiate(plain.index, plain.subindex, bool(data[0] & _CRC), size)


def _decode_receiver_initiate(plain: Unsupported, data: bytes) -> ReceiverInitiate:
    return ReceiverInitiate(plain.index, plain.subindex, bool(data[0] & _CRC), data[4], data[5])


_RESPONSES: Final[Mapping[tuple[int, int], _Decoder]] = MappingProxyType(
    {
        (6, 0): _decode_sender_initiate,
        (6, 1): lambda _plain, data: End(data[0] >> 2 & 7, data[1] | data[2] << 8),
        (5, 0): _decode_receiver_initiate,
        (5, 1): lambda _plain, _data: Ended(),
        (5, 2): lambda _plain, data: Acknowledge(data[1], data[2]),
    }
)
_REQUESTS: Final[Mapping[tuple[int, int], _Decoder]] = MappingProxyType(
    {**_RESPONSES, (5, 3): lambda _plain, _data: Start()}
)
_ENCODERS: Final[Mapping[type, Callable[[Any], bytes]]] = MappingProxyType(
    {
        SenderInitiate: _encode_sender_initiate,
        ReceiverInitiate: _encode_receiver_initiate,
        Start: lambda _message: _encode_bare(3),
        Segment: _encode_segment,
        Acknowledge: _encode_acknowledge,
        End: _encode_end,
        Ended: lambda _message: _encode_bare(1),
    }
)
