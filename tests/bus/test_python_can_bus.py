"""A python-can interface behind our protocol: times, flaws, and links that go down."""

from __future__ import annotations

import errno
import time
from collections import deque

import can
import pytest

from torquerig.driver.bus.clock import RealClock
from torquerig.driver.bus.python_can import PythonCanBus
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Frame

SECOND_NS = 10**9


class ScriptedBus(can.BusABC):
    """Gives back what it is told to, raises what it is told to, and remembers what it was asked."""

    channel_info = "scripted"

    def __init__(self, *script: can.Message | Exception | None) -> None:
        self.script = deque(script)
        self.timeouts: list[float | None] = []
        super().__init__("scripted")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002 - python-can's
        raise self.script.popleft()

    def recv(self, timeout: float | None = None) -> can.Message | None:
        self.timeouts.append(timeout)
        step = self.script.popleft() if self.script else None
        if isinstance(step, Exception):
            raise step
        return step


def bus_with(*script: can.Message | Exception | None, spin_ns: int = 0) -> PythonCanBus:
    return PythonCanBus(ScriptedBus(*script), RealClock(0), spin_ns=spin_ns)


def message(timestamp: float) -> can.Message:
    return can.Message(arbitration_id=0x181, data=b"\x01", is_extended_id=False, timestamp=timestamp)


def test_an_epoch_timestamp_becomes_the_clocks_time():
    bus = bus_with(message(time.time()))
    time.sleep(0.02)
    arrival = bus.receive(0)
    assert bus.now_ns() - arrival.at_ns >= 19_000_000  # the stamp is a double of the epoch, and NTP may slew it
    bus.close()


@pytest.mark.parametrize("timestamp", [0.0, 12.5, -3.0, 4e9], ids=["none", "device's own", "negative", "year 2096"])
def test_a_timestamp_that_is_no_recent_epoch_time_counts_as_now(timestamp):
    bus = bus_with(message(timestamp))
    before_ns = bus.now_ns()
    assert before_ns <= bus.receive(0).at_ns <= bus.now_ns()
    bus.close()


def test_arrival_times_do_not_run_backwards_when_the_epoch_does():
    now = time.time()
    bus = bus_with(message(now), message(now - 30))
    first, second = bus.receive(0), bus.receive(0)
    assert second.at_ns >= first.at_ns
    bus.close()


def test_error_fd_and_malformed_frames_are_counted_and_not_handed_on():
    bus = bus_with(
        can.Message(is_error_frame=True),
        can.Message(is_fd=True, data=bytes(12)),
        can.Message(arbitration_id=0x801, is_extended_id=False),
        can.Message(arbitration_id=0x1, dlc=9),
        can.Message(is_error_frame=True),
        message(0.0),
    )
    assert bus.receive(0).frame == Frame(0x181, b"\x01")
    assert bus.ignored == bus.counts == {"error": 2, "fd": 1, "malformed": 2}
    bus.close()


def test_a_recv_that_gives_up_early_is_asked_again_until_the_deadline():
    bus = bus_with(*[None] * 5)
    due_ns = bus.now_ns() + 2_000_000
    assert bus.receive(due_ns) is None
    assert bus.now_ns() >= due_ns
    bus.close()


def test_the_last_stretch_before_a_deadline_is_polled():
    bus = bus_with(spin_ns=SECOND_NS)
    assert bus.receive(bus.now_ns() + 1_000_000) is None
    assert set(bus._bus.timeouts) == {0.0}
    bus.close()


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENETDOWN, "its link is down or gone"),
        (errno.ENXIO, "the interface is gone"),
        (errno.ENODEV, "the interface is gone"),
        (errno.ENOBUFS, "its send queue is full"),
    ],
)
def test_a_link_that_is_down_or_gone_is_one_sentence(number, words):
    bus = bus_with(can.CanOperationError("Failed to transmit", number), OSError(number, "system's words"))
    with pytest.raises(BusError, match=rf"^cannot send on the bus \(scripted\): {words}") as raised:
        bus.send(Frame(0x080))
    assert "\n" not in str(raised.value)
    with pytest.raises(BusError, match=rf"^cannot receive on the bus \(scripted\): {words}"):
        bus.receive(0)
    bus.close()


def test_any_other_failure_keeps_python_cans_words():
    bus = bus_with(can.CanOperationError("Transmit buffer full"))
    with pytest.raises(BusError, match=r"^cannot send on the bus \(scripted\): Transmit buffer full$"):
        bus.send(Frame(0x080))
    bus.close()
