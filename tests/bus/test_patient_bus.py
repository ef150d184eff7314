"""Time that stands still where one side of a simulated rig waits for the other, judged on a scripted bus."""

from __future__ import annotations

from collections import deque

import pytest

from torquerig.driver.bus.patient import STALL_NS, PatientBus
from torquerig.driver.wire.frame import Arrival, Frame

MS = 1_000_000
SYNC = Frame(0x080)
ANSWERS = (Frame(0x181), Frame(0x182))
OTHER = Frame(0x701)
WITHIN_NS = 1 * MS
PATIENCE_NS = 500 * MS


class ScriptedBus:
    """A bus on which frames arrive at set times; a stall is a `pass_by` between two calls."""

    def __init__(self) -> None:
        self.at_ns = 0
        self.coming: deque[Arrival] = deque()
        self.sent: list[Frame] = []
        self.oversleeps_ns = 0

    def now_ns(self) -> int:
        return self.at_ns

    def pass_by(self, duration_ns: int) -> None:
        self.at_ns += duration_ns

    def wait_until(self, due_ns: int) -> None:
        self.at_ns = max(self.at_ns, due_ns + self.oversleeps_ns)

    def send(self, frame: Frame) -> None:
        self.sent.append(frame)

    def receive(self, until_ns: int) -> Arrival | None:
        if self.coming and self.coming[0].at_ns <= max(until_ns, self.at_ns):
            arrival = self.coming.popleft()
            self.at_ns = max(self.at_ns, arrival.at_ns + self.oversleeps_ns)
            return arrival
        self.at_ns = max(self.at_ns, until_ns + self.oversleeps_ns)
        return None

    def close(self) -> None:
        self.sent.clear()


@pytest.fixture
def inner() -> ScriptedBus:
    return ScriptedBus()


@pytest.fixture
def controller(inner) -> PatientBus:
    awaited = frozenset(answer.can_id for answer in ANSWERS)
    return PatientBus(inner, awaited, within_ns=WITHIN_NS, patience_ns=PATIENCE_NS)


@pytest.fixture
def simulator(inner) -> PatientBus:
    return PatientBus(inner, frozenset({SYNC.can_id}), within_ns=4 * MS, patience_ns=PATIENCE_NS)


def arrive(inner: ScriptedBus, *at: tuple[int, Frame]) -> None:
    inner.coming.extend(Arrival(at_ns, frame) for at_ns, frame in at)


def test_time_is_the_bus_s_own_while_all_is_punctual(inner, controller):
    controller.send(SYNC)
    arrive(inner, (300_000, ANSWERS[0]), (400_000, ANSWERS[1]))
    assert [controller.receive(2 * MS), controller.receive(2 * MS)] == [
        Arrival(300_000, ANSWERS[0]),
        Arrival(400_000, ANSWERS[1]),
    ]
    assert controller.receive(4 * MS) is None
    assert (controller.now_ns(), controller.stood_still_ns) == (4 * MS, 0)


def test_time_stands_still_until_the_last_answer_to_a_sync(inner, controller):
    controller.send(SYNC)
    arrive(inner, (300_000, ANSWERS[0]), (200 * MS, ANSWERS[1]))
    controller.receive(2 * MS)
    late = controller.receive(2 * MS)
    assert late == Arrival(WITHIN_NS, ANSWERS[1])
    assert controller.now_ns() == WITHIN_NS
    assert controller.stood_still_ns == 199 * MS
    assert controller.receive(4 * MS) is None
    assert (controller.now_ns(), inner.at_ns) == (4 * MS, 203 * MS)


def test_other_frames_come_through_while_time_stands_still(inner, controller):
    controller.send(SYNC)
    arrive(inner, (100 * MS, OTHER), (150 * MS, ANSWERS[0]), (200 * MS, ANSWERS[1]))
    stamps = [arrival.at_ns for _ in range(3) if (arrival := controller.receive(2 * MS))]
    assert stamps == [WITHIN_NS] * 3


def test_patience_ends_and_is_not_tried_again_until_all_have_answered(inner, controller):
    controller.send(SYNC)
    assert controller.receive(4 * MS) is None
    assert (controller.now_ns(), controller.stood_still_ns) == (4 * MS, PATIENCE_NS - WITHIN_NS)
    controller.send(SYNC)
    arrive(inner, (inner.at_ns + MS // 2, ANSWERS[0]))
    assert controller.receive(8 * MS) is not None
    assert controller.receive(8 * MS) is None
    assert (controller.now_ns(), controller.stood_still_ns) == (8 * MS, PATIENCE_NS - WITHIN_NS)
    controller.send(SYNC)
    arrive(inner, *((inner.at_ns, answer) for answer in ANSWERS))
    assert all(controller.receive(12 * MS) for _ in ANSWERS)
    controller.send(SYNC)
    arrive(inner, *((inner.at_ns + 100 * MS, answer) for answer in ANSWERS))
    assert [controller.receive(12 * MS) for _ in ANSWERS] == [Arrival(9 * MS, answer) for answer in ANSWERS]


def test_the_simulator_s_time_stands_still_where_the_next_sync_is_due(inner, simulator):
    arrive(inner, (10 * MS, SYNC), (100 * MS, SYNC), (104 * MS, SYNC))
    stamps = [arrival.at_ns for _ in range(3) if (arrival := simulator.receive(1000 * MS))]
    assert stamps == [10 * MS, 14 * MS, 18 * MS]
    assert simulator.stood_still_ns == 86 * MS


def test_a_wait_that_ends_before_a_sync_is_due_ends_in_time(inner, simulator):
    arrive(inner, (10 * MS, SYNC))
    simulator.receive(1000 * MS)
    assert simulator.receive(12 * MS) is None
    assert (inner.at_ns, simulator.stood_still_ns) == (12 * MS, 0)


def test_a_stall_of_one_s_own_takes_no_time(inner, controller):
    before = controller.now_ns()
    inner.pass_by(300 * MS)
    assert controller.now_ns() == before + STALL_NS


@pytest.mark.parametrize("wait", [lambda bus: bus.wait_until(5 * MS), lambda bus: bus.receive(5 * MS)])
def test_oversleeping_takes_no_time(inner, controller, wait):
    inner.oversleeps_ns = 300 * MS
    wait(controller)
    assert controller.now_ns() == 5 * MS + STALL_NS


def test_frames_that_waited_through_a_stall_keep_their_order_and_lie_in_the_past(inner, controller):
    controller.send(SYNC)
    inner.pass_by(300 * MS)
    arrive(inner, (299 * MS, ANSWERS[0]), (300 * MS, ANSWERS[1]))
    stamps = [arrival.at_ns for _ in ANSWERS if (arrival := controller.receive(2 * MS))]
    assert 0 <= stamps[0] <= stamps[1] <= controller.now_ns() <= 2 * MS


def test_sending_and_closing_are_the_bus_s(inner, controller):
    controller.send(OTHER)
    assert inner.sent == [OTHER]
    controller.close()
    assert inner.sent == []
