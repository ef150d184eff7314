"""Timelines: literal frames at exact times, said to one simulated drive in virtual time, and expected from it.

    0      > 000#01 01        at 0 ms the drive hears this
    20     < 381#31 02        at 20 ms exactly it says this
    25     < .                until 25 ms it has said nothing else

Times are milliseconds from the end of the preparation. Every frame that the drive says must stand there. It answers,
samples and acts without delay, so that all times are the standard's; its rotor is free, heavy and without friction.
"""

from collections.abc import Iterator
from decimal import Decimal
from typing import Final

import pytest
from conversation import Telegram, matches, steps

from torquerig.device_sim.canopen.core import NodeTiming
from torquerig.device_sim.devices import Emission, SimulatedDevices
from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.drive.parameters import DriveParameters
from torquerig.device_sim.plant import BareRotor, RotorParameters

MS: Final = 1_000_000
BOOT_NS: Final = MS
PROMPT: Final = NodeTiming(boot_ns=BOOT_NS, answer_ns=0, sample_ns=0, reaction_ns=0)
HEAVY: Final = RotorParameters(inertia=1.0, lag=0.0)


class Bench:
    """Node 1 alone. What it says is kept as (time, text) until it is taken."""

    def __init__(self) -> None:
        self.drive = SimulatedDrive(1, 0, BareRotor(HEAVY), DriveParameters(timing=PROMPT))
        self.devices = SimulatedDevices([self.drive])
        self.now_ns = 0
        self.said: list[tuple[int, str]] = []
        self.wait(0)

    def wait(self, until_ns: int) -> None:
        """Let everything happen that is due until then."""
        self.now_ns = until_ns
        self._keep(self.devices.advance(until_ns))

    def hear(self, text: str) -> None:
        """Let the drive hear a frame now."""
        self._keep(self.devices.receive(Telegram.parse(text), self.now_ns))

    def power_cycle(self) -> None:
        """Switch the drive off and on."""
        self.drive.power_cycle(self.now_ns)
        self.wait(self.now_ns)

    def prepare(self, text: str) -> None:
        """Hold a conversation in which nothing takes time."""
        for step in steps(text):
            direction, _, frame = step.partition(" ")
            if direction == ">":
                self._expect_nothing()
                self.hear(frame)
            elif direction == "<":
                at_ns, heard = self.said.pop(0) if self.said else (self.now_ns, "nothing")
                if at_ns != self.now_ns or not matches(frame, heard):
                    pytest.fail(f"expected {frame}, but heard {heard}", pytrace=False)
            else:
                raise ValueError(f"no line of a preparation: {step!r}")
        self._expect_nothing()

    def _expect_nothing(self) -> None:
        if self.said:
            pytest.fail(f"unexpected: {_listed(self.said)}", pytrace=False)

    def follow(self, text: str) -> None:
        """Go along a timeline."""
        start_ns = self.now_ns
        expected: list[tuple[int, str]] = []
        for at_ns, direction, frame in moments(text, start_ns):
            if direction == "<":
                expected.append((at_ns, frame))
                continue
            self.wait(at_ns)
            self.hear(frame)
        self.wait(expected[-1][0])
        heard = [(at_ns - start_ns, frame) for at_ns, frame in self.said]
        wanted = [(at_ns - start_ns, frame) for at_ns, frame in expected if frame != "."]
        self.said = []
        alike = len(heard) == len(wanted) and all(
            h_ns == w_ns and matches(w, h) for (h_ns, h), (w_ns, w) in zip(heard, wanted, strict=True)
        )
        if not alike:
            pytest.fail(f"said {_listed(heard)}\nexpected {_listed(wanted)}", pytrace=False)

    def _keep(self, emissions: list[Emission]) -> None:
        for emission in emissions:
            frame = emission.frame
            self.said.append((emission.ready_ns, str(Telegram(frame.can_id, frame.data))))
        self.said.sort(key=lambda each: each[0])


def moments(text: str, start_ns: int) -> Iterator[tuple[int, str, str]]:
    """Yield time [ns], direction and frame of every line."""
    for step in steps(text):
        at_ms, direction, frame = step.split(maxsplit=2)
        yield start_ns + int(Decimal(at_ms) * MS), direction, frame


def _listed(frames: list[tuple[int, str]]) -> str:
    return "".join(f"\n  {Decimal(at_ns) / MS} ms  {frame}" for at_ns, frame in frames) or "nothing"
