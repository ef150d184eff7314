"""Conversations with several SDO servers at once, and what happens when an answer does not come."""

from __future__ import annotations

import numpy as np
import pytest

from torquerig.driver.errors import NoAnswer
from torquerig.driver.master.pump import Pump
from torquerig.driver.master.sdo_jobs import Download, Patience, Pause, SdoService, Upload
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sdo import AbortCode, SdoAbort

MS = 1_000_000
ABORT_TIMEOUT = bytes.fromhex("80 00 10 00 00 00 04 05")  # 0504 0000: SDO protocol timed out
ASK_1000 = bytes.fromhex("40 00 10 00 00 00 00 00")


def read(index: int, subindex: int = 0):
    return (yield Upload(index, subindex))


@pytest.fixture
def service(rig):
    return SdoService(Pump(rig.bus))


def test_jobs_of_several_drives_run_at_once(rig, service):
    start = rig.bus.now_ns()
    answers = service.run({node_id: read(0x1000) for node_id in (1, 2, 3)})
    assert answers == dict.fromkeys((1, 2, 3), (0x00020192).to_bytes(4, "little"))
    assert rig.bus.now_ns() - start < 2 * 150_000


def test_a_job_is_a_sequence(rig, service):
    def job():
        yield Download(0x6072, 0, (500).to_bytes(2, "little"))
        before = rig.bus.now_ns()
        yield Pause(7 * MS)
        assert rig.bus.now_ns() - before == 7 * MS
        name = yield Upload(0x1008)
        return name, (yield Upload(0x6072))

    assert service.run({2: job()})[2] == (b"torquerig simulated torque drive", b"\xf4\x01")


def test_the_spacing_between_transfers_leaves_the_bus_to_others(rig, service):
    def job():
        for _ in range(3):
            yield Upload(0x1000)

    service.run({1: job()}, Patience(spacing_ns=2 * MS))
    asked = [at for at, frame in rig.bus.log if frame.data == ASK_1000]
    assert asked[2] - asked[1] == asked[1] - asked[0] == 2 * MS


def test_the_spacing_holds_between_transfers_of_all_drives(rig, service):
    def job():
        for _ in range(2):
            yield Upload(0x1000)

    service.run({1: job(), 2: job(), 3: job()}, Patience(spacing_ns=2 * MS))
    asked = [(at, frame.can_id) for at, frame in rig.bus.log if frame.data == ASK_1000]
    assert np.diff([at for at, _ in asked]).tolist() == [2 * MS] * 5
    assert [can_id for _, can_id in asked] == [0x601, 0x602, 0x603] * 2


def test_an_abort_is_thrown_into_the_job_which_may_go_on(service):
    def job():
        try:
            yield Upload(0x5FFF)
        except SdoAbort as abort:
            return abort.code, (yield Upload(0x1001))
        return None

    assert service.run({1: job()})[1] == (AbortCode.NO_OBJECT, b"\x00")


def test_an_abort_that_the_job_does_not_take_ends_it(service):
    with pytest.raises(SdoAbort, match="object does not exist"):
        service.run({1: read(0x5FFF), 2: read(0x1000)})


def test_a_lost_answer_ends_the_transfer_by_an_abort_and_begins_it_again(rig, service):
    rig.drives[1].mute = {"sdo"}
    start = rig.bus.now_ns()

    def wake(frame: Frame) -> None:
        if frame.data == ABORT_TIMEOUT:
            rig.drives[1].mute = set()

    rig.bus.on_send = wake
    assert service.run({1: read(0x1000)})[1] == (0x00020192).to_bytes(4, "little")
    assert rig.bus.sent_to(0x601) == [ASK_1000, ABORT_TIMEOUT, ASK_1000]
    assert 300 * MS < rig.bus.now_ns() - start < 301 * MS


def test_a_segment_is_never_repeated(rig, service):
    """A lost segment may have been taken: the toggle bit of a repetition would be wrong."""
    losses = iter([True])
    plain = rig.drives[1].hear

    def lose_one(frame: Frame) -> list[Frame]:
        answers = plain(frame)
        if frame.can_id == 0x601 and frame.data[0] == 0x70 and next(losses, False):
            return []
        return answers

    rig.drives[1].hear = lose_one
    assert service.run({1: read(0x1008)})[1] == b"torquerig simulated torque drive"
    specifiers = [data[0] for data in rig.bus.sent_to(0x601)]
    assert specifiers[:5] == [0x40, 0x60, 0x70, 0x80, 0x40]


def test_all_silent_drives_are_named_together(rig, service):
    for node_id in (1, 3):
        rig.drives[node_id].mute = {"sdo"}
    start = rig.bus.now_ns()
    with pytest.raises(NoAnswer, match=r"^no answer from drives 1 and 3 within 0.2 s$"):
        service.run({node_id: read(0x1000) for node_id in (1, 2, 3)}, Patience(100 * MS, attempts=2))
    assert rig.bus.now_ns() - start == 200 * MS


def test_answers_that_nobody_asked_for_are_counted(rig, service):
    service.channel(1)
    rig.bus.inject(rig.bus.now_ns() + MS, Frame(0x581, bytes(8)))
    service.run({2: read(0x1000)})
    pump = service._pump
    pump.serve(rig.bus.now_ns() + 2 * MS)
    assert pump.counts.unknown == 1


def test_a_late_answer_to_an_earlier_question_is_not_taken_for_the_next(rig, service):
    rig.drives[1].mute = {"sdo"}
    with pytest.raises(NoAnswer):
        service.run({1: read(0x6075)}, Patience(10 * MS, attempts=1))
    rig.drives[1].mute = set()
    rig.bus.inject(rig.bus.now_ns() + 10_000, Frame(0x581, bytes.fromhex("43 75 60 00 01 02 03 04")))
    assert service.run({1: read(0x1000)})[1] == (0x00020192).to_bytes(4, "little")


def test_a_new_job_takes_the_channel_of_one_that_was_left_behind(rig, service):
    channel = service.channel(1)
    channel.start(read(0x1008))
    assert not channel.done
    assert service.run({1: read(0x1001)})[1] == b"\x00"
    assert bytes.fromhex("80 08 10 00 00 00 04 05") in rig.bus.sent_to(0x601)


def test_a_channel_that_is_closed_hears_nothing_more(rig):
    pump = Pump(rig.bus)
    channel = SdoService(pump).channel(1)
    channel.start(read(0x1000))
    channel.close()
    pump.serve(rig.bus.now_ns() + MS)
    assert pump.counts.unknown == 1
    assert channel.done


def test_a_transfer_can_go_on_beside_the_loop(rig):
    with rig.group() as group:
        group.enable()
        service = group._session.service
        channel = service.channel(2)
        channel.start(read(0x1008))
        due = group.now_ns() + 4 * MS
        for _ in range(10):
            assert group.sample(due).complete
            due += 4 * MS
        assert channel.outcome() == b"torquerig simulated torque drive"
