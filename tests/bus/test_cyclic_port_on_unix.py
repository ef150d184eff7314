"""The port of the unix bus: members come and go, port and frames share the connections."""

import time

import pytest
from cyclic_bench import EMERGENCY, LONG_AGO, PATIENCE_NS, BusBench, answer, take_until, two_axes

from torquerig.driver.bus.cyclic import DONE, OTHER
from torquerig.driver.bus.url import open_bus
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sync import SYNC_FRAME


@pytest.fixture
def bench(tmp_path):
    bench = BusBench(f"unix:{tmp_path / 'bus'}", None)
    bench.url, bench.cycle = f"unix:{tmp_path / 'bus'}", two_axes()
    bench.port = bench.bus.open_cyclic(bench.cycle)
    yield bench
    bench.close()


def test_nothing_is_missed_when_port_and_frames_take_turns(bench):
    for number in range(20):
        bench.port.sync(LONG_AGO, True)
        bench.bus.send(Frame(0x600, bytes([number])))
        for frame in (answer(0), EMERGENCY, answer(1)):
            bench.say(frame)
        take_until(bench.port, DONE)
        while not bench.port.others():
            bench.port.take(time.monotonic_ns() + PATIENCE_NS)
        bench.say(EMERGENCY)
        assert bench.bus.receive(time.monotonic_ns() + PATIENCE_NS).frame == EMERGENCY
        assert len(bench.heard(2)) == 2
    bench.bus.close_cyclic()
    bench.bus.send(SYNC_FRAME)
    assert bench.heard(1) == [SYNC_FRAME]
    for bus in (bench.bus, bench.neighbour):
        assert bus.counts["missed"] == bus.counts["malformed"] == bus.counts["not_taken"] == 0


def test_a_newcomer_hears_the_next_sync_and_one_who_left_is_no_trouble(bench):
    bench.port.sync(LONG_AGO, True)
    newcomer = open_bus(bench.url, bitrate=1_000_000, spin_ns=0)
    assert bench.port.sync(LONG_AGO, True) == OTHER
    assert list(bench.port.others()) == []
    assert bench.port.sync(LONG_AGO, True) == 0
    assert newcomer.receive(time.monotonic_ns() + PATIENCE_NS).frame == SYNC_FRAME
    newcomer.send(EMERGENCY)
    newcomer.close()
    assert bench.port.sync(LONG_AGO, True) == OTHER
    assert [arrival.frame for arrival in bench.port.others()] == [EMERGENCY]
    assert bench.port.sync(LONG_AGO, True) in {0, OTHER}
    bench.port.others()
    assert bench.port.sync(LONG_AGO, True) == 0
    assert bench.bus._member.members == 1


def test_a_neighbour_that_does_not_read_is_counted_and_holds_nobody_up(bench):
    for _ in range(3000):
        bench.port.sync(LONG_AGO, False)
    bench.bus.close_cyclic()
    assert bench.bus.counts["not_taken"] > 0
