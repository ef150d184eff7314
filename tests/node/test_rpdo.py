"""When received data take effect, wrong lengths, limits, and the deadline of the event timer (CiA 301, 7.2.2)."""

from __future__ import annotations

import pytest

from torquerig.device_sim.canopen.application import CommunicationEvent

MS = 1_000_000
TARGET = 0x2071


def target(bench) -> int:
    return bench.node.store.get(TARGET)


def test_type_255_takes_effect_on_reception(operational):
    operational.say("201#0F 00 64 00")
    assert target(operational) == 100


@pytest.mark.parametrize("kind", ["00", "01", "02", "F0"])
def test_synchronous_types_take_effect_at_the_next_sync_and_the_latest_counts(operational, write, kind):
    write("1400:02", kind)
    operational.say("201#0F 00 64 00")
    operational.say("201#0F 00 65 00")
    assert target(operational) == 0
    operational.say("080#")
    assert target(operational) == 0x65
    operational.node.store.set(7, TARGET)
    operational.say("080#")
    assert target(operational) == 7


def test_what_a_sync_samples_is_older_than_what_it_makes_valid(operational, write):
    """An RPDO of type 1 sent before SYNC k shows first in the TPDO of SYNC k + 1."""
    write("1800:01", "81 01 00 80")
    write("1A00:00", "00")
    write("1A00:01", "10 00 71 20")
    write("1A00:00", "01")
    write("1800:01", "81 01 00 00")
    write("1400:02", "01")
    operational.talk("""
        > 201#0F 00 64 00
        > 080#
        < 181#00 00
        > 080#
        < 181#64 00""")


@pytest.mark.parametrize("kind", ["FC", "FD"])
def test_types_252_and_253_are_for_tpdos_only(write, kind):
    write("1400:02", kind, abort="30 00 09 06")


def test_a_short_rpdo_is_emcy_8210_once_and_is_not_processed(operational):
    assert operational.say("201#0F 00 64") == ["081#10 82 11 00 00 00 00 00"]
    assert operational.say("201#") == []
    assert target(operational) == 0
    assert operational.node.counters()["RPDO too short"] == 2
    assert operational.say("201#0F 00 64 00") == ["081#00 00 00 00 00 00 00 00"]
    assert target(operational) == 100


def test_a_long_rpdo_is_emcy_8220_and_its_mapped_bytes_are_processed(operational):
    assert operational.say("201#0F 00 64 00 FF FF") == ["081#20 82 11 00 00 00 00 00"]
    assert target(operational) == 100
    assert operational.say("201#0F 00") == ["081#00 00 00 00 00 00 00 00", "081#10 82 11 00 00 00 00 00"]


def test_a_value_beyond_its_limits_is_not_taken_and_counted(operational, write):
    """6072 may be 3072 at most; the other object of the PDO is taken."""
    write("1601:01", "10 00 72 60")
    write("1601:02", "10 00 B2 60")
    write("1601:00", "02")
    write("1401:01", "01 03 00 00")
    operational.say("301#01 0C 05 00")
    assert (operational.node.store.get(0x6072), operational.node.store.get(0x60B2)) == (3072, 5)
    operational.say("301#00 01 06 00")
    assert (operational.node.store.get(0x6072), operational.node.store.get(0x60B2)) == (256, 6)
    assert operational.node.counters()["RPDO value refused"] == 1


def test_a_synchronous_rpdo_after_the_window_is_dropped_and_counted(operational, write):
    write("1400:02", "01")
    write("1007", "E8 03 00 00")
    operational.say("080#")
    operational.now_ns = 1 * MS
    operational.say("201#0F 00 64 00")
    operational.now_ns = 1 * MS + 1
    operational.say("201#0F 00 65 00")
    operational.say("080#")
    assert target(operational) == 100
    assert operational.node.counters()["RPDO too late"] == 1


def test_the_deadline_is_the_last_reception_plus_the_event_timer_to_the_nanosecond(operational, write):
    write("1017", "00 00")
    write("1400:05", "0C 00")
    operational.node.pdos.watch(0)
    operational.now_ns = 5 * MS + 7
    operational.say("201#0F 00 64 00")
    operational.wait(17 * MS + 6)
    assert operational.application.events == []
    operational.wait(17 * MS + 7)
    assert operational.application.events == [(17 * MS + 7, CommunicationEvent.RPDO_MISSING)]


def test_a_deadline_that_nobody_watches_does_not_pass(operational, write):
    write("1400:05", "0C 00")
    operational.say("201#0F 00 64 00")
    operational.wait(1_000 * MS)
    assert operational.application.events == []


def test_a_short_rpdo_does_not_keep_the_deadline(operational, write):
    write("1400:05", "0C 00")
    operational.node.pdos.watch(0)
    operational.now_ns = 11 * MS
    operational.say("201#0F 00 64")
    operational.wait(12 * MS)
    assert operational.application.events == [(12 * MS, CommunicationEvent.RPDO_MISSING)]
