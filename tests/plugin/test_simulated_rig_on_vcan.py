"""A rig on the kernel's CAN."""

from __future__ import annotations

import pytest

from torquerig import SimulatedRig


@pytest.mark.vcan
def test_a_rig_on_vcan_answers_and_is_gone_afterwards(master_of, process):
    with SimulatedRig("socketcan:vcan1", process=process) as rig:
        assert (rig.interface, rig.channel) == ("socketcan", "vcan1")
        master = master_of(rig)
        assert [master.read(node_id, 0x1000) for node_id in rig.node_ids] == [0x00020192] * 3
        rig.power_cycle(1)
        master.hear(0x701, b"\x00")
    with SimulatedRig("socketcan:vcan1", process=process) as rig:
        master = master_of(rig)
        rig.inject(2, "overcurrent")
        assert master.hear(0x082)[:2] == b"\x10\x23"
