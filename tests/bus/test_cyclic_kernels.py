"""Compiled code of the cycle beside what it stands for."""

import struct

import numpy as np
from cyclic_bench import RPDO, SCALES, two_axes
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.bus import can_kernels, cyclic, cyclic_kernels, unix_kernels, unix_packet

CYCLE_OF_TWO = two_axes()


@given(
    torque=st.floats(-3.0, 3.0),
    position=st.integers(-(2**31), 2**31 - 1),
    counts=st.integers(-(2**15), 2**15 - 1),
    axis=st.integers(0, 1),
)
def test_compiled_code_and_scales_agree_to_the_last_bit(torque, position, counts, axis):
    cycle = CYCLE_OF_TWO
    data = np.zeros(8, dtype=np.uint8)
    data[:] = np.frombuffer(struct.pack("<Hih", 0x1237, position, counts), dtype=np.uint8)
    record = cycle.block[0]
    assert cyclic_kernels.hear(record, 1, 0x181 + axis, 8, data)
    cyclic_kernels.told(record)
    told = cycle.block["told"][0, :6].reshape(3, 2)
    assert told[0, axis] == SCALES[axis].angle(position)
    assert told[1, axis] == SCALES[axis].torque(counts)
    cycle.block["wanted"][0, axis] = torque
    assert cyclic_kernels.encode(record)
    sent = bytes(cycle.block["command"][0, axis]["data"][:4])
    assert sent == RPDO.pack((0, SCALES[axis].torque_counts(torque)))


def test_kernels_know_the_numbers_of_others():
    for name in ("DONE", "CHANGED", "ODD", "OTHER", "NOT_A_NUMBER", "EARLY", "TAU", "ANSWERED_NS"):
        assert getattr(cyclic_kernels, name) == getattr(cyclic, name)
    assert cyclic_kernels.NO_ROW == cyclic.NOBODY
    assert unix_kernels.MAGIC.to_bytes(4, "little") == unix_packet.MAGIC
    assert unix_packet.HEADER.size == unix_kernels.PACKET_HEAD
    assert unix_kernels.SEQUENCE_MASK == unix_packet.SEQUENCE_MASK
    flags = {unix_kernels.EXTENDED: "is_extended_id", unix_kernels.REMOTE: "is_remote_frame"}
    for flag, name in {**flags, unix_kernels.ERROR: "is_error_frame"}.items():
        packet = unix_packet.HEADER.pack(unix_packet.MAGIC, flag, 0, 1, 0, 0)
        assert getattr(unix_packet.decode(packet).message, name)
    assert can_kernels.BATCH == unix_kernels.BATCH == cyclic_kernels.BATCH
