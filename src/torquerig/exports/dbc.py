"""DBC text: what the frames of a bus mean, for programs that know no CANopen.

The text is written here, so that a library which reads DBC can judge it. It is ASCII: readers differ in the encoding
they take for granted. Numbers are written with all their digits, because what a reader decodes is to be what the driver
computed.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

_EXTENDED: Final = 1 << 31
_NOBODY: Final = "Vector__XXX"
_HEAD: Final = 'VERSION ""\n\nNS_ :\n\nBS_:\n\n'
_FLOAT_KINDS: Final = {32: 1, 64: 2}


@dataclass(frozen=True, slots=True)
class Signal:
    """A number in the data of a message, least significant byte first.

    The number that is meant is factor * raw.

    Attributes:
        name: An identifier of C with at most 32 characters, the message's only one.
        start: Its lowest bit: bit n % 8 of byte n // 8.
        length: Bits.
        signed: Whether it is in two's complement.
        real: Whether it is a floating-point number of IEEE 754; its length is 32 or 64 then.
        factor: What a raw 1 stands for.
        unit: Its unit.
        comment: What it is.
        raw_limits: Least and greatest raw number; None: all that its bits can hold.
        choices: Words for raw numbers.
        selects: Whether it tells which other signals the message holds.
        selected_by: Values of the selecting signal with which this one is there; none: always.
    """

    name: str
    start: int
    length: int
    signed: bool = False
    real: bool = False
    factor: float = 1
    unit: str = ""
    comment: str = ""
    raw_limits: tuple[float, float] | None = None
    choices: Mapping[int, str] = field(default_factory=dict)
    selects: bool = False
    selected_by: tuple[int, ...] = ()

    @property
    def limits(self) -> tuple[float, float]:
        """Least and greatest number; 0 and 0, which is DBC's "any", for a floating-point one."""
        if self.raw_limits is not None:
            low, high = self.raw_limits
        elif self.real:
            low, high = 0, 0
        elif self.signed:
            low, high = -(1 << self.length - 1), (1 << self.length - 1) - 1
        else:
            low, high = 0, (1 << self.length) - 1
        ends = sorted((low * self.factor, high * self.factor))
        return ends[0], ends[1]


@dataclass(frozen=True, slots=True)
class Message:
    """A data frame with one identifier.

    Attributes:
        can_id: Its identifier, 11 bits, or 29 if `extended`.
        name: An identifier of C with at most 32 characters, the file's only one.
        length: Bytes of data, at most.
        sender: Who sends it; an identifier of C.
        receivers: Who takes it.
        signals: What is in it.
        comment: What it is.
        extended: Whether its identifier has 29 bits.
    """

    can_id: int
    name: str
    length: int
    sender: str
    receivers: tuple[str, ...] = ()
    signals: tuple[Signal, ...] = ()
    comment: str = ""
    extended: bool = False

    @property
    def key(self) -> int:
        """The identifier as DBC writes it."""
        return self.can_id | _EXTENDED if self.extended else self.can_id


def dbc_text(messages: Sequence[Message]) -> str:
    """The messages as the text of a DBC file.

    Args:
        messages: The messages, each with another identifier and name.

    Returns:
        The text, in ASCII.

    Raises:
        ValueError: Two messages have one identifier, or one name.
    """
    _check_unique(messages)
    nodes = dict.fromkeys(node for message in messages for node in (message.sender, *message.receivers))
    blocks = (
        (f"BU_: {' '.join(nodes)}",),
        *(_message_lines(message) for message in messages),
        _comments(messages),
        _choices(messages),
        _float_kinds(messages),
        _selections(messages),
    )
    text = _HEAD + "\n".join("\n".join([*lines, ""]) for lines in map(tuple, blocks) if lines)
    return text.encode("ascii", "replace").decode("ascii")


def _check_unique(messages: Sequence[Message]) -> None:
    seen: dict[int | str, Message] = {}
    for message in messages:
        for key in (message.key, message.name):
            other = seen.setdefault(key, message)
            if other is not message:
                raise ValueError(
                    f"{other.name} (0x{other.can_id:X}) and {message.name} (0x{message.can_id:X}) are the same"
                )


def _message_lines(message: Message) -> Iterator[str]:
    yield f"BO_ {message.key} {message.name}: {message.length} {message.sender}"
    receivers = ",".join(message.receivers) or _NOBODY
    for signal in message.signals:
        low, high = map(_number, signal.limits)
        yield (
            f" SG_ {signal.name}{_role(signal)} : {signal.start}|{signal.length}@1{'-' if signal.signed else '+'}"
            f' ({_number(signal.factor)},0) [{low}|{high}] "{_words(signal.unit)}" {receivers}'
        )


def _role(signal: Signal) -> str:
    """What the signal has to do with multiplexing."""
    if signal.selects:
        return " M"
    return f" m{signal.selected_by[0]}" if signal.selected_by else ""


def _comments(messages: Iterable[Message]) -> Iterator[str]:
    for message in messages:
        if message.comment:
            yield f'CM_ BO_ {message.key} "{_words(message.comment)}";'
        for signal in message.signals:
            if signal.comment:
                yield f'CM_ SG_ {message.key} {signal.name} "{_words(signal.comment)}";'


def _choices(messages: Iterable[Message]) -> Iterator[str]:
    for message in messages:
        for signal in message.signals:
            if signal.choices:
                words = " ".join(f'{raw} "{_words(meaning)}"' for raw, meaning in signal.choices.items())
                yield f"VAL_ {message.key} {signal.name} {words} ;"


def _float_kinds(messages: Iterable[Message]) -> Iterator[str]:
    for message in messages:
        for signal in message.signals:
            if signal.real:
                yield f"SIG_VALTYPE_ {message.key} {signal.name} : {_FLOAT_KINDS[signal.length]};"


def _selections(messages: Iterable[Message]) -> Iterator[str]:
    """For signals that are there with several values of the selecting one: plain DBC can tell one value only."""
    for message in messages:
        for selecting in (signal.name for signal in message.signals if signal.selects):
            for signal in message.signals:
                if len(signal.selected_by) > 1:
                    ranges = ", ".join(f"{value}-{value}" for value in signal.selected_by)
                    yield f"SG_MUL_VAL_ {message.key} {signal.name} {selecting} {ranges};"


def _number(value: float) -> str:
    """A number with all its digits."""
    return str(int(value)) if value == int(value) and abs(value) < 1 << 64 else repr(float(value))


def _words(text: str) -> str:
    """Text without what would end its quotes."""
    return text.replace('"', "'").replace("\\", "/")
