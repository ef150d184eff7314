"""A bus has one master: another one is noticed before the first frame is sent, and told from an own echo."""

from __future__ import annotations

import numpy as np
import pytest

from torquerig.driver.errors import SecondMaster
from torquerig.driver.wire.frame import Frame

MS = 1_000_000


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        (Frame(0x080), "it sends SYNC"),
        (Frame(0x77F, b"\x05"), "it sends our heartbeat, node-id 127"),
        (Frame(0x202, bytes(4)), "it commands drive 2"),
    ],
)
def test_another_master_is_told_in_one_sentence_and_nothing_is_sent(rig, frame, words):
    rig.bus.inject(rig.bus.now_ns() + 100 * MS, frame)
    with pytest.raises(SecondMaster) as refusal:
        rig.group().__enter__()
    assert str(refusal.value) == f"another master speaks on the bus: {words}"
    assert rig.bus.log == []


def test_drives_that_chatter_are_no_master(rig):
    for frame in (Frame(0x701, b"\x05"), Frame(0x181, bytes(8)), Frame(0x581, bytes(8)), Frame(0x081, bytes(8))):
        rig.bus.inject(rig.bus.now_ns() + MS, frame)
    with rig.group() as group:
        group.enable()


def test_own_frames_that_come_back_are_no_master(make_rig):
    rig = make_rig(echo=True)
    with rig.group() as group:
        group.enable()
        due = group.now_ns() + 4 * MS
        for _ in range(20):
            sample = group.sample(due)
            assert sample.complete
            group.command(np.zeros(3), due + MS)
            due += 4 * MS
        assert group.pump_counts.echoed > 60


def test_another_master_is_noticed_also_where_own_frames_come_back(make_rig):
    rig = make_rig(echo=True)
    with rig.group() as group:
        group.enable()
        rig.bus.inject(group.now_ns() + 6 * MS, Frame(0x080))
        with pytest.raises(SecondMaster):
            group.wait(0.1)
