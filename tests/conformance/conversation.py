"""Golden conversations: bytes typed from the standards, said to the simulated drives and expected back.

A conversation is lines of text in candump's notation; node 1 is the one talked to.

    > 601#40 00 10 00 00 00 00 00    the master says this
    < 581#43 00 10 00 92 01 02 00    node 1 must answer this, and nothing else before it
    > 080# x10                       the master says it ten times
    ~ 701#7F                         node 1 may say this at any time from here on

`..` is a byte that the standards leave to the device, `R8` a remote frame of eight bytes, an identifier of eight digits
a 29-bit one. What nodes 2 and 3 say is passed over unless it is expected. At the end node 2 is asked for something: all
that node 1 had to say comes before the answer, so that an unexpected frame is noticed and not only a missing one.
"""

from collections.abc import Iterator
from typing import Final, NamedTuple, Protocol

import pytest

BYSTANDERS: Final = frozenset(base + n for base in (0x080, 0x180, 0x280, 0x580, 0x700) for n in (2, 3))
AT_ONCE: Final = 20  # frames said without waiting until they are heard: no member's queue need hold more

# Ask node 2 for its device type (1000).
BARRIER: Final = """
    > 602#40 00 10 00 00 00 00 00
    < 582#43 00 10 00 92 01 02 00"""

# Every node as it leaves the factory, and booted.
FACTORY: Final = """
    ~ 701#..
    ~ 081#.. .. .. .. .. .. .. ..
    > 000#80 00
    > 601#23 11 10 01 6C 6F 61 64
    < 581#60 11 10 01 00 00 00 00
    > 000#81 00
    < 701#00
    < 702#00
    < 703#00"""

# Node 1 without a heartbeat (1017 = 0), so that it is guarded instead.
QUIET: Final = """
    > 601#2B 17 10 00 00 00 00 00
    < 581#60 17 10 00 00 00 00 00"""


class Golden(NamedTuple):
    """A conversation or a timeline, and the fact that it shows."""

    title: str
    text: str


class Line(Protocol):
    """What a conversation is held over."""

    patience_s: float

    def now_s(self) -> float:
        """Return the time on this line."""
        ...

    def say(self, text: str) -> None:
        """Send a frame."""
        ...

    def hear(self, until_s: float) -> str | None:
        """Return the next frame, or None when there was none until then."""
        ...


class Telegram(NamedTuple):
    """A CAN frame, with the attributes that everything which carries frames here goes by."""

    can_id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False

    @classmethod
    def parse(cls, text: str) -> "Telegram":
        """Read candump's notation."""
        identifier, data = text.split("#")
        extended = len(identifier) > 3
        if data.startswith("R"):
            return cls(int(identifier, 16), bytes(int(data[1:])), remote=True, extended=extended)
        return cls(int(identifier, 16), bytes.fromhex(data), extended=extended)

    def __str__(self) -> str:
        identifier = f"{self.can_id:08X}" if self.extended else f"{self.can_id:03X}"
        return f"{identifier}#{f'R{len(self.data)}' if self.remote else self.data.hex(' ').upper()}"


def golden(conversations: dict[str, str]) -> pytest.MarkDecorator:
    """Return the decorator by which a test holds each of the conversations, or each of the timelines."""
    cases = [pytest.param(Golden(title, text), id=title) for title, text in conversations.items()]
    return pytest.mark.parametrize("golden", cases)


def matches(pattern: str, heard: str) -> bool:
    """Return whether a frame is what a pattern says; `..` stands for any byte."""
    if ".." not in pattern:
        return pattern == heard
    wanted, said = pattern.replace("#", " ").split(), heard.replace("#", " ").split()
    return len(wanted) == len(said) and all(w in {"..", s} for w, s in zip(wanted, said, strict=True))


def talk(line: Line, text: str) -> None:
    """Hold a conversation, and then see to it that node 1 has nothing more to say."""
    tolerated: list[str] = []
    past: list[str] = []
    for step in steps(text + BARRIER):
        direction, _, frame = step.partition(" ")
        past.append(step)
        if direction == ">":
            say(line, frame)
        elif direction == "<":
            expect(line, frame, tolerated, past)
        elif direction == "~":
            tolerated.append(frame)
        else:
            raise ValueError(f"no line of a conversation: {step!r}")


def steps(text: str) -> Iterator[str]:
    """Yield the lines of a conversation."""
    return (line.strip() for line in text.splitlines() if line.strip())


def say(line: Line, frame: str) -> None:
    """Say a frame, as often as it is told to."""
    telegram, _, times = frame.partition(" x")
    for count in range(1, int(times or 1) + 1):
        line.say(telegram)
        if count % AT_ONCE == 0:
            talk(line, "")


def expect(line: Line, pattern: str, tolerated: list[str], past: list[str]) -> None:
    """Wait for a frame, and fail if another one of node 1 comes first."""
    give_up_s = line.now_s() + line.patience_s
    while (heard := line.hear(give_up_s)) is not None:
        if matches(pattern, heard):
            return
        by_another = int(heard.split("#")[0], 16) in BYSTANDERS
        if not by_another and not any(matches(each, heard) for each in tolerated):
            pytest.fail("\n".join([*past, f"but heard: {heard}"]), pytrace=False)
    pytest.fail("\n".join([*past, "but heard nothing of the kind"]), pytrace=False)
