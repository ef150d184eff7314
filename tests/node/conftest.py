"""A CANopen node on a bench: bytes in candump's notation go in, bytes come out, time is a number."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from torquerig.device_sim.canopen.application import CommunicationEvent
from torquerig.device_sim.canopen.core import NodeTiming
from torquerig.device_sim.canopen.node import CanopenNode
from torquerig.driver.wire.dictionary import DRIVE_EDS, load_dictionary
from torquerig.driver.wire.emcy import Emergency
from torquerig.driver.wire.frame import Frame

MS = 1_000_000


class StubApplication:
    """A device without function: it remembers what it was told."""

    def __init__(self) -> None:
        self.events: list[tuple[int, CommunicationEvent]] = []
        self.power_ons: list[int] = []
        self.syncs: list[int] = []
        self.emergencies: list[Emergency] = []

    def power_on(self, at_ns: int) -> None:
        self.power_ons.append(at_ns)

    def synchronise(self, at_ns: int) -> None:
        self.syncs.append(at_ns)

    def handle_event(self, event: CommunicationEvent, at_ns: int) -> None:
        self.events.append((at_ns, event))

    def hear_emergency(self, emergency: Emergency, at_ns: int) -> None:
        del at_ns
        self.emergencies.append(emergency)


class Bench:
    """Node 1 and the one who talks to it. `now_ns` is when the next frame is complete."""

    def __init__(self, timing: NodeTiming) -> None:
        self.application = StubApplication()
        self.node = CanopenNode(
            1, load_dictionary(DRIVE_EDS, 1), lambda _node: self.application, timing=timing, volatile=(0x6040, 0x2071)
        )
        self.now_ns = 0
        self.node.advance(0)
        assert self.take() == [(0, "701#00")]

    def take(self) -> list[tuple[int, str]]:
        return [(e.ready_ns, said(e.frame)) for e in self.node.take()]

    def say(self, text: str) -> list[str]:
        """Let the node hear a frame now; return what it answers."""
        self.node.receive(frame(text), self.now_ns)
        return [text for _, text in self.take()]

    def wait(self, until_ns: int) -> list[tuple[int, str]]:
        """Let time pass; return what the node says and when it was ready to."""
        self.now_ns = until_ns
        self.node.advance(until_ns)
        return self.take()

    def talk(self, conversation: str) -> None:
        """Hold a conversation: `>` to the node, `<` from it, nothing more and nothing less."""
        expected: list[str] = []
        answers: list[str] = []
        for line in conversation.strip().splitlines():
            direction, _, text = line.strip().partition(" ")
            if direction == ">":
                assert answers == expected
                answers, expected = self.say(text), []
            else:
                expected.append(text)
        assert answers == expected


def frame(text: str) -> Frame:
    """`601#40 00 10`, or `701#R1` for a remote frame of one byte."""
    identifier, data = text.split("#")
    if data.startswith("R"):
        return Frame(int(identifier, 16), bytes(int(data[1:])), remote=True)
    return Frame(int(identifier, 16), bytes.fromhex(data))


def said(answer: Frame) -> str:
    return f"{answer.can_id:03X}#{answer.data.hex(' ').upper()}"


@pytest.fixture
def bench() -> Bench:
    return Bench(NodeTiming(boot_ns=MS, answer_ns=0, sample_ns=0, reaction_ns=0))


@pytest.fixture
def slow_bench() -> Bench:
    """A node that takes its time: 1 ms to boot, 100 us to answer, 20 us to sample, 50 us to act."""
    return Bench(NodeTiming(boot_ns=MS, answer_ns=100_000, sample_ns=20_000, reaction_ns=50_000))


@pytest.fixture
def operational(bench: Bench) -> Bench:
    bench.talk("> 000#01 01")
    return bench


@pytest.fixture
def write(bench: Bench) -> Callable[..., None]:
    """Write an object by expedited SDO, and expect success or an abort code."""

    def do(multiplexer: str, data: str, abort: str | None = None) -> None:
        index, _, subindex = multiplexer.partition(":")
        head = f"{index[2:]} {index[:2]} {subindex or '00'}"
        octets = data.split()
        specifier = {1: "2F", 2: "2B", 4: "23"}[len(octets)]
        padded = " ".join(octets + ["00"] * (4 - len(octets)))
        answers = bench.say(f"601#{specifier} {head} {padded}")
        expected = f"581#60 {head} 00 00 00 00" if abort is None else f"581#80 {head} {abort}"
        assert [a for a in answers if a.startswith("581")] == [expected]

    return do
