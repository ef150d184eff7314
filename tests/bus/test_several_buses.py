"""Several buses as one: who gets what, in which order it comes back, and what drives hear of each other."""

from __future__ import annotations

import time
from collections import deque

import can
import pytest

from torquerig.driver.bus.merged import WaitForAny
from torquerig.driver.bus.several import SeveralBuses
from torquerig.driver.errors import BusError, BusUrlError, LinkLost
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.several_buses import open_real_time

MS = 1_000_000
HOMES = {1: 0, 2: 0, 3: 1}
RIGHT, LEFT = 0, 1
SYNC = Frame(0x080)


class FakeBus:
    """A bus in a test's hands."""

    def __init__(self, clock: list[int], *, echoes: bool = False) -> None:
        self.clock = clock
        self.sent: list[Frame] = []
        self.waiting: deque[Arrival] = deque()
        self.lost = False
        self.closed = False
        self.echoes = echoes

    def now_ns(self) -> int:
        return self.clock[0]

    def wait_until(self, due_ns: int) -> None:
        self.clock[0] = max(self.clock[0], due_ns)

    def send(self, frame: Frame) -> None:
        if self.lost:
            raise LinkLost("the interface is gone")
        self.sent.append(frame)
        if self.echoes:
            self.waiting.append(Arrival(self.clock[0], frame))

    def receive(self, until_ns: int) -> Arrival | None:
        assert until_ns == 0, "one bus must not be waited for alone"
        return self.waiting.popleft() if self.waiting else None

    def close(self) -> None:
        self.closed = True


class Rig:
    def __init__(self, *, echoes: bool = False) -> None:
        self.clock = [MS]
        self.members = [FakeBus(self.clock), FakeBus(self.clock, echoes=echoes)]
        self.bus = SeveralBuses(self.members, HOMES, self.wait)

    def wait(self, until_ns: int) -> None:
        self.clock[0] = max(self.clock[0], until_ns)

    def hear(self, place: int, can_id: int, data: bytes = b"", at_ns: int = 0) -> None:
        self.members[place].waiting.append(Arrival(at_ns or self.clock[0], Frame(can_id, data)))

    def sent(self) -> tuple[list[int], list[int]]:
        right, left = ([frame.can_id for frame in member.sent] for member in self.members)
        return right, left


@pytest.mark.parametrize(
    ("frame", "right", "left"),
    [
        (SYNC, 1, 1),
        (Frame(0x77F, b"\x05"), 1, 1),  # the master's heartbeat
        (Frame(0x000, b"\x01\x00"), 1, 1),  # NMT, to all nodes
        (Frame(0x000, b"\x01\x02"), 1, 0),
        (Frame(0x000, b"\x01\x03"), 0, 1),
        (Frame(0x202, bytes(4)), 1, 0),
        (Frame(0x203, bytes(4)), 0, 1),
        (Frame(0x403, bytes(4)), 0, 1),
        (Frame(0x200, bytes(6)), 1, 1),  # the group RPDO
        (Frame(0x601, bytes(8)), 1, 0),
        (Frame(0x603, bytes(8)), 0, 1),
        (Frame(0x605, bytes(8)), 1, 1),  # a node that nobody knows may be anywhere
        (Frame(0x703, b"\0", remote=True), 0, 1),
        (Frame(0x203, bytes(4), extended=True), 1, 1),
    ],
)
def test_a_frame_goes_to_whom_it_is_for(frame, right, left):
    rig = Rig()
    rig.bus.send(frame)
    assert rig.sent() == ([frame.can_id] * right, [frame.can_id] * left)


def test_frames_that_wait_come_in_the_order_of_time():
    rig = Rig()
    rig.hear(RIGHT, 0x181, at_ns=300)
    rig.hear(RIGHT, 0x182, at_ns=400)
    rig.hear(LEFT, 0x183, at_ns=200)
    rig.hear(LEFT, 0x583, at_ns=350)
    heard = [rig.bus.receive(0) for _ in range(5)]
    assert [arrival and arrival.frame.can_id for arrival in heard] == [0x183, 0x181, 0x583, 0x182, None]


def test_nothing_is_none_once_the_time_has_come():
    rig = Rig()
    assert rig.bus.receive(5 * MS) is None
    assert rig.bus.now_ns() == 5 * MS


@pytest.mark.parametrize(("can_id", "data"), [(0x083, bytes.fromhex("1023010000000000")), (0x703, b"\x05")])
def test_siblings_on_the_other_bus_hear_a_drives_emergency_and_heartbeat(can_id, data):
    rig = Rig()
    rig.hear(LEFT, can_id, data)
    assert rig.bus.receive(0).frame == Frame(can_id, data)
    assert rig.members[RIGHT].sent == [Frame(can_id, data)]
    assert rig.members[LEFT].sent == []
    assert rig.bus.counts["passed_on"] == 1


@pytest.mark.parametrize("can_id", [0x183, 0x283, 0x583])
def test_nothing_else_is_passed_on(can_id):
    rig = Rig()
    rig.hear(LEFT, can_id, bytes(8))
    assert rig.bus.receive(0) is not None
    assert rig.sent() == ([], [])


