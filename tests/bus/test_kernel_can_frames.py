"""Frames in batches through the kernel CAN's code: their bytes, order and times, what is counted, and what waits."""

from __future__ import annotations

import errno
import select
import signal
import socket
import struct
import threading
import time

import can
import pytest
from cyclic_bench import EMERGENCY, LONG_AGO, PATIENCE_NS, two_axes

from torquerig.benchmarks.wire_pair import PairedCanBus, PairedKernelCanBus
from torquerig.driver.bus import kernel_can_frames, url
from torquerig.driver.bus.batches import BatchBus
from torquerig.driver.bus.clock import RealClock
from torquerig.driver.bus.cyclic import OTHER
from torquerig.driver.bus.url import open_bus
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Frame

CAN_FRAME = struct.Struct("=IB3x8s")  # linux/can.h
GOLDEN = {
    "810000000200000001020000000000 00": Frame(0x81, b"\x01\x02"),
    "ff070000080000000001020304050607": Frame(0x7FF, bytes(range(8))),
    "efcdab9a0100000078000000000000 00": Frame(0x1AABCDEF, b"x", extended=True),
    "01070040050000000000000000000000": Frame(0x701, bytes(5), remote=True),
}


class Pair:
    """The bus on one of a pair of sockets, and the other one."""

    def __init__(self, tap=None) -> None:
        ours, self.theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.theirs.settimeout(20.0)
        self.bus = PairedKernelCanBus(PairedCanBus(ours), RealClock(0), tap)

    def say(self, *frames: Frame) -> None:
        for frame in frames:
            self.theirs.send(CAN_FRAME.pack(frame.can_id, len(frame.data), frame.data))

    def close(self) -> None:
        self.bus.close()
        self.theirs.close()


@pytest.fixture
def log():
    return []


@pytest.fixture
def pair(log):
    pair = Pair(lambda at_ns, frame: log.append((at_ns, frame)))
    yield pair
    pair.close()


def numbered(number: int) -> Frame:
    return Frame(0x181, number.to_bytes(4, "little"))


def take(bus, count: int) -> list:
    arrivals = [bus.receive(time.monotonic_ns() + PATIENCE_NS) for _ in range(count)]
    assert None not in arrivals
    return arrivals


def frames(bus, count: int) -> list[Frame]:
    return [arrival.frame for arrival in take(bus, count)]


class TestBytes:
    @pytest.mark.parametrize(("wire", "frame"), GOLDEN.items())
    def test_frames_are_those_of_linux_both_ways(self, pair, wire, frame):
        pair.bus.send(frame)
        assert pair.theirs.recv(100) == bytes.fromhex(wire)
        pair.theirs.send(bytes.fromhex(wire))
        assert frames(pair.bus, 1) == [frame]

    def test_no_data_of_a_frame_before_goes_with_a_shorter_one(self, pair):
        pair.bus.send_all([Frame(0x181, b"\xff" * 8)])
        pair.bus.send_all([Frame(0x181, b"\x01")])
        pair.theirs.recv(100)
        assert pair.theirs.recv(100)[8:] == b"\x01".ljust(8, b"\0")


class TestBatches:
    def test_several_go_out_in_order(self, pair):
        said = [numbered(k) for k in range(5)]
        assert isinstance(pair.bus, BatchBus)
        assert pair.bus.send_all(said) == len(said)
        got = [CAN_FRAME.unpack(pair.theirs.recv(16)) for _ in said]
        assert [Frame(can_id, data[:length]) for can_id, length, data in got] == said

    def test_none_are_none(self, pair):
        assert pair.bus.send_all([]) == 0

    def test_more_than_one_call_takes_go_out_whole(self, pair, monkeypatch):
        monkeypatch.setattr(kernel_can_frames, "MOST_SENT", 2)
        assert pair.bus.send_all([numbered(k) for k in range(5)]) == 5
        assert [pair.theirs.recv(16)[8] for _ in range(5)] == list(range(5))

    def test_one_that_is_no_can_frame_is_refused_like_a_single_one(self, pair):
        with pytest.raises(ValueError, match="classic CAN"):
            pair.bus.send_all([Frame(0x181), Frame(0x800)])

    def test_where_there_is_no_room_for_all_the_others_wait_for_it(self, pair):
        said = [numbered(k) for k in range(40)]  # more than a queue of datagrams holds
        heard = []
        reader = threading.Thread(target=lambda: heard.extend(pair.theirs.recv(16)[8] for _ in said))
        reader.start()
        assert pair.bus.send_all(said) == len(said)
        reader.join()
        assert heard == list(range(40))

    def test_all_that_waits_comes_in_order_with_the_kernels_times(self, pair, log):
        before_ns = time.monotonic_ns()
        pair.say(*[numbered(k) for k in range(5)])
        after_ns = time.monotonic_ns()
        arrivals = take(pair.bus, 5)
        assert [arrival.frame for arrival in arrivals] == [numbered(k) for k in range(5)]
        times = [arrival.at_ns for arrival in arrivals]
        assert times == sorted(times)
        assert before_ns - 1_000_000 <= times[0] <= times[-1] <= after_ns + 1_000_000  # NTP may slew the epoch
        assert log == [(arrival.at_ns, arrival.frame) for arrival in arrivals]

    def test_the_tap_is_told_what_was_sent(self, pair, log):
        pair.bus.send_all([numbered(0), numbered(1)])
        assert [frame for _, frame in log] == [numbered(0), numbered(1)]


