"""Frames in batches on the unix bus: their order and times, who comes and who goes, and what is counted."""

from __future__ import annotations

import select
import signal
import time

import can
import pytest
from cyclic_bench import EMERGENCY, two_axes

from torquerig.driver.bus import unix_connections
from torquerig.driver.bus.batches import BatchBus
from torquerig.driver.bus.cyclic import OTHER
from torquerig.driver.bus.url import open_bus
from torquerig.driver.wire.frame import Frame

PATIENCE_NS = 20 * 10**9  # real time on a shared machine: order and content are asserted, never speed
LONG_AGO = 0


@pytest.fixture
def join(tmp_path):
    """Opens members of one bus."""
    joined = []

    def join(tap=None):
        joined.append(open_bus(f"unix:{tmp_path / 'bus'}", bitrate=1_000_000, tap=tap, spin_ns=0))
        return joined[-1]

    yield join
    for bus in joined:
        bus.close()


def numbered(number: int) -> Frame:
    return Frame(0x181, number.to_bytes(4, "little"))


def take(bus, count: int) -> list:
    arrivals = [bus.receive(time.monotonic_ns() + PATIENCE_NS) for _ in range(count)]
    assert None not in arrivals
    return arrivals


def frames(bus, count: int) -> list[Frame]:
    return [arrival.frame for arrival in take(bus, count)]


def in_a_moment(act) -> None:
    """Have a signal act while somebody waits."""
    signal.signal(signal.SIGALRM, lambda *_: act())
    signal.setitimer(signal.ITIMER_REAL, 0.05)


@pytest.fixture
def handled():
    before = signal.getsignal(signal.SIGALRM)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


class TestBatches:
    def test_frames_of_any_number_go_out_whole_and_in_order(self, join):
        one, two = join(), join()
        said = [Frame(0x100 + k, bytes(range(k % 9))) for k in range(3 * unix_connections.FRAMES + 1)]
        assert isinstance(one, BatchBus)
        assert one.send_all(said) == len(said)
        assert frames(two, len(said)) == said

    def test_none_are_none(self, join):
        one, two = join(), join()
        assert one.send_all([]) == 0
        assert two.receive(LONG_AGO) is None

    def test_remote_frames_carry_no_data_of_frames_before_them(self, join):
        one, two = join(), join()
        said = [Frame(0x181, b"\xff" * 8), Frame(0x181, bytes(8), remote=True), Frame(0x1FFF_FFFF, b"x", extended=True)]
        one.send_all(said)
        assert frames(two, 3) == said

    def test_through_a_port_remote_frames_carry_none_either(self, join):
        one, two = join(), join()
        port = two.open_cyclic(two_axes())
        said = [Frame(0x701, b"\xff" * 8), Frame(0x701, bytes(8), remote=True)]
        one.send_all(said)
        assert port.take(time.monotonic_ns() + PATIENCE_NS) == OTHER
        assert [arrival.frame for arrival in port.others()] == said

    def test_one_that_is_no_can_frame_is_refused_like_a_single_one(self, join):
        with pytest.raises(ValueError, match="classic CAN"):
            join().send_all([Frame(0x181), Frame(0x800)])

    def test_members_frames_come_in_the_order_of_sending_with_the_times_of_sending(self, join):
        late, one, two = join(), join(), join()
        before_ns = time.monotonic_ns()
        for k in range(20):
            (one if k % 3 else two).send(numbered(k))
        after_ns = time.monotonic_ns()
        arrivals = take(late, 20)
        assert [arrival.frame for arrival in arrivals] == [numbered(k) for k in range(20)]
        times = [arrival.at_ns for arrival in arrivals]
        assert len(set(times)) == 20
        assert [before_ns, *times, after_ns] == sorted([before_ns, *times, after_ns])

    def test_the_tap_is_told_all_in_the_order_of_time(self, join):
        log = []
        one, two = join(lambda at_ns, frame: log.append((at_ns, frame))), join()
        two.send_all([numbered(0), numbered(1)])
        take(one, 2)
        one.send_all([numbered(2), numbered(3)])
        assert [frame for _, frame in log] == [numbered(k) for k in range(4)]
        assert [at_ns for at_ns, _ in log] == sorted(at_ns for at_ns, _ in log)


