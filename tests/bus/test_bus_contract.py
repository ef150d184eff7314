"""What every bus promises, asked of every bus."""

from __future__ import annotations

import can
import pytest

from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Frame

PATIENCE_NS = 20 * 10**9
MANY = 100


def take(bench, count: int) -> list:
    """Return the next `count` arrivals, those of own frames left out where the bus echoes."""
    arrivals = []
    while len(arrivals) < count:
        arrival = bench.bus.receive(bench.bus.now_ns() + PATIENCE_NS)
        assert arrival is not None, f"{len(arrivals)} of {count} frames came"
        arrivals.append(arrival)
    return arrivals


class TestAnyBus:
    def test_a_members_frames_arrive_in_order_and_whole(self, bench):
        said = [Frame(0x181, k.to_bytes(4, "little") + bytes(k % 5)) for k in range(MANY)]
        for frame in said:
            bench.say(0, frame)
        assert [arrival.frame for arrival in take(bench, MANY)] == said

    def test_every_member_hears_every_frame(self, bench):
        sent = [Frame(0x200 + k, bytes([k])) for k in range(10)]
        for frame in sent:
            bench.bus.send(frame)
        assert bench.heard(0, 10)[-10:] == sent
        assert bench.heard(1, 10)[-10:] == sent

    def test_remote_and_extended_frames_keep_what_they_are(self, bench):
        said = [Frame(0x701, b"\x00", remote=True), Frame(0x18FF0102, b"\x07", extended=True), Frame(0x000, bytes(8))]
        for frame in said:
            bench.say(0, frame)
        assert {arrival.frame for arrival in take(bench, 3)} == set(said)

    def test_a_member_hears_itself_only_on_a_bus_that_cannot_but_echo(self, bench):
        bench.bus.send(Frame(0x123))
        bench.say(0, Frame(0x181))
        expected = [Frame(0x123), Frame(0x181)] if bench.echoes else [Frame(0x181)]
        assert [arrival.frame for arrival in take(bench, len(expected))] == expected
        assert bench.bus.receive(bench.bus.now_ns() + 1_000_000) is None

    def test_arrival_times_never_run_backwards_and_are_past(self, bench):
        before_ns = bench.bus.now_ns()
        for k in range(MANY):
            bench.say(k % 2, Frame(0x181 + k % 2, bytes([k])))
        times = [arrival.at_ns for arrival in take(bench, MANY)]
        assert times == sorted(times)
        assert before_ns - 1_000_000 <= times[0]  # epoch timestamps are doubles, 0.24 us apart
        assert times[-1] <= bench.bus.now_ns()

    def test_receiving_returns_nothing_once_the_deadline_has_come_and_not_before(self, bench):
        due_ns = bench.bus.now_ns() + 3_000_000
        assert bench.bus.receive(due_ns) is None
        assert bench.bus.now_ns() >= due_ns

    def test_waiting_returns_once_the_deadline_has_come_and_not_before(self, bench):
        due_ns = bench.bus.now_ns() + 3_000_000
        bench.bus.wait_until(due_ns)
        assert bench.bus.now_ns() >= due_ns

    def test_what_came_during_a_wait_is_received_after_it_even_if_the_deadline_is_past(self, bench):
        bench.say(0, Frame(0x181))
        bench.say(0, Frame(0x281))
        bench.bus.wait_until(bench.bus.now_ns() + 20_000_000)
        arrivals = [bench.bus.receive(bench.bus.now_ns() - 1) for _ in range(2)]
        assert [arrival.frame.can_id for arrival in arrivals] == [0x181, 0x281]

    def test_filters_let_pass_what_they_name(self, bench):
        bench.python_can.set_filters([{"can_id": 0x180, "can_mask": 0x780, "extended": False}])
        for can_id in (0x080, 0x181, 0x281, 0x182):
            bench.say(0, Frame(can_id))
        assert [arrival.frame.can_id for arrival in take(bench, 2)] == [0x181, 0x182]

    def test_python_can_reads_and_writes_the_same_bus(self, bench):
        bench.say(0, Frame(0x181, b"\x01\x02"))
        message = bench.python_can.recv(20.0)
        assert (message.arbitration_id, bytes(message.data), message.is_extended_id) == (0x181, b"\x01\x02", False)
        bench.python_can.send(can.Message(arbitration_id=0x201, data=b"\x03", is_extended_id=False))
        assert bench.heard(1, 2) == [Frame(0x181, b"\x01\x02"), Frame(0x201, b"\x03")]

    def test_the_tap_sees_what_is_sent_and_what_comes(self, bench):
        bench.bus.send(Frame(0x201))
        bench.say(0, Frame(0x281))
        take(bench, 2 if bench.echoes else 1)
        assert {frame.can_id for _, frame in bench.log} == {0x201, 0x281}
        assert all(at_ns <= bench.bus.now_ns() for at_ns, _ in bench.log)

    @pytest.mark.parametrize("frame", [Frame(0x800), Frame(-1), Frame(0x1, bytes(9)), Frame(1 << 29, extended=True)])
    def test_what_is_no_can_frame_is_the_callers_mistake(self, bench, frame):
        with pytest.raises(ValueError, match="classic CAN"):
            bench.bus.send(frame)

    def test_an_idle_bus_closes_and_may_be_closed_again(self, bench):
        bench.bus.close()
        bench.bus.close()

    def test_a_closed_bus_says_so(self, bench):
        bench.bus.close()
        with pytest.raises(BusError, match="closed"):
            bench.bus.send(Frame(0x080))
        with pytest.raises(BusError, match="closed"):
            bench.bus.receive(0)
