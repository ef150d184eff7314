"""Fake nodes for the simulated wire: no CANopen, only who sends what when."""

from __future__ import annotations

import pytest

from torquerig.device_sim.devices import NEVER_NS, Emission
from torquerig.driver.wire.frame import Frame


class FakeDrive:
    """Sends a frame of its own every `period_ns`, and answers SYNC with its TPDO1 of 8 bytes."""

    def __init__(self, node_id: int, period_ns: int = NEVER_NS, first_ns: int | None = None) -> None:
        self.node_id = node_id
        self.heard: list[tuple[int, Frame]] = []
        self._period_ns = period_ns
        self._due_ns = period_ns if first_ns is None else first_ns
        self._emissions: list[Emission] = []

    def next_event_ns(self) -> int:
        return self._due_ns

    def advance(self, to_ns: int) -> None:
        while self._due_ns <= to_ns:
            self._emissions.append(Emission(self._due_ns, self.node_id, Frame(0x700 + self.node_id, b"\x05")))
            self._due_ns += self._period_ns

    def receive(self, frame: Frame, at_ns: int) -> None:
        self.heard.append((at_ns, frame))
        if frame.can_id == 0x080:
            count = len(self.heard)
            tpdo = Frame(0x180 + self.node_id, count.to_bytes(8, "little"))
            self._emissions.append(Emission(at_ns, self.node_id, tpdo))

    def take(self) -> list[Emission]:
        taken, self._emissions = self._emissions, []
        return taken


class FakeTalker:
    """Says given frames, each ready at a given time, whatever it hears."""

    def __init__(self, node_id: int, *says: tuple[int, Frame]) -> None:
        self.node_id = node_id
        self.heard: list[tuple[int, Frame]] = []
        self._says = list(says)
        self._emissions: list[Emission] = []

    def next_event_ns(self) -> int:
        return self._says[0][0] if self._says else NEVER_NS

    def advance(self, to_ns: int) -> None:
        while self._says and self._says[0][0] <= to_ns:
            ready_ns, frame = self._says.pop(0)
            self._emissions.append(Emission(ready_ns, self.node_id, frame))

    def receive(self, frame: Frame, at_ns: int) -> None:
        self.heard.append((at_ns, frame))

    def take(self) -> list[Emission]:
        taken, self._emissions = self._emissions, []
        return taken


@pytest.fixture(scope="session")
def drive() -> type[FakeDrive]:
    return FakeDrive


@pytest.fixture(scope="session")
def talker() -> type[FakeTalker]:
    return FakeTalker
