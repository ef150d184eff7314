"""A sample says when each drive answered, and what it says is its own."""

import math

from torquerig.driver.wire.frame import Frame

ANSWER_NS = 150_000
PERIOD_NS = 4_000_000


def test_each_answer_is_timed_from_the_sync(rig):
    with rig.group() as group:
        raw = group.sample_raw(group.now_ns() + PERIOD_NS)
        assert raw.answered_ns.tolist() == [ANSWER_NS] * 3
        assert group.sample(raw.at_ns + PERIOD_NS).answered_ns.tolist() == [ANSWER_NS] * 3


def test_a_drive_that_is_silent_or_too_late_has_no_time(rig):
    with rig.group() as group:
        before = group.sample_raw(group.now_ns() + PERIOD_NS)
        rig.drives[2].mute.add("sync")
        rig.bus.inject(before.at_ns + PERIOD_NS + PERIOD_NS // 2 + 1, Frame(0x182, bytes(8)))
        sample = group.sample_raw(before.at_ns + PERIOD_NS)
        group.command_raw([0, 0, 0], sample.at_ns + PERIOD_NS - 1)
        assert [math.isnan(each) for each in sample.answered_ns] == [False, True, False]
        assert group.cycle_counts.late == 1
        assert before.answered_ns.tolist() == [ANSWER_NS] * 3
        rig.drives[2].mute.clear()
