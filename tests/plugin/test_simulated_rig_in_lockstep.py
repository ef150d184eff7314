"""A rig in simulated time: for masters of one thread, exact and as fast as it can be computed."""

from __future__ import annotations

import can
import pytest

from torquerig import SimulatedRig

SYNC = can.Message(arbitration_id=0x080, is_extended_id=False)


def test_the_rigs_bus_is_a_python_can_bus_whose_time_is_simulated():
    with SimulatedRig("lockstep:") as rig:
        assert isinstance(rig.bus, can.BusABC)
        heartbeats = [rig.bus.recv() for _ in range(6)]
    assert [message.arbitration_id for message in heartbeats if message] == [0x701, 0x702, 0x703] * 2
    stamps = [message.timestamp for message in heartbeats if message]
    assert stamps[0] == pytest.approx(0.05, abs=1e-3)
    assert stamps[3] - stamps[0] == pytest.approx(0.05, abs=1e-9)


def test_two_rigs_that_hear_the_same_say_the_same_at_the_same_times():
    def talk() -> list[tuple[float, int, bytes]]:
        with SimulatedRig("lockstep:") as rig:
            rig.bus.send(can.Message(arbitration_id=0, is_extended_id=False, data=[1, 0]))
            said = []
            for _ in range(10):
                rig.bus.send(SYNC)
                while (message := rig.bus.recv(0.004)) is not None:
                    said.append((message.timestamp, message.arbitration_id, bytes(message.data)))
        return said

    first = talk()
    assert sum(1 for _, can_id, _ in first if can_id == 0x181) == 10
    assert talk() == first


def test_orders_are_carried_out_at_the_bus_time(tmp_path):
    with SimulatedRig("lockstep:", record=tmp_path / "record") as rig:
        rig.inject(1, "overcurrent")
        message = rig.bus.recv()
        assert message is not None
        assert (message.arbitration_id, bytes(message.data[:2])) == (0x081, b"\x10\x23")
        rig.power_cycle(1)
        message = rig.bus.recv()
        assert message is not None
        assert (message.arbitration_id, bytes(message.data)) == (0x701, b"\x00")
        with rig.frozen():
            assert rig.time_zero_ns == 0
    assert rig.truth().motor_torque.max() == 0.0
    with can.LogReader(tmp_path / "record" / "bus.log") as reader:
        assert [message.arbitration_id for message in reader] == [0x701, 0x702, 0x703, 0x081, 0x701]


def test_the_bus_is_closed_with_the_rig():
    with SimulatedRig("lockstep:") as rig:
        bus = rig.bus
    with pytest.raises(can.CanOperationError, match="closed"):
        bus.recv(0.0)
