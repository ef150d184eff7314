"""The pump: what is due is sent in time, what arrives is handed out by COB-ID, and nothing is dropped silently."""

from __future__ import annotations

import pytest

from torquerig.driver.master.pump import FAR_NS, HeartbeatProducer, Pump, name_drives
from torquerig.driver.wire.frame import Frame

MS = 1_000_000


class Every:
    """Notes when it is fired."""

    def __init__(self, due_ns: int, period_ns: int) -> None:
        self.due_ns = due_ns
        self.period_ns = period_ns
        self.fired: list[int] = []

    def fire(self, now_ns: int) -> None:
        self.fired.append(now_ns)
        self.due_ns += self.period_ns


@pytest.fixture
def bus(fake_bus):
    return fake_bus(start_ns=0)


def test_frames_go_to_whoever_waits_for_their_cob_id(bus):
    pump = Pump(bus)
    heard: list[tuple[int, bytes]] = []
    pump.handlers[0x181] = lambda at_ns, data: heard.append((at_ns, data))
    bus.inject(2 * MS, Frame(0x181, b"two"))
    bus.inject(1 * MS, Frame(0x181, b"one"))
    bus.inject(3 * MS, Frame(0x182, b"nobody's"))
    assert not pump.serve(5 * MS)
    assert heard == [(MS, b"one"), (2 * MS, b"two")]
    assert pump.counts.unknown == 1
    assert bus.now_ns() == 5 * MS


def test_remote_and_extended_frames_are_counted_and_not_handed_out(bus):
    pump = Pump(bus)
    pump.handlers[0x181] = lambda _at_ns, _data: pytest.fail("handed out")
    bus.inject(MS, Frame(0x181, bytes(8), remote=True))
    bus.inject(MS, Frame(0x181, bytes(8), extended=True))
    pump.serve(2 * MS)
    assert pump.counts.unknown == 2


def test_serving_ends_when_it_is_done_and_not_later(bus):
    pump = Pump(bus)
    heard: list[int] = []
    pump.handlers[0x181] = lambda at_ns, _data: heard.append(at_ns)
    bus.inject(MS, Frame(0x181))
    assert pump.serve(5 * MS, lambda: bool(heard))
    assert bus.now_ns() == MS


def test_what_is_due_happens_at_its_time(bus):
    pump = Pump(bus)
    timed = Every(MS, MS)
    pump.add_timed(timed)
    bus.inject(1_500_000, Frame(0x181))
    pump.serve(4 * MS)
    assert timed.fired == [MS, 2 * MS, 3 * MS, 4 * MS]
    pump.remove_timed(timed)
    pump.serve(9 * MS)
    assert len(timed.fired) == 4


def test_a_flood_of_frames_delays_neither_what_is_due_nor_the_end(bus):
    pump = Pump(bus)
    timed = Every(MS, MS)
    pump.add_timed(timed)
    for number in range(1000):
        bus.inject(number * 50_000, Frame(0x7FF))
    pump.serve(10 * MS)
    assert timed.fired == [number * MS for number in range(1, 11)]
    assert bus.now_ns() == 10 * MS
    assert pump.counts.unknown == 201


def test_queued_frames_are_handed_out_also_when_the_time_is_past(bus):
    pump = Pump(bus)
    heard: list[int] = []
    pump.handlers[0x181] = lambda at_ns, _data: heard.append(at_ns)
    for at_ns in (MS, 2 * MS, 3 * MS):
        bus.inject(at_ns, Frame(0x181))
    bus.wait_until(10 * MS)
    pump.serve(4 * MS)
    assert heard == [MS, 2 * MS, 3 * MS]


def test_a_heartbeat_that_was_late_is_not_caught_up_in_a_burst(bus):
    pump = Pump(bus)
    pump.add_timed(HeartbeatProducer(pump, 127, 40 * MS))
    pump.serve(100 * MS)
    bus.wait_until(500 * MS)
    pump.serve(600 * MS)
    beats = [at for at, _ in bus.log]
    assert beats == [0, 40 * MS, 80 * MS, 500 * MS, 520 * MS, 560 * MS, 600 * MS]
    assert all(frame == Frame(0x77F, b"\x05") for _, frame in bus.log)


@pytest.mark.parametrize("echo", [True, False])
def test_whether_own_frames_come_back_is_learned_from_one(fake_bus, echo):
    bus = fake_bus(echo=echo)
    pump = Pump(bus)
    pump.learn_echo(Frame(0x77F, b"\x00"), 10 * MS)
    assert pump.echoes is echo
    pump.send(Frame(0x080))
    pump.handlers[0x080] = lambda _at_ns, _data: pytest.fail("an own SYNC is nobody else's")
    pump.serve(bus.now_ns() + MS)
    assert pump.counts.echoed == int(echo)


def test_far_is_later_than_any_time():
    assert FAR_NS > 100 * 365 * 86400 * 10**9


@pytest.mark.parametrize(
    ("node_ids", "words"),
    [([2], "drive 2"), ([1, 3], "drives 1 and 3"), ([1, 2, 3], "drives 1, 2 and 3")],
)
def test_drives_are_named_in_words(node_ids, words):
    assert name_drives(node_ids) == words