class TestWhatIsCounted:
    def test_error_frames_and_what_is_no_frame(self, pair):
        pair.theirs.send(CAN_FRAME.pack(0x2000_0004, 8, bytes(8)))
        pair.theirs.send(CAN_FRAME.pack(0x181, 9, bytes(8)))
        pair.theirs.send(b"short")
        pair.say(numbered(1))
        assert frames(pair.bus, 1) == [numbered(1)]
        assert pair.bus.ignored == pair.bus.counts == {"error": 1, "malformed": 2}

    def test_what_is_counted_does_not_end_a_wait(self, pair):
        pair.theirs.send(b"short")
        due_ns = time.monotonic_ns() + 20_000_000
        assert pair.bus.receive(due_ns) is None
        assert time.monotonic_ns() >= due_ns

    @pytest.mark.vcan
    def test_frames_that_found_no_room_are_missed(self):
        log = []
        bus = open_bus("socketcan:vcan0", bitrate=1_000_000, tap=lambda *each: log.append(each), spin_ns=0)
        with can.Bus(interface="socketcan", channel="vcan0") as other:
            bus._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
            message = can.Message(arbitration_id=0x181, is_extended_id=False)
            for _ in range(100):
                other.send(message)
            kept = 0
            while bus.receive(LONG_AGO) is not None:
                kept += 1
            other.send(message)  # says how many were lost before it
            take(bus, 1)
        assert bus.counts == {"missed": 100 - kept}
        assert 0 < kept < 100
        assert len(log) == kept + 1
        bus.close()


class TestWaiting:
    def test_a_deadline_in_the_past_brings_what_waits_and_never_waits(self, pair):
        assert pair.bus.receive(LONG_AGO) is None
        pair.say(numbered(0))
        assert pair.bus.receive(LONG_AGO).frame == numbered(0)

    @pytest.mark.parametrize("spin_ns", [0, 10**9], ids=["asleep", "spinning"])
    def test_a_deadline_passes_before_nothing_is_returned(self, spin_ns):
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        frames_of_it = kernel_can_frames.KernelCanFrames(ours, now_ns=0, spin_ns=spin_ns)
        due_ns = time.monotonic_ns() + 5_000_000
        assert frames_of_it.take(due_ns) == 0
        assert time.monotonic_ns() >= due_ns
        ours.close()
        theirs.close()

    def test_who_waits_by_the_descriptor_finds_it_readable_as_long_as_frames_wait(self, pair):
        descriptor = pair.bus.fileno()
        pair.say(*[numbered(k) for k in range(5)])
        for _ in range(5):
            assert select.select([descriptor], [], [], 20.0)[0]
            take(pair.bus, 1)
        assert not select.select([descriptor], [], [], 0)[0]

    def test_a_signal_does_not_end_a_wait_for_frames_and_is_no_error(self, pair):
        seen = []
        before = signal.signal(signal.SIGALRM, lambda *_: seen.append(True))
        signal.setitimer(signal.ITIMER_REAL, 0.02)
        due_ns = time.monotonic_ns() + 100_000_000
        assert pair.bus.receive(due_ns) is None
        signal.signal(signal.SIGALRM, before)
        assert time.monotonic_ns() >= due_ns
        assert seen

    @pytest.mark.parametrize("set_ns", [-3600 * 10**9, 3600 * 10**9], ids=["forward", "back"])
    def test_that_the_epoch_was_set_is_noticed_by_the_next_frame(self, pair, set_ns):
        pair.say(numbered(0))
        first = take(pair.bus, 1)[0]
        pair.bus._frames._wire["offset_ns"] += set_ns  # what it would be had nobody set the epoch's clock
        pair.say(numbered(1))
        second = take(pair.bus, 1)[0]
        assert first.at_ns <= second.at_ns <= time.monotonic_ns() + 1_000_000