class TestMembers:
    def test_a_newcomer_is_let_in_also_while_frames_wait(self, join):
        one, two = join(), join()
        two.send_all([numbered(0), numbered(1)])
        newcomer = join()
        take(one, 1)
        assert one._member.members == 2
        one.send(numbered(2))
        assert frames(newcomer, 1) == [numbered(2)]
        assert frames(one, 1) == [numbered(1)]

    def test_what_a_member_said_before_it_left_is_heard(self, join):
        one, two, three = join(), join(), join()
        one.send(numbered(9))  # unread by the one that leaves
        two.send_all([numbered(0), numbered(1)])
        two.close()
        one.send(numbered(9))
        assert frames(one, 2) == [numbered(0), numbered(1)]
        assert one._member.members == 1
        assert frames(three, 4) == [numbered(9), numbered(0), numbered(1), numbered(9)]

    def test_more_members_than_compiled_code_knows_hear_each_other(self, join, monkeypatch):
        monkeypatch.setattr(unix_connections, "MOST_PEERS", 1)
        one, two, three = join(), join(), join()
        one.send(numbered(0))
        assert frames(two, 1) == frames(three, 1) == [numbered(0)]
        two.send_all([numbered(1), numbered(2)])
        assert frames(one, 2) == frames(three, 2) == [numbered(1), numbered(2)]
        assert one.open_cyclic(two_axes()) is None
        three.close()
        two.send(numbered(3))
        assert frames(one, 1) == [numbered(3)]
        assert one.counts["missed"] == two.counts["not_taken"] == 0

    def test_python_cans_way_and_ours_take_turns_without_a_gap(self, join):
        one, two = join(), join()
        for k in range(20):
            one.send_all([numbered(k), numbered(k)])
            one._bus.send(can.Message(arbitration_id=0x181, data=numbered(k).data, is_extended_id=False))
            if k % 2:
                assert two._bus.recv(20.0) is not None
            take(two, 2 if k % 2 else 3)
        assert two.receive(LONG_AGO) is None
        assert two.counts["missed"] == two.counts["malformed"] == 0


class TestWhatIsCounted:
    def test_what_a_member_cannot_take_and_what_it_missed(self, join):
        one, stalled = join(), join()
        total = 0
        while one.counts["not_taken"] < 100:
            total += one.send_all([numbered(k) for k in range(total, total + 50)])
        lost = one.counts["not_taken"]
        kept = 0
        while stalled.receive(LONG_AGO) is not None:
            kept += 1
        assert kept == total - lost
        one.send(numbered(total))
        take(stalled, 1)
        assert stalled.counts["missed"] == lost

    def test_packets_that_are_no_frames_and_error_frames(self, join):
        one, two = join(), join()
        one.receive(LONG_AGO)
        (stranger,) = one._member._peers.values()
        stranger.connection.send(b"nonsense")
        one._bus.send(can.Message(is_error_frame=True))
        one.send(numbered(1))
        assert frames(two, 1) == [numbered(1)]
        assert (two.counts["malformed"], two.counts["error"]) == (1, 1)


class TestWaiting:
    def test_the_descriptor_is_readable_as_long_as_frames_wait(self, join):
        one, two = join(), join()
        one.send(numbered(0))
        take(two, 1)
        assert not select.select([two], [], [], 0)[0]
        one.send_all([numbered(k) for k in range(5)])
        for _ in range(5):
            assert select.select([two], [], [], 20.0)[0]
            take(two, 1)
        assert not select.select([two], [], [], 0)[0]

    @pytest.mark.usefixtures("handled")
    def test_a_signal_does_not_end_a_wait_for_frames_and_is_no_error(self, join):
        one, two = join(), join()
        in_a_moment(lambda: one.send(numbered(0)))
        assert frames(two, 1) == [numbered(0)]
        seen = []
        in_a_moment(lambda: seen.append(True))
        due_ns = time.monotonic_ns() + 100_000_000
        assert two.receive(due_ns) is None
        assert time.monotonic_ns() >= due_ns
        assert seen

    @pytest.mark.usefixtures("handled")
    def test_a_signal_ends_a_ports_wait_without_an_error(self, join):
        one = join()
        port = one.open_cyclic(two_axes())
        seen = []
        in_a_moment(lambda: seen.append(True))
        flags = 0
        while not seen:
            flags |= port.take(time.monotonic_ns() + PATIENCE_NS)
        assert flags == 0
        join().send(EMERGENCY)


def test_frames_that_wait_end_with_the_bus(join):
    one, two = join(), join()
    one.send_all([numbered(0), numbered(1)])
    take(two, 1)
    two.close()
    with pytest.raises(Exception, match="closed"):
        two.receive(LONG_AGO)
