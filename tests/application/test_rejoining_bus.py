"""A bus that goes and comes back: whoever lives on it goes on in time, and hears and speaks again."""

import pytest

from torquerig.driver.errors import BusError, BusUrlError, LinkLost
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.rejoining import RejoiningBus

FRAME = Frame(0x80)
MS = 1_000_000


class Link:
    """An interface, and every bus that was opened on it."""

    def __init__(self):
        self.up = True
        self.opened = []

    def open(self):
        if not self.up:
            raise BusUrlError("no such interface")
        self.opened.append(Opened(self))
        return self.opened[-1]


class Opened:
    def __init__(self, link):
        self.link = link
        self.ill = False
        self.full = False
        self.closed = False
        self.sent = []

    def send(self, frame):
        if not self.link.up:
            raise LinkLost("down")
        if self.full:
            raise BusError("its send queue is full")
        self.sent.append(frame)

    def receive(self, until_ns):
        if self.ill or not self.link.up:
            raise BusError("down")
        return Arrival(until_ns, FRAME)

    def close(self):
        self.closed = True


@pytest.fixture
def link():
    return Link()


@pytest.fixture
def told():
    return []


@pytest.fixture
def bus(link, told):
    return RejoiningBus(link.open, told.append)


def test_a_bus_that_never_was_there_is_refused_at_once(link):
    link.up = False
    with pytest.raises(BusUrlError):
        RejoiningBus(link.open, print)


def test_while_it_is_gone_time_passes_and_nothing_comes(link, told, bus):
    link.up = False
    until_ns = bus.now_ns() + 20 * MS
    assert bus.receive(until_ns) is None
    assert bus.now_ns() >= until_ns
    with pytest.raises(LinkLost):
        bus.send(FRAME)
    assert link.opened[0].closed
    assert told == ["down; the drives live on and wait for it"]


@pytest.mark.parametrize("first", ["send", "receive"])
def test_back_again_it_carries_frames_both_ways(link, told, bus, first):
    link.up = False
    if first == "send":
        with pytest.raises(LinkLost):
            bus.send(FRAME)
    else:
        assert bus.receive(bus.now_ns()) is None
    link.up = True
    assert bus.receive(bus.now_ns()) is not None
    bus.send(FRAME)
    assert link.opened[-1].sent == [FRAME]
    assert told == ["down; the drives live on and wait for it", "the bus is back"]


def test_a_link_that_is_up_again_before_anybody_looked_is_joined_again(link, told, bus):
    link.opened[0].ill = True
    assert bus.receive(bus.now_ns()) is not None
    assert len(link.opened) == 2
    assert len(told) == 2


def test_a_full_send_queue_is_no_reason_to_leave(link, told, bus):
    link.opened[0].full = True
    with pytest.raises(BusError):
        bus.send(FRAME)
    assert not link.opened[0].closed
    assert told == []


def test_closed_while_gone_it_is_closed(link, bus):
    link.up = False
    assert bus.receive(bus.now_ns()) is None
    bus.close()
    bus.close()
    assert all(each.closed for each in link.opened)
