"""SYNC: its identifier, its counter, and the rules of 1005 and 1019 (CiA 301, 7.2.5)."""

from __future__ import annotations

import pytest


def test_sync_is_heard_in_pre_operational_but_samples_nothing(bench):
    assert bench.say("080#") == []
    assert bench.application.syncs == [0]


def test_a_stopped_node_hears_no_sync(bench):
    bench.say("000#02 01")
    bench.say("080#")
    assert bench.application.syncs == []


def test_sync_moves_with_1005(operational, write):
    write("1005", "90 00 00 00")
    assert operational.say("080#") == []
    assert operational.say("090#") == ["181#00 00 00 00 00 00 00 00"]


@pytest.mark.parametrize("entry", ["80 00 00 40", "80 00 00 20", "01 00 00 00", "01 06 00 00"])
def test_a_node_that_generates_no_sync_refuses_such_identifiers(write, entry):
    write("1005", entry, abort="30 00 09 06")


def test_the_counter_overflow_changes_only_without_a_cycle_period(write):
    write("1019", "0A", abort="22 00 00 08")
    write("1006", "00 00 00 00")
    write("1019", "01", abort="30 00 09 06")
    write("1019", "F1", abort="31 00 09 06")
    write("1019", "F0")
    write("1019", "02")


def test_a_sync_of_the_wrong_length_is_emcy_8240_and_no_sync(operational, write):
    assert operational.say("080#01") == ["081#40 82 11 00 00 00 00 00"]
    write("1006", "00 00 00 00")
    write("1019", "0A")
    assert operational.say("080#") == []
    assert operational.say("080#01") == ["081#00 00 00 00 00 00 00 00", "181#00 00 00 00 00 00 00 00"]
    assert operational.node.counters()["SYNC of wrong length"] == 2
