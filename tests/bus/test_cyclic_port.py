"""A cycle through a bus's port: what is sent, what is understood, what is left for others, and what the log says."""

from __future__ import annotations

import math
import threading
import time

import pytest
from cyclic_bench import (
    EMERGENCY,
    LONG_AGO,
    PATIENCE_NS,
    RPDO,
    SCALES,
    BusBench,
    PairBench,
    answer,
    count,
    take_until,
    two_axes,
)

from torquerig.driver.bus.cyclic import CHANGED, DONE, EARLY, NOT_A_NUMBER, ODD, OTHER, CyclicBus
from torquerig.driver.bus.url import open_bus
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sync import SYNC_FRAME

BUSES = ["unix", pytest.param("socketcan", marks=pytest.mark.vcan)]
on_buses_alone = pytest.mark.parametrize("bench", BUSES, indirect=True)  # a pair of sockets has no kernel behind it


@pytest.fixture(params=["pair", *BUSES])
def bench(request, tmp_path):
    log = []

    def tap(at_ns, frame):
        log.append((at_ns, frame))

    if request.param == "pair":
        bench = PairBench(tap)
    else:
        bench = BusBench(f"unix:{tmp_path / 'bus'}" if request.param == "unix" else "socketcan:vcan0", tap)
    bench.log, bench.cycle = log, two_axes()
    bench.port = bench.bus.open_cyclic(bench.cycle)
    bench.told = bench.cycle.block["told"][0, :6].reshape(3, 2)
    yield bench
    bench.close()


class TestACycle:
    def test_answers_are_understood_in_si_units_and_commands_are_what_frames_would_be(self, bench):
        assert bench.port.sync(LONG_AGO, True) == 0
        assert bench.heard(1) == [SYNC_FRAME]
        bench.say(answer(0, position=1000, torque=-500))
        bench.say(answer(1, position=-70000, torque=300))
        flags = take_until(bench.port, DONE)
        assert flags & DONE
        assert flags & CHANGED
        assert bench.told[0].tolist() == [SCALES[0].angle(1000), SCALES[1].angle(-70000)]
        assert bench.told[1].tolist() == [SCALES[0].torque(-500), SCALES[1].torque(300)]
        assert bench.cycle.block["statusword"][0, :2].tolist() == [0x1237] * 2
        bench.cycle.block["wanted"][0, :2] = 0.1, 0.9
        bench.cycle.block["controlword"][0, :2] = 0x0F, 0x06
        assert bench.port.command(0, True) == 0
        counts = [scale.torque_counts(torque) for scale, torque in zip(SCALES, (0.1, 0.9), strict=True)]
        assert counts[1] == -1000  # held within what the object can carry
        words = [RPDO.pack((0x0F, counts[0])), RPDO.pack((0x06, counts[1]))]
        assert bench.heard(2) == [Frame(0x201 + axis, word) for axis, word in enumerate(words)]

    def test_answers_come_after_their_sync_on_one_clock(self, bench):
        bench.port.sync(LONG_AGO, True)
        for axis in range(2):
            bench.say(answer(axis))
        take_until(bench.port, DONE)
        age_ns = time.monotonic_ns() - count(bench, "sync_ns")
        assert all(-1_000_000 <= at_ns <= age_ns for at_ns in bench.told[2])

    def test_before_its_time_no_sync_is_sent(self, bench):
        assert bench.port.sync(time.monotonic_ns() + PATIENCE_NS, True) == EARLY
        bench.port.sync(LONG_AGO, True)
        bench.port.sync(LONG_AGO, True)
        assert bench.heard(2) == [SYNC_FRAME] * 2

    def test_an_answer_from_before_the_sync_is_late_and_does_not_count(self, bench):
        bench.say(answer(0, position=5))
        bench.port.sync(LONG_AGO, True)
        assert take_until(bench.port, ODD, 1_000_000) & (DONE | ODD) == ODD
        assert count(bench, "late") == 1
        assert math.isnan(bench.told[2, 0])
        for axis in range(2):
            bench.say(answer(axis, position=7))
        assert take_until(bench.port, DONE) & DONE
        assert bench.told[0, 0] == SCALES[0].angle(7)

    def test_a_wait_for_answers_ends_at_its_time_with_those_that_came(self, bench):
        bench.port.sync(LONG_AGO, True)
        bench.say(answer(1))
        assert not take_until(bench.port, DONE, 20_000_000) & DONE
        assert bench.cycle.block["answered"][0, :2].tolist() == [0, 1]

    def test_the_same_answer_twice_is_not_that_of_two(self, bench):
        bench.port.sync(LONG_AGO, True)
        bench.say(answer(0))
        bench.say(answer(0))
        assert not take_until(bench.port, DONE, 20_000_000) & DONE

    def test_a_short_answer_is_malformed(self, bench):
        bench.port.sync(LONG_AGO, True)
        bench.say(Frame(0x181, bytes(3)))
        assert take_until(bench.port, ODD) & ODD
        assert count(bench, "malformed") == 1

    def test_what_is_no_number_is_not_sent(self, bench):
        bench.cycle.block["wanted"][0, 0] = math.nan
        assert bench.port.command(0, True) == NOT_A_NUMBER
        bench.port.sync(LONG_AGO, True)
        assert bench.heard(1) == [SYNC_FRAME]


