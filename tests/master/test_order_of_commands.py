"""Commands leave in the order of their identifiers: on any adapter that is the order in which drives hear them."""

from itertools import pairwise

import pytest

MS = 1_000_000


@pytest.mark.parametrize("node_ids", [(1, 2, 3), (3, 1, 2), (7, 2, 5)])
def test_rpdos_leave_by_rising_identifier(rig, node_ids):
    rig = type(rig)(node_ids)
    with rig.group() as group:
        group.enable()
        begin = len(rig.bus.log)
        for cycle in range(1, 4):
            group.sample(group.now_ns() + 4 * MS)
            group.command_raw([10 * cycle, 20 * cycle, 30 * cycle], group.now_ns() + MS)
        sent = [frame for _, frame in rig.bus.log[begin:] if 0x201 <= frame.can_id <= 0x27F]
    assert [frame.can_id - 0x200 for frame in sent[-9:]] == sorted(node_ids) * 3
    torques = {frame.can_id - 0x200: int.from_bytes(frame.data[2:], "little") for frame in sent[-3:]}
    assert torques == dict(zip(node_ids, (30, 60, 90), strict=True))


@pytest.mark.parametrize("after_ms", [0.05, 1.0, 1.9, 3.9])
def test_a_loop_that_takes_over_sends_no_sync_into_the_answers_to_another(rig, after_ms):
    with rig.group() as group:
        begin = group.cycle_counts.syncs
        while group.cycle_counts.syncs == begin:
            group.wait(1e-5)
        group.wait(after_ms / 1e3)
        group.sample(group.now_ns())
        late = group.cycle_counts.late
    syncs = [at for at, frame in rig.bus.log if frame.can_id == 0x080]
    assert min(later - sooner for sooner, later in pairwise(syncs)) >= 2 * MS
    assert late == 0
