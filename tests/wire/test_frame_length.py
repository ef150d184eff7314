"""The worst-case length of classic CAN frames."""

import pytest

from torquerig.driver.wire.frame import Arrival, Frame, worst_case_bits


@pytest.mark.parametrize(("length", "bits"), [(0, 55), (4, 95), (6, 115), (8, 135)])
def test_worst_case_lengths_are_those_of_the_servo_protocol(length, bits):
    assert worst_case_bits(length) == bits


def test_one_cycle_of_three_drives_is_745_bits():
    assert worst_case_bits(0) + 3 * worst_case_bits(8) + 3 * worst_case_bits(4) == 745


def test_the_group_cycle_fills_91_per_cent_of_2_khz():
    # SYNC, three positions of 4 bytes, one RPDO of three torques
    assert worst_case_bits(0) + 3 * worst_case_bits(4) + worst_case_bits(6) == 455


def test_29_bit_frames_are_longer():
    # 64 + 8n fixed bits, 54 + 8n of them stuffable, 3 bits of interframe space: 160 for 8 bytes
    assert worst_case_bits(8, extended=True) == 160
    assert worst_case_bits(0, extended=True) == 80


@pytest.mark.parametrize("length", [-1, 9, 64])
def test_a_length_no_classic_frame_has_is_refused(length):
    with pytest.raises(ValueError, match=str(length)):
        worst_case_bits(length)


@pytest.mark.parametrize("length", range(9))
@pytest.mark.parametrize("extended", [False, True])
def test_the_worst_pattern_has_exactly_the_worst_case_length(length, extended):
    """The pattern 11111 0000 1111 0000 ... costs a stuff bit after the first five bits, then after every four."""
    total = (64 if extended else 44) + 8 * length
    stuffable = total - 10  # CRC delimiter, ACK slot and delimiter, 7 bits of end of frame
    bits = [1] * 5 + [(i // 4) % 2 for i in range(stuffable - 5)]
    run, last, stuffed = 0, None, 0
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffed += 1
            last, run = 1 - bit, 1
    assert total + 3 + stuffed == worst_case_bits(length, extended=extended)


def test_a_plain_frame_is_a_data_frame_with_11_bits_and_no_data():
    assert Frame(0x80) == (0x80, b"", False, False)
    assert Arrival(5, Frame(0x80)).frame.can_id == 0x80