class TestFramesOfOneTake:
    def test_what_comes_behind_the_last_answer_waits_for_the_next_sync(self, bench):
        bench.port.sync(LONG_AGO, True)
        for frame in (answer(0), answer(1), answer(1, position=5)):
            bench.say(frame)
        assert take_until(bench.port, DONE) & ODD == 0
        bench.port.sync(LONG_AGO, True)
        for axis in range(2):
            bench.say(answer(axis))
        assert take_until(bench.port, DONE) & ODD
        assert count(bench, "late") == 1

    def test_tpdos_that_are_no_answers_are_taken_with_those_that_are(self, bench):
        bench.cycle.block["answer"]["answers"][0, 1] = 0
        bench.cycle.block["besides"] = 1
        bench.port.sync(LONG_AGO, True)
        bench.cycle.block["unanswered"] = 1
        bench.say(answer(0))
        bench.say(answer(1, position=5))
        assert take_until(bench.port, DONE) & DONE
        if bench.told[0, 1] != SCALES[1].angle(5):  # on a real bus it may come a moment later
            bench.port.take(time.monotonic_ns() + PATIENCE_NS)
        assert bench.told[0, 1] == SCALES[1].angle(5)

    def test_a_flood_behind_the_answers_is_all_taken_before_the_next_sync(self, bench):
        bench.port.sync(LONG_AGO, True)
        for _ in range(5):  # fewer than a queue of datagrams holds
            bench.say(answer(0))
        bench.say(answer(1))
        assert take_until(bench.port, DONE) & DONE
        for _ in range(5):
            bench.say(answer(0))
        bench.port.sync(LONG_AGO, True)
        assert count(bench, "late") == 5


def test_others_run_python_while_a_port_waits(bench):
    begun = threading.Event()

    def reply():
        begun.wait()
        for axis in range(2):
            bench.say(answer(axis))

    bench.port.sync(LONG_AGO, True)
    thread = threading.Thread(target=reply)
    thread.start()
    begun.set()
    began_ns = time.monotonic_ns()
    assert take_until(bench.port, DONE) & DONE
    thread.join()
    assert time.monotonic_ns() - began_ns < PATIENCE_NS


class TestOtherFrames:
    def test_one_that_waits_is_handed_out_before_the_sync(self, bench):
        bench.say(EMERGENCY)
        assert bench.port.sync(LONG_AGO, True) == OTHER
        assert [arrival.frame for arrival in bench.port.others()] == [EMERGENCY]
        assert bench.port.sync(LONG_AGO, True) == 0
        assert bench.heard(1) == [SYNC_FRAME]

    def test_one_that_came_since_the_sync_is_handed_out_before_the_command(self, bench):
        bench.port.sync(LONG_AGO, True)
        bench.say(EMERGENCY)
        assert bench.port.command(0, True) == OTHER
        assert [arrival.frame for arrival in bench.port.others()] == [EMERGENCY]
        assert list(bench.port.others()) == []
        assert bench.port.command(0, False) == 0
        assert [frame.can_id for frame in bench.heard(3)] == [0x080, 0x201, 0x202]

    def test_one_ends_a_wait_for_answers(self, bench):
        bench.port.sync(LONG_AGO, True)
        bench.say(EMERGENCY)
        assert take_until(bench.port, OTHER) & OTHER

    def test_they_come_through_receive_as_well_and_so_do_answers(self, bench):
        bench.say(EMERGENCY)
        bench.say(answer(0))
        frames = {bench.bus.receive(time.monotonic_ns() + PATIENCE_NS).frame for _ in range(2)}
        assert frames == {EMERGENCY, answer(0)}

    @on_buses_alone
    def test_what_a_port_left_is_received_after_it_was_closed(self, bench):
        bench.say(EMERGENCY)
        bench.port.sync(LONG_AGO, True)
        bench.bus.close_cyclic()
        bench.say(answer(0))
        frames = [bench.bus.receive(time.monotonic_ns() + PATIENCE_NS).frame for _ in range(2)]
        assert frames == [EMERGENCY, answer(0)]


@on_buses_alone
def test_the_tap_is_told_all_frames_in_the_order_of_their_times(bench):
    said = []
    for _ in range(3):
        bench.port.sync(LONG_AGO, True)
        bench.say(answer(0))
        bench.say(EMERGENCY)
        bench.say(answer(1))
        flags = take_until(bench.port, DONE)
        while not flags & OTHER:
            flags |= bench.port.command(0, True)
        assert len(bench.port.others()) == 1
        bench.port.command(0, False)
        bench.bus.send(Frame(0x77F, b"\x05"))
        said += [SYNC_FRAME, answer(0), EMERGENCY, answer(1), 0x201, 0x202, Frame(0x77F, b"\x05")]
    bench.bus.close()
    assert [frame.can_id for _, frame in bench.log] == [getattr(frame, "can_id", frame) for frame in said]
    assert [at_ns for at_ns, _ in bench.log] == sorted(at_ns for at_ns, _ in bench.log)


def test_a_closed_bus_has_no_port(bench):
    bench.bus.close()
    bench.bus.close()
    with pytest.raises(BusError, match="closed"):
        bench.bus.open_cyclic(bench.cycle)


def test_buses_without_a_port_offer_none():
    bus = open_bus("virtual:without-a-port", bitrate=1_000_000)
    try:
        assert not isinstance(bus, CyclicBus)
    finally:
        bus.close()
