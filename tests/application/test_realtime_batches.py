"""Simulated devices that send all that is ready at once: what goes, what is lost, and who hears it."""

from collections import deque
from dataclasses import dataclass, field

import pytest

from torquerig.device_sim.devices import NEVER_NS, Emission, SimulatedDevices
from torquerig.driver.bus.batches import one_by_one, send_all_of
from torquerig.driver.bus.patient import PatientBus
from torquerig.driver.errors import BusError, LinkLost
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.realtime import RealTimeDevices
from torquerig.rejoining import RejoiningBus

MS = 1_000_000
SYNC = Frame(0x080)
REFUSED = 0x182


@dataclass
class SingleBus:
    """A bus that takes a frame at a time, and one of them never."""

    now: int = 0
    refuses: frozenset[int] = frozenset()
    lost: bool = False
    queue: deque[Arrival] = field(default_factory=deque)
    sent: list[Frame] = field(default_factory=list)

    def now_ns(self) -> int:
        return self.now

    def send(self, frame: Frame) -> None:
        if self.lost:
            raise LinkLost("gone")
        if frame.can_id in self.refuses:
            raise BusError("full")
        self.sent.append(frame)

    def receive(self, until_ns: int) -> Arrival | None:
        arrival = self.queue.popleft() if self.queue else None
        self.now = arrival.at_ns if arrival else max(self.now, until_ns)
        return arrival

    def close(self) -> None:
        self.lost = True


@dataclass
class BatchingBus(SingleBus):
    """One that takes several."""

    batches: list[list[int]] = field(default_factory=list)

    def send_all(self, frames: list[Frame]) -> int:
        taken = one_by_one(self, frames)
        self.batches.append([frame.can_id for frame in frames[:taken]])
        return taken


@dataclass
class Drive:
    """A node that answers a SYNC, and a sibling's frame with one of its own that would win any arbitration."""

    node_id: int
    heard: list[Frame] = field(default_factory=list)
    outbox: list[Emission] = field(default_factory=list)

    def advance(self, to_ns: int) -> None:
        pass

    def next_event_ns(self) -> int:
        return NEVER_NS

    def receive(self, frame: Frame, at_ns: int) -> None:
        self.heard.append(frame)
        if frame == SYNC:
            self.outbox.append(Emission(at_ns + 20_000, self.node_id, Frame(0x180 + self.node_id)))
        elif frame.can_id == 0x181:
            self.outbox.append(Emission(at_ns + 20_000, self.node_id, Frame(0x080 + self.node_id)))

    def take(self) -> list[Emission]:
        said = list(self.outbox)
        self.outbox.clear()
        return said


def after_a_sync(bus: SingleBus, wrapped=lambda bus: bus) -> tuple[RealTimeDevices, list[Drive]]:
    drives = [Drive(3), Drive(1), Drive(2)]
    bus.queue.append(Arrival(1 * MS, SYNC))
    devices = RealTimeDevices(wrapped(bus), SimulatedDevices(drives))
    devices.serve(5 * MS)
    return devices, drives


@pytest.mark.parametrize(
    "wrapped",
    [
        lambda bus: bus,
        lambda bus: RejoiningBus(lambda: bus, print),
        lambda bus: PatientBus(bus, frozenset(), within_ns=MS, patience_ns=MS),
    ],
    ids=["alone", "rejoining", "patient"],
)
def test_all_that_is_ready_goes_out_in_one_batch_by_arbitration_and_answers_after_it(wrapped):
    bus = BatchingBus()
    devices, drives = after_a_sync(bus, wrapped)
    assert bus.batches == [[0x181, 0x182, 0x183], [0x082, 0x083]]
    assert [frame.can_id for frame in drives[1].heard] == [0x080, 0x182, 0x183, 0x082, 0x083]
    assert devices.lost == 0


@pytest.mark.parametrize("kind", [SingleBus, BatchingBus])
def test_a_frame_that_is_not_taken_is_lost_alone_and_no_sibling_hears_it(kind):
    bus = kind(refuses=frozenset({REFUSED}))
    devices, drives = after_a_sync(bus)
    assert [frame.can_id for frame in bus.sent] == [0x181, 0x183, 0x082, 0x083]
    assert REFUSED not in {frame.can_id for drive in drives for frame in drive.heard}
    assert devices.lost == 1


def test_on_a_bus_that_is_gone_all_are_lost():
    bus, told = BatchingBus(lost=True), []
    devices, _ = after_a_sync(bus, lambda bus: RejoiningBus(lambda: bus, told.append))
    assert devices.lost == 3
    assert len(told) >= 1


def test_a_patient_buss_tap_is_told_of_those_that_were_taken():
    log = []
    bus = BatchingBus(refuses=frozenset({REFUSED}))
    after_a_sync(
        bus,
        lambda bus: PatientBus(bus, frozenset(), within_ns=MS, patience_ns=MS, tap=lambda _, frame: log.append(frame)),
    )
    assert log == [SYNC, *bus.sent]


def test_a_bus_without_batches_is_given_frames_one_after_the_other():
    bus = SingleBus(refuses=frozenset({REFUSED}))
    send_all = send_all_of(bus)
    assert send_all([Frame(0x181), Frame(REFUSED), Frame(0x183)]) == 1
    assert bus.sent == [Frame(0x181)]
    with pytest.raises(BusError, match="full"):
        send_all([Frame(REFUSED), Frame(0x183)])