class TestAPortBeside:
    def test_frames_that_were_taken_before_it_are_handed_out_by_it(self, pair):
        pair.say(EMERGENCY, numbered(1), numbered(2))
        assert frames(pair.bus, 1) == [EMERGENCY]
        port = pair.bus.open_cyclic(two_axes())
        assert port.sync(LONG_AGO, True) == port.take(LONG_AGO) == port.command(0, True) == OTHER
        assert [arrival.frame for arrival in port.others()] == [numbered(1), numbered(2)]
        assert port.sync(LONG_AGO, True) == 0

    def test_while_it_is_open_receiving_leaves_the_rest_where_it_sees_it(self, pair):
        port = pair.bus.open_cyclic(two_axes())
        pair.say(EMERGENCY, EMERGENCY)
        assert frames(pair.bus, 1) == [EMERGENCY]
        assert port.sync(LONG_AGO, True) == OTHER

    def test_others_are_handed_out_together_and_process_data_are_left_to_it(self, pair):
        port = pair.bus.open_cyclic(two_axes())
        pair.bus.process_data().send(CAN_FRAME.pack(0x181, 8, bytes(8)))
        pair.say(EMERGENCY, numbered(1))
        assert [arrival.frame for arrival in port.others()] == [EMERGENCY, numbered(1)]
        assert list(port.others()) == []
        assert pair.bus.receive(LONG_AGO).frame == Frame(0x181, bytes(8))

    def test_after_it_frames_come_in_batches_again(self, pair):
        pair.bus.open_cyclic(two_axes())
        pair.bus.close_cyclic()
        pair.say(*[numbered(k) for k in range(5)])
        take(pair.bus, 1)
        assert not select.select([pair.bus._socket], [], [], 0)[0]
        assert frames(pair.bus, 4) == [numbered(k) for k in range(1, 5)]


class TestTheEnd:
    def test_what_was_taken_ends_with_the_bus(self, pair):
        pair.say(numbered(0), numbered(1))
        take(pair.bus, 1)
        pair.bus.close()
        with pytest.raises(BusError, match="closed"):
            pair.bus.receive(LONG_AGO)
        with pytest.raises(BusError, match="closed"):
            pair.bus.send(numbered(0))

    def test_a_socket_that_fails_is_an_error_after_the_frames_that_came_before(self, pair):
        pair.say(numbered(0))
        pair.bus._frames._wire["error"] = errno.ENETDOWN
        with pytest.raises(BusError, match="its link is down"):
            pair.bus.receive(LONG_AGO)
        assert frames(pair.bus, 1) == [numbered(0)]

    def test_what_cannot_be_sent_is_an_error_if_it_is_the_first(self, pair):
        pair.theirs.close()
        with pytest.raises(BusError, match="cannot send"):
            pair.bus.send_all([numbered(0), numbered(1)])


@pytest.mark.vcan
def test_more_frames_than_a_call_takes_all_come_in_order():
    one, two = (open_bus("socketcan:vcan0", bitrate=1_000_000, spin_ns=0) for _ in range(2))
    said = [Frame(0x100 + k, bytes(range(k % 9))) for k in range(3 * kernel_can_frames.MOST_SENT + 1)]
    assert one.send_all(said) == len(said)
    assert frames(two, len(said)) == said
    one.close()
    two.close()


@pytest.mark.vcan
def test_where_compiled_code_cannot_serve_python_can_does(monkeypatch):
    monkeypatch.setattr(url, "SUPPORTED", False)
    one, two = (open_bus("socketcan:vcan0", bitrate=1_000_000, spin_ns=0) for _ in range(2))
    assert not isinstance(one, BatchBus)
    one.send(numbered(1))
    assert frames(two, 1) == [numbered(1)]
    one.close()
    two.close()
