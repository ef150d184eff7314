"""Service data: the messages of expedited and segmented transfers, and the abort codes (CiA 301, 7.2.4).

Requests go from client to server, responses back; each direction has its own meaning of the three specifier bits.
The specifiers of block transfer (5, 6) and the reserved 7 decode to Unsupported: sdo_block knows the former, and the
latter can be refused by name.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from struct import Struct
from types import MappingProxyType
from typing import Any, Final, TypeVar

from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort, describe

__all__ = [
    "Abort",
    "AbortCode",
    "DownloadInitiate",
    "DownloadInitiated",
    "DownloadSegment",
    "Request",
    "Response",
    "SdoAbort",
    "SegmentDownloaded",
    "SegmentUploaded",
    "Unsupported",
    "UploadInitiate",
    "UploadInitiated",
    "UploadSegment",
    "decode_request",
    "decode_response",
    "describe",
    "encode",
    "encode_multiplexer",
    "encode_number",
]

MESSAGE_LENGTH: Final = 8
SEGMENT_LENGTH: Final = 7
EXPEDITED_LENGTH: Final = 4

_MULTIPLEXER: Final = Struct("<HB")
_NUMBER: Final = Struct("<I")

# the first byte: three specifier bits, and below them what the specifier needs
_SPECIFIER_SHIFT: Final = 5
_EXPEDITED: Final = 0x02
_SIZED: Final = 0x01
_TOGGLE: Final = 0x10
_LAST: Final = 0x01

_Message = TypeVar("_Message")


@dataclass(frozen=True, slots=True)
class DownloadInitiate:
    """Request (specifier 1): the client wants to write; data when expedited, else segments follow.

    size is the announced length [byte]; None when it is not indicated, and then expedited data are 4 bytes of which
    the object's type says how many count.
    """

    index: int
    subindex: int
    data: bytes | None
    size: int | None


@dataclass(frozen=True, slots=True)
class DownloadSegment:
    """Request (specifier 0): up to 7 bytes to write."""

    toggle: bool
    data: bytes
    last: bool


@dataclass(frozen=True, slots=True)
class UploadInitiate:
    """Request (specifier 2): the client wants to read."""

    index: int
    subindex: int


@dataclass(frozen=True, slots=True)
class UploadSegment:
    """Request (specifier 3): the next segment, please."""

    toggle: bool


@dataclass(frozen=True, slots=True)
class DownloadInitiated:
    """Response (specifier 3): go on writing, or written when expedited."""

    index: int
    subindex: int


@dataclass(frozen=True, slots=True)
class SegmentDownloaded:
    """Response (specifier 1): the segment was taken."""

    toggle: bool


@dataclass(frozen=True, slots=True)
class UploadInitiated:
    """Response (specifier 2): the data when expedited, else their segments are to be asked for.

    size is as in DownloadInitiate.
    """

    index: int
    subindex: int
    data: bytes | None
    size: int | None


@dataclass(frozen=True, slots=True)
class SegmentUploaded:
    """Response (specifier 0): up to 7 bytes read."""

    toggle: bool
    data: bytes
    last: bool


@dataclass(frozen=True, slots=True)
class Abort:
    """Either way (specifier 4): the transfer is over."""

    index: int
    subindex: int
    code: int


@dataclass(frozen=True, slots=True)
class Unsupported:
    """Either way: a specifier of block transfer, or the reserved one; the bytes 1 to 3 read as a multiplexer."""

    specifier: int
    index: int
    subindex: int


Request = DownloadInitiate | DownloadSegment | UploadInitiate | UploadSegment | Abort
Response = DownloadInitiated | SegmentDownloaded | UploadInitiated | SegmentUploaded | Abort


def encode(message: Request | Response) -> bytes:
    """The 8 bytes of a message.

    Raises:
        ValueError: A field does not fit its place in the message.
    """
    return _ENCODERS[type(message)](message)


def decode_request(data: bytes) -> Request | Unsupported | None:
    """What a client says, or None when it is not 8 bytes long."""
    return _decode(data, _REQUESTS)


def decode_response(data: bytes) -> Response | Unsupported | None:
    """What a server says, or None when it is not 8 bytes long."""
    return _decode(data, _RESPONSES)


def encode_multiplexer(index: int, subindex: int) -> bytes:
    """The 3 bytes that name an object.

    Raises:
        ValueError: No object has such an index or sub-index.
    """
    if not (0 <= index <= 0xFFFF and 0 <= subindex <= 0xFF):
        raise ValueError(f"no object has the index {index:#x} and sub-index {subindex:#x}")
    return _MULTIPLEXER.pack(index, subindex)


def encode_number(number: int) -> bytes:
    """The 4 bytes of a length or an abort code.

    Raises:
        ValueError: It has more than 32 bits.
    """
    if not 0 <= number <= 0xFFFFFFFF:
        raise ValueError(f"{number} does not fit the 32 bits of an SDO message")
    return _NUMBER.pack(number)


def _encode_plain(specifier: int, index: int, subindex: int, number: int = 0) -> bytes:
    return bytes((specifier << _SPECIFIER_SHIFT,)) + encode_multiplexer(index, subindex) + encode_number(number)


def _encode_toggled(specifier: int, *, toggle: bool) -> bytes:
    return bytes((specifier << _SPECIFIER_SHIFT | _TOGGLE * toggle,)).ljust(MESSAGE_LENGTH, b"\0")


def _encode_initiate(specifier: int, index: int, subindex: int, data: bytes | None, size: int | None) -> bytes:
    message = bytearray(_encode_plain(specifier, index, subindex, size if data is None and size is not None else 0))
    if data is None:
        message[0] |= _SIZED * (size is not None)
        return bytes(message)
    if not 1 <= len(data) <= EXPEDITED_LENGTH:
        raise ValueError(f"an expedited transfer holds 1 to 4 bytes, not {len(data)}")
    if size is None and len(data) != EXPEDITED_LENGTH:
        raise ValueError(f"expedited data without a size are 4 bytes, not {len(data)}")
    if size is not None and size != len(data):
        raise ValueError(f"{len(data)} expedited bytes cannot have the size {size}")
    message[0] |= _EXPEDITED | (_SIZED | EXPEDITED_LENGTH - len(data) << 2 if size is not None else 0)
    message[4 : 4 + len(data)] = data
    return bytes(message)


def _encode_segment(data: bytes, *, toggle: bool, last: bool) -> bytes:
    if len(data) > SEGMENT_LENGTH:
        raise ValueError(f"an SDO segment holds up to 7 bytes, not {len(data)}")
    head = _TOGGLE * toggle | SEGMENT_LENGTH - len(data) << 1 | _LAST * last
    return bytes((head, *data)).ljust(MESSAGE_LENGTH, b"\0")


def _decode(data: bytes, decoders: Mapping[int, Callable[[bytes], _Message]]) -> _Message | Unsupported | None:
    if len(data) != MESSAGE_LENGTH:
        return None
    specifier = data[0] >> _SPECIFIER_SHIFT
    decoder = decoders.get(specifier)
    if decoder is None:
        return Unsupported(specifier, *_multiplexer(data))
    return decoder(data)


def _multiplexer(data: bytes) -> tuple[int, int]:
    return data[1] | data[2] << 8, data[3]


def _payload(data: bytes) -> tuple[bytes | None, int | None]:
    """Data and size of an initiate message, either of which may be absent."""
    sized = bool(data[0] & _SIZED)
    if not data[0] & _EXPEDITED:
        return None, _NUMBER.unpack_from(data, 4)[0] if sized else None
    length = EXPEDITED_LENGTH - (data[0] >> 2 & 3) if sized else EXPEDITED_LENGTH
    return bytes(data[4 : 4 + length]), length if sized else None


def _segment(data: bytes) -> tuple[bool, bytes, bool]:
    unused = data[0] >> 1 & 7
    return bool(data[0] & _TOGGLE), bytes(data[1 : MESSAGE_LENGTH - unused]), bool(data[0] & _LAST)


def _abort(data: bytes) -> Abort:
    return Abort(*_multiplexer(data), _NUMBER.unpack_from(data, 4)[0])


_REQUESTS: Final[Mapping[int, Callable[[bytes], Request]]] = MappingProxyType(
    {
        0: lambda data: DownloadSegment(*_segment(data)),
        1: lambda data: DownloadInitiate(*_multiplexer(data), *_payload(data)),
        2: lambda data: UploadInitiate(*_multiplexer(data)),
        3: lambda data: UploadSegment(bool(data[0] & _TOGGLE)),
        4: _abort,
    }
)
_RESPONSES: Final[Mapping[int, Callable[[bytes], Response]]] = MappingProxyType(
    {
        0: lambda data: SegmentUploaded(*_segment(data)),
        1: lambda data: SegmentDownloaded(bool(data[0] & _TOGGLE)),
        2: lambda data: UploadInitiated(*_multiplexer(data), *_payload(data)),
        3: lambda data: DownloadInitiated(*_multiplexer(data)),
        4: _abort,
    }
)
_ENCODERS: Final[Mapping[type, Callable[[Any], bytes]]] = MappingProxyType(
    {
        DownloadInitiate: lambda m: _encode_initiate(1, m.index, m.subindex, m.data, m.size),
        DownloadSegment: lambda m: _encode_segment(m.data, toggle=m.toggle, last=m.last),
        UploadInitiate: lambda m: _encode_plain(2, m.index, m.subindex),
        UploadSegment: lambda m: _encode_toggled(3, toggle=m.toggle),
        DownloadInitiated: lambda m: _encode_plain(3, m.index, m.subindex),
        SegmentDownloaded: lambda m: _encode_toggled(1, toggle=m.toggle),
        UploadInitiated: lambda m: _encode_initiate(2, m.index, m.subindex, m.data, m.size),
        SegmentUploaded: lambda m: _encode_segment(m.data, toggle=m.toggle, last=m.last),
        Abort: lambda m: _encode_plain(4, m.index, m.subindex, m.code),
    }
)
