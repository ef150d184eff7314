"""When each frame ends on the simulated wire, computed by hand from its bits, and who wins arbitration."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.driver.wire.frame import Frame

MEGABIT = 1_000_000
FAR_NS = 10**9


def network_of(*nodes, bit_rate: int = MEGABIT) -> tuple[SimulatedNetwork, list[tuple[int, int]]]:
    log: list[tuple[int, int]] = []
    network = SimulatedNetwork(
        SimulatedDevices(nodes), bit_rate, lambda at_ns, frame: log.append((at_ns, frame.can_id))
    )
    return network, log


def test_a_cycle_ends_bit_by_bit_where_it_should(drive):
    network, log = network_of(*(drive(node_id) for node_id in (3, 1, 2)))
    network.submit(Frame(0x080))
    arrivals = [network.run_until(FAR_NS) for _ in range(3)]
    assert [a.at_ns for a in arrivals] == [190_000, 325_000, 460_000]
    assert network.now_ns() == 460_000
    for node_id in (1, 2, 3):
        network.submit(Frame(0x200 + node_id, bytes(4)))
    assert network.run_until(4_000_000) is None
    assert network.now_ns() == 4_000_000
    assert log == [  # SYNC 55 bits, TPDOs of 8 bytes 135, RPDOs of 4 bytes 95, at 1 us a bit
        (55_000, 0x080),
        (190_000, 0x181),
        (325_000, 0x182),
        (460_000, 0x183),
        (555_000, 0x201),
        (650_000, 0x202),
        (745_000, 0x203),
    ]


def test_the_bit_rate_scales_the_frames(drive):
    network, log = network_of(drive(1), bit_rate=125_000)
    network.submit(Frame(0x080))
    network.run_until(FAR_NS)
    assert log == [(440_000, 0x080), (1_520_000, 0x181)]


def test_an_awkward_bit_rate_still_gives_whole_nanoseconds(talker):
    network, log = network_of(talker(1), bit_rate=83_333)
    network.submit(Frame(0x080))
    network.run_until(FAR_NS)
    assert log == [(660_003, 0x080)]  # 55e9 / 83333 = 660002.64, rounded up


def test_a_lower_identifier_overtakes_what_waits_but_not_what_is_on_the_wire(talker):
    late = talker(1, (20_000, Frame(0x081, bytes(8))))
    network, log = network_of(late)
    network.submit(Frame(0x701, b"\x05"))  # 47 + 8 + 41 // 4 = 65 bits
    network.submit(Frame(0x7FF, bytes(8)))
    assert network.run_until(FAR_NS).at_ns == 200_000
    network.run_until(FAR_NS)
    assert log == [(65_000, 0x701), (200_000, 0x081), (335_000, 0x7FF)]


def test_a_node_offers_its_lowest_identifier_first(talker):
    chatty = talker(1, (0, Frame(0x701)), (0, Frame(0x081)))
    network, log = network_of(chatty, talker(2, (0, Frame(0x702))))
    while network.run_until(FAR_NS) is not None:
        pass
    assert [can_id for _, can_id in log] == [0x081, 0x701, 0x702]


def test_a_nodes_frames_of_one_identifier_keep_their_order(talker):
    segments = [Frame(0x581, bytes([k])) for k in (3, 1, 2)]
    network, _ = network_of(talker(1, *((0, segment) for segment in segments)))
    arrivals = [network.run_until(FAR_NS) for _ in segments]
    assert [arrival.frame for arrival in arrivals] == segments


def test_a_frame_that_is_ready_later_holds_nothing_back(talker):
    network, log = network_of(talker(1, (0, Frame(0x581)), (0, Frame(0x181))))
    network.submit(Frame(0x080))
    while network.run_until(FAR_NS) is not None:
        pass
    assert [can_id for _, can_id in log] == [0x080, 0x181, 0x581]


def test_what_becomes_ready_the_instant_the_wire_is_idle_takes_part(talker):
    network, log = network_of(talker(1, (55_000, Frame(0x081))))
    network.submit(Frame(0x080))
    network.submit(Frame(0x600))
    while network.run_until(FAR_NS) is not None:
        pass
    assert [can_id for _, can_id in log] == [0x080, 0x081, 0x600]


def test_what_the_master_submits_at_a_deadline_takes_part_in_the_arbitration_of_that_instant(talker):
    network, log = network_of(talker(1, (100_000, Frame(0x700))))
    assert network.run_until(100_000) is None
    network.submit(Frame(0x100))
    network.run_until(FAR_NS)
    assert [can_id for _, can_id in log] == [0x100, 0x700]


def test_all_but_the_sender_hear_a_frame_at_its_end(talker):
    one, two, three = talker(1, (0, Frame(0x181))), talker(2), talker(3)
    network, _ = network_of(one, two, three)
    arrival = network.run_until(FAR_NS)
    assert (arrival.at_ns, arrival.frame) == (55_000, Frame(0x181))
    network.submit(Frame(0x000, b"\x01\x00"))
    assert network.run_until(FAR_NS) is None  # the master does not hear itself
    nmt = (55_000 + 75_000, Frame(0x000, b"\x01\x00"))  # 47 + 16 + 49 // 4 = 75 bits
    assert one.heard == [nmt]
    assert two.heard == three.heard == [(55_000, Frame(0x181)), nmt]


def test_a_frame_that_ends_at_the_deadline_arrives_and_one_that_ends_later_does_not(talker):
    network, _ = network_of(talker(1, (0, Frame(0x181))))
    assert network.run_until(54_999) is None
    assert network.now_ns() == 54_999
    assert network.run_until(55_000).at_ns == 55_000


def test_a_deadline_in_the_past_moves_nothing(talker):
    network, _ = network_of(talker(1))
    network.run_until(1_000)
    assert network.run_until(10) is None
    assert network.now_ns() == 1_000


def test_a_remote_frame_takes_no_bits_for_its_data(talker):
    network, log = network_of(talker(1))
    network.submit(Frame(0x701, bytes(8), remote=True))
    network.run_until(FAR_NS)
    assert log == [(55_000, 0x701)]


def test_an_extended_frame_is_longer(talker):
    network, log = network_of(talker(1))
    network.submit(Frame(0x701, bytes(8), extended=True))
    network.run_until(FAR_NS)
    assert log == [(160_000, 0x701)]  # 67 + 64 + (53 + 64) // 4


def test_the_longest_wait_is_reported(talker):
    network, _ = network_of(talker(1, (0, Frame(0x181, bytes(8)))), talker(2, (1_000, Frame(0x182))))
    while network.run_until(FAR_NS) is not None:
        pass
    assert network.statistics.longest_wait_ns == 134_000


def test_a_bit_rate_of_zero_is_refused():
    with pytest.raises(ValueError, match="0 bit/s"):
        SimulatedNetwork(SimulatedDevices([]), 0)


@given(
    periods=st.lists(st.integers(40_000, 900_000), min_size=1, max_size=4),
    slices=st.lists(st.integers(0, 700_000), min_size=1, max_size=20),
)
def test_how_a_caller_slices_time_changes_nothing(drive, periods, slices):
    def log_of(deadlines: list[int]) -> list[tuple[int, int]]:
        network, log = network_of(*(drive(n, period_ns=p) for n, p in enumerate(periods, start=1)))
        for deadline in deadlines:
            while network.run_until(deadline) is not None:
                pass
        return log

    deadlines = [sum(slices[: k + 1]) for k in range(len(slices))]
    assert log_of(deadlines) == log_of(deadlines[-1:])