@pytest.mark.parametrize("can_id", [0x083, 0x183, 0x583, 0x703])
def test_a_drives_frame_on_a_bus_that_is_not_its_own_is_counted_and_handed_to_nobody(can_id):
    rig = Rig()
    rig.hear(RIGHT, can_id, bytes(8))
    assert rig.bus.receive(0) is None
    assert rig.sent() == ([], [])
    assert rig.bus.counts["misplaced"] == 1


def test_a_second_master_is_heard_from_every_bus():
    rig = Rig()
    for place in (RIGHT, LEFT):
        rig.hear(place, 0x203, bytes(4))
        assert rig.bus.receive(0).frame.can_id == 0x203


def test_frames_of_no_use_without_end_do_not_keep_receive_from_returning():
    rig = Rig()
    rig.wait(2 * MS)
    for _ in range(1000):
        rig.hear(RIGHT, 0x183, bytes(8))
    assert rig.bus.receive(MS) is None
    assert len(rig.members[RIGHT].waiting) == 999


def test_own_frames_that_one_bus_gives_back_are_nobodys_and_those_of_others_are_not():
    rig = Rig(echoes=True)
    for _ in range(3):
        rig.bus.send(SYNC)
        assert rig.bus.receive(0) is None
        rig.wait(rig.clock[0] + 20 * MS)
    assert rig.bus.counts["echoed"] == 3
    for place in (RIGHT, LEFT):
        rig.hear(place, 0x080)
        assert rig.bus.receive(0).frame == SYNC


@pytest.mark.parametrize("place", [RIGHT, LEFT])
def test_a_bus_that_is_gone_does_not_keep_the_drives_on_the_other_from_their_frames(place):
    rig = Rig()
    rig.members[place].lost = True
    for frame in (Frame(0x201, bytes(4)), Frame(0x202, bytes(4)), Frame(0x203, bytes(4)), SYNC):
        rig.bus.send(frame)
    assert rig.sent()[1 - place] == ([0x203, 0x080], [0x201, 0x202, 0x080])[place]
    with pytest.raises(LinkLost, match="gone"):
        rig.bus.receive(0)
    assert rig.bus.receive(0) is None  # told once for each time that something was not sent
    rig.bus.send(SYNC)
    with pytest.raises(LinkLost):
        rig.bus.receive(0)


def test_what_is_no_frame_is_the_callers_mistake_at_once(drive_buses):
    with pytest.raises(ValueError, match="classic CAN"):
        drive_buses.send(Frame(0x800))


def test_closing_closes_all():
    rig = Rig()
    rig.bus.close()
    assert [member.closed for member in rig.members] == [True, True]


@pytest.mark.parametrize("homes", [{1: 2}, {1: -1}, {0: 0}, {128: 0}])
def test_a_home_that_is_none_is_refused(homes):
    with pytest.raises(ValueError, match="node"):
        SeveralBuses([FakeBus([0]), FakeBus([0])], homes, lambda _until: None)


@pytest.fixture
def drive_buses(tmp_path):
    urls = [f"unix:{tmp_path}/a", f"unix:{tmp_path}/b"]
    bus = open_real_time(urls, HOMES, 1_000_000, lambda _place: None, spin_ns=0)
    yield bus
    bus.close()


def test_two_unix_buses_are_waited_for_together(tmp_path, drive_buses):
    with (
        can.Bus(interface="unix", channel=f"{tmp_path}/a") as right,
        can.Bus(interface="unix", channel=f"{tmp_path}/b") as left,
    ):
        drive_buses.send(SYNC)
        assert [each.recv(10.0).arbitration_id for each in (right, left)] == [0x080, 0x080]
        for member, node_id in ((left, 3), (right, 1), (left, 3)):
            member.send(can.Message(arbitration_id=0x180 + node_id, data=bytes(8), is_extended_id=False))
            arrival = drive_buses.receive(time.monotonic_ns() + 10 * 10**9)
            assert arrival.frame == Frame(0x180 + node_id, bytes(8))
    assert drive_buses.counts["bus 2: missed"] == 0


def test_waiting_ends_in_time_when_nothing_comes(drive_buses):
    until_ns = time.monotonic_ns() + 2 * MS
    assert drive_buses.receive(until_ns) is None
    assert time.monotonic_ns() >= until_ns


def test_a_bus_that_is_gone_for_now_is_looked_at_again_soon():
    class Gone:
        def fileno(self) -> int:
            return -1

    begin_ns = time.monotonic_ns()
    WaitForAny([Gone()], time.monotonic_ns, spin_ns=0)(begin_ns + 3600 * 10**9)
    assert time.monotonic_ns() < begin_ns + 1800 * 10**9


def test_an_interface_that_cannot_be_waited_for_with_others_is_refused(tmp_path):
    urls = [f"unix:{tmp_path}/a", "virtual:b"]
    with pytest.raises(BusUrlError, match="'virtual:b' cannot be one of several buses"):
        open_real_time(urls, HOMES, 1_000_000, lambda _place: None, spin_ns=0)
    assert issubclass(LinkLost, BusError)
