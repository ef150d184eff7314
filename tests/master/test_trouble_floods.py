"""What a watch remembers of a flood of trouble is bounded, and still names the cause that came first."""

from __future__ import annotations

import pytest

from torquerig.driver.errors import DriveFault, SecondMaster
from torquerig.driver.wire.frame import Frame

MS = 1_000_000
FLOOD = 20_000


def flood(rig, frame_of) -> None:
    start = rig.bus.now_ns()
    for number in range(FLOOD):
        rig.bus.inject(start + number, frame_of(number))


def test_a_flood_of_emergencies_is_told_in_a_sentence_of_bounded_length(rig):
    with rig.group() as group:
        group.home()
        group.enable()
        flood(rig, lambda number: Frame(0x081, number.to_bytes(2, "little").ljust(8, b"\0")))
        with pytest.raises(DriveFault) as fault:
            group.sample(group.now_ns() + 4 * MS)
    assert "drive 1" in str(fault.value)
    assert len(str(fault.value)) < 6000


def test_another_master_is_named_also_after_a_flood(rig):
    with rig.group() as group:
        group.home()
        group.enable()
        flood(rig, lambda number: Frame(0x081, (0x1000 + number).to_bytes(2, "little").ljust(8, b"\0")))
        rig.bus.inject(rig.bus.now_ns() + FLOOD, Frame(0x201, bytes(4)))
        with pytest.raises(SecondMaster):
            group.sample(group.now_ns() + 4 * MS)
