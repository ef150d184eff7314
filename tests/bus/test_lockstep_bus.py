"""The lockstep bus as the clock: what moves time, what does not, and who may."""

from __future__ import annotations

import threading
from collections import deque
from concurrent.futures import ThreadPoolExecutor

import can
import pytest

from torquerig.driver.bus.lockstep import PATIENCE_NS, LockstepBus
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Arrival, Frame


class ScriptedWire:
    """A wire on which given frames reach the master at given times."""

    def __init__(self, *arrivals: Arrival) -> None:
        self.sent: list[tuple[int, Frame]] = []
        self._arrivals = deque(arrivals)
        self._now_ns = 0

    def now_ns(self) -> int:
        return self._now_ns

    def submit(self, frame: Frame) -> None:
        self.sent.append((self._now_ns, frame))

    def run_until(self, until_ns: int) -> Arrival | None:
        if self._arrivals and self._arrivals[0].at_ns <= until_ns:
            self._now_ns = self._arrivals[0].at_ns
            return self._arrivals.popleft()
        self._now_ns = max(self._now_ns, until_ns)
        return None

    def watch(self, tap) -> None:
        raise AssertionError(f"nobody asked for a tap: {tap}")


@pytest.fixture
def bus():
    odd_ns = 123_456_789_012_345_677  # four years in: no double holds it
    with LockstepBus(ScriptedWire(Arrival(1_000_001, Frame(0x181)), Arrival(odd_ns, Frame(0x182)))) as bus:
        yield bus


def test_times_are_exact_integers_however_large(bus):
    assert bus.receive(2**62).at_ns == 1_000_001
    assert bus.receive(2**62).at_ns == 123_456_789_012_345_677
    assert bus.now_ns() == 123_456_789_012_345_677


def test_a_zero_timeout_moves_no_time(bus):
    assert bus.recv(0) is None
    assert bus.recv(-1.0) is None
    assert bus.now_ns() == 0


def test_a_timeout_moves_time_by_exactly_itself(bus):
    for _ in range(9):
        assert bus.recv(0.0001) is None
    assert bus.now_ns() == 900_000


def test_a_frame_stops_time_at_its_end(bus):
    message = bus.recv(1.0)
    assert message.timestamp == 0.001000001
    assert bus.now_ns() == 1_000_001


def test_sending_moves_no_time(bus):
    bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
    bus.send(Frame(0x201, b"\x01"))
    assert bus._wire.sent == [(0, Frame(0x80)), (0, Frame(0x201, b"\x01"))]
    assert bus.now_ns() == 0


def test_frames_that_come_during_a_wait_keep_their_times(bus):
    bus.wait_until(5_000_000)
    assert bus.now_ns() == 5_000_000
    assert bus.receive(0) == Arrival(1_000_001, Frame(0x181))


def test_receiving_without_a_timeout_when_nothing_can_come_is_an_error_not_an_endless_loop():
    bus = LockstepBus(ScriptedWire())
    with pytest.raises(can.CanOperationError, match=r"no frame came in 60 s of simulated time"):
        bus.recv()
    assert bus.now_ns() == PATIENCE_NS
    bus.close()


def test_receiving_without_a_timeout_waits_for_the_frame(bus):
    assert bus.recv().arbitration_id == 0x181


def test_another_threads_call_is_one_sentence(bus):
    calls = (bus.recv, lambda: bus.send(Frame(0x80)), lambda: bus.receive(0), lambda: bus.wait_until(0))
    with ThreadPoolExecutor(1, thread_name_prefix="intruder") as pool:
        for call in calls:
            with pytest.raises(BusError, match=rf"belongs to thread {threading.current_thread().name}.*intruder_0"):
                pool.submit(call).result()
    assert bus.now_ns() == 0


def test_sending_periodically_is_refused(bus):
    with pytest.raises(can.CanOperationError, match="periodically"):
        bus.send_periodic(can.Message(arbitration_id=0x80), 0.01)


@pytest.mark.parametrize(
    ("message", "flaw"),
    [(can.Message(is_error_frame=True), "error"), (can.Message(is_fd=True, data=bytes(12)), "fd")],
)
def test_what_is_no_classic_frame_is_refused(bus, message, flaw):
    with pytest.raises(ValueError, match=flaw):
        bus.send(message)


def test_its_errors_are_python_cans_and_ours(bus):
    bus.close()
    for kind in (can.CanError, can.CanOperationError, BusError, OSError):
        with pytest.raises(kind, match="closed"):
            bus.recv(0)


def test_a_filter_hides_frames_from_our_side_too(bus):
    bus.set_filters([{"can_id": 0x182, "can_mask": 0x7FF}])
    assert bus.receive(2**62).frame.can_id == 0x182
