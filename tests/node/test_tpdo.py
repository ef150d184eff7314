"""When TPDOs are sent: every transmission type, inhibit time, event timer, remote frames (CiA 301, 7.5.2.37)."""

from __future__ import annotations

import pytest

MS = 1_000_000
STATUS = 0x6041


@pytest.fixture
def tpdo3(bench, write):
    """Node operational; TPDO3 carries the statusword; the type is the test's."""

    def configure(transmission_type: int, *, inhibit: str = "00 00", event: str = "00 00", cob: str = "81 03 00 00"):
        write("1017", "00 00")
        write("1800:01", "81 01 00 80")
        write("1801:01", "81 02 00 80")
        write("1A02:01", "10 00 41 60")
        write("1A02:00", "01")
        write("1802:02", f"{transmission_type:02X}")
        write("1802:03", inhibit)
        write("1802:05", event)
        write("1802:01", cob)
        return bench

    return configure


def sync(bench, at_ns: int) -> list[str]:
    bench.now_ns = at_ns
    return bench.say("080#")


def test_type_n_is_sent_after_every_nth_sync(tpdo3):
    bench = tpdo3(3)
    bench.say("000#01 01")
    assert [sync(bench, k * MS) for k in range(6)] == [[], [], ["381#00 00"], [], [], ["381#00 00"]]


def test_the_count_of_syncs_starts_anew_when_operational_is_entered(tpdo3):
    bench = tpdo3(2)
    bench.say("000#01 01")
    assert sync(bench, 0) == []
    bench.say("000#80 01")
    bench.say("000#01 01")
    assert sync(bench, 1) == []
    assert sync(bench, 2) == ["381#00 00"]


def test_type_0_is_sent_after_a_sync_if_something_has_changed(tpdo3):
    bench = tpdo3(0)
    bench.say("000#01 01")
    assert sync(bench, 0) == ["381#00 00"]
    assert sync(bench, 1) == []
    bench.node.store.set(0x1234, STATUS)
    assert bench.wait(2) == []
    assert sync(bench, 3) == ["381#34 12"]
    assert sync(bench, 4) == []


@pytest.mark.parametrize("kind", [254, 255])
def test_types_254_and_255_are_sent_once_on_start_and_then_on_change(tpdo3, kind):
    bench = tpdo3(kind)
    assert bench.say("000#01 01") == ["381#00 00"]
    assert bench.say("201#06 00 00 00") == []
    bench.node.store.set(0x1234, STATUS)
    assert bench.say("201#06 00 00 00") == ["381#34 12"]
    assert sync(bench, 1) == []


def test_the_inhibit_time_holds_an_event_back_and_the_latest_value_follows(tpdo3):
    bench = tpdo3(255, inhibit="64 00")  # 10 ms
    bench.say("000#01 01")
    bench.now_ns = 2 * MS
    bench.node.store.set(1, STATUS)
    assert bench.say("201#06 00 00 00") == []
    bench.node.store.set(2, STATUS)
    assert bench.say("201#06 00 00 00") == []
    assert bench.wait(100 * MS) == [(10 * MS, "381#02 00")]


def test_the_event_timer_sends_when_nothing_happens_for_its_time(tpdo3):
    bench = tpdo3(255, event="0A 00")
    bench.say("000#01 01")
    bench.now_ns = 4 * MS
    bench.node.store.set(1, STATUS)
    assert bench.say("201#06 00 00 00") == ["381#01 00"]
    assert bench.wait(25 * MS) == [(14 * MS, "381#01 00"), (24 * MS, "381#01 00")]
    bench.say("000#80 01")
    assert bench.wait(100 * MS) == []


def test_type_252_is_sampled_by_sync_and_sent_on_request(tpdo3):
    bench = tpdo3(252)
    bench.say("000#01 01")
    bench.node.store.set(1, STATUS)
    assert sync(bench, 1) == []
    bench.node.store.set(2, STATUS)
    assert bench.say("381#R2") == ["381#01 00"]
    assert sync(bench, 2) == []
    assert bench.say("381#R2") == ["381#02 00"]


def test_type_253_is_sampled_and_sent_on_request(tpdo3):
    bench = tpdo3(253)
    assert bench.say("000#01 01") == []
    bench.node.store.set(7, STATUS)
    assert sync(bench, 1) == []
    assert bench.say("381#R2") == ["381#07 00"]


def test_remote_frames_are_answered_in_operational_only_and_not_if_bit_30_forbids_them(tpdo3, write):
    bench = tpdo3(253)
    assert bench.say("381#R2") == []
    write("1802:01", "81 03 00 80")
    write("1802:01", "81 03 00 40")
    bench.say("000#01 01")
    assert bench.say("381#R2") == []


@pytest.mark.parametrize("kind", range(241, 252))
def test_reserved_types_are_refused(write, kind):
    write("1802:02", f"{kind:02X}", abort="30 00 09 06")
    write("1402:02", f"{kind:02X}", abort="30 00 09 06")


def test_the_inhibit_time_cannot_change_while_the_pdo_exists(write):
    write("1800:03", "64 00", abort="30 00 09 06")
    write("1800:03", "00 00")


def test_a_tpdo_that_is_made_valid_in_operational_is_sent_from_then_on(tpdo3, write):
    bench = tpdo3(1, cob="81 03 00 80")
    bench.say("000#01 01")
    assert sync(bench, 1) == []
    write("1802:01", "81 03 00 00")
    assert sync(bench, 2) == ["381#00 00"]


def test_synchronous_tpdos_that_cannot_make_the_window_are_dropped(slow_bench):
    """1007 = 10 us, and a sample is ready after 20 us (CiA 301, 7.5.2.7)."""
    slow_bench.say("601#23 07 10 00 0A 00 00 00")
    slow_bench.say("000#01 01")
    assert slow_bench.say("080#") == []
    slow_bench.say("601#23 07 10 00 14 00 00 00")
    assert slow_bench.say("080#") == ["181#00 00 00 00 00 00 00 00"]
