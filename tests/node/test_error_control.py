"""Heartbeat and guarding, own and watched: CiA 301, 7.2.8.3.2. Times are exact."""

from __future__ import annotations

import pytest

from torquerig.device_sim.canopen.application import CommunicationEvent

MS = 1_000_000


@pytest.fixture
def silent(bench, write):
    """Without an own heartbeat, so that only what is tested speaks."""
    write("1017", "00 00")
    return bench


def test_a_new_producer_time_begins_a_new_period(bench, write):
    bench.wait(20 * MS)
    write("1017", "64 00")
    assert bench.wait(250 * MS) == [(120 * MS, "701#7F"), (220 * MS, "701#7F")]


def test_a_producer_time_of_0_ends_the_heartbeat(silent):
    assert silent.wait(10_000 * MS) == []


def test_a_heartbeat_that_was_never_heard_is_not_missed(silent, write):
    write("1016:01", "64 00 7F 00")
    assert silent.wait(10_000 * MS) == []


def test_a_lost_heartbeat_is_emcy_8130_exactly_when_the_consumer_time_is_over(silent, write):
    write("1016:01", "64 00 7F 00")
    silent.say("000#01 01")
    silent.now_ns = 5 * MS
    silent.say("77F#05")
    assert silent.wait(105 * MS - 1) == []
    assert silent.wait(105 * MS) == [(105 * MS, "081#30 81 11 00 00 00 00 00")]
    assert silent.application.events == [
        (105 * MS, CommunicationEvent.HEARTBEAT_LOST),
        (105 * MS, CommunicationEvent.LEFT_OPERATIONAL),
    ]
    silent.now_ns = 200 * MS
    assert silent.say("77F#05") == ["081#00 00 00 00 00 00 00 00"]


@pytest.mark.parametrize(("behaviour", "answer"), [("00", "7F"), ("01", "05"), ("02", "04")])
def test_1029_says_which_nmt_state_follows_a_communication_error(bench, write, behaviour, answer):
    write("1029:01", behaviour)
    write("1016:02", "0A 00 7F 00")
    bench.say("000#01 01")
    bench.say("77F#05")
    assert bench.wait(50 * MS) == [(10 * MS, "081#30 81 11 00 00 00 00 00"), (50 * MS, f"701#{answer}")]


def test_the_node_of_a_heard_emergency_producer_is_a_sibling(silent, write):
    write("1028:01", "82 00 00 00")
    write("1016:01", "0A 00 02 00")
    silent.say("702#05")
    silent.wait(10 * MS)
    assert silent.application.events == [(10 * MS, CommunicationEvent.SIBLING_LOST)]


@pytest.mark.parametrize("state", ["00", "04", "7F"])
def test_a_watched_node_that_leaves_operational_is_told_to_the_application(silent, write, state):
    write("1016:01", "64 00 02 00")
    silent.say("702#7F")
    silent.say("702#05")
    assert silent.application.events == []
    silent.say(f"702#{state}")
    assert silent.application.events == [(0, CommunicationEvent.SIBLING_LEFT)]


def test_a_node_cannot_be_watched_by_two_entries(write):
    write("1016:01", "64 00 7F 00")
    write("1016:02", "64 00 7F 00", abort="43 00 04 06")
    write("1016:01", "C8 00 7F 00")


def test_a_rewritten_entry_waits_for_a_first_heartbeat_again(silent, write):
    write("1016:01", "64 00 7F 00")
    silent.say("77F#05")
    write("1016:01", "65 00 7F 00")
    assert silent.wait(1_000 * MS) == []


def test_malformed_heartbeats_of_a_watched_node_are_counted(silent, write):
    write("1016:01", "64 00 7F 00")
    silent.say("77F#")
    silent.say("77F#05 05")
    silent.say("77F#03")
    assert silent.node.counters()["heartbeat malformed"] == 3
    assert silent.wait(1_000 * MS) == []


def test_guarding_answers_the_state_with_a_toggling_bit_that_starts_at_0(silent):
    silent.talk("""
        > 701#R1
        < 701#7F
        > 701#R1
        < 701#FF
        > 000#01 01
        > 701#R1
        < 701#05
        > 000#82 01""")
    silent.wait(2 * MS)
    silent.talk("""
        > 601#2B 17 10 00 00 00 00 00
        < 581#60 17 10 00 00 00 00 00
        > 701#R1
        < 701#7F""")


def test_a_node_with_a_heartbeat_is_not_guarded(bench):
    assert bench.say("701#R1") == []
    assert bench.node.counters()["remote or extended"] == 1


def test_life_guarding_begins_with_the_first_request_and_ends_after_guard_time_times_factor(silent, write):
    write("100C", "64 00")
    write("100D", "03")
    assert silent.wait(1_000 * MS) == []
    silent.say("701#R1")
    assert silent.wait(1_300 * MS - 1) == []
    assert silent.wait(1_300 * MS) == [(1_300 * MS, "081#30 81 11 00 00 00 00 00")]
    assert silent.application.events == [(1_300 * MS, CommunicationEvent.LIFE_GUARDING_LOST)]
    assert silent.say("701#R1") == ["701#FF", "081#00 00 00 00 00 00 00 00"]


def test_rewriting_the_entry_of_a_lost_heartbeat_ends_the_error(silent, write):
    write("1016:01", "0A 00 7F 00")
    silent.say("77F#05")
    assert silent.wait(20 * MS) == [(10 * MS, "081#30 81 11 00 00 00 00 00")]
    assert silent.say("601#23 16 10 01 00 00 00 00") == ["081#00 00 00 00 00 00 00 00", "581#60 16 10 01 00 00 00 00"]


def test_a_node_that_is_stopped_already_stays_so_at_the_next_loss(silent, write):
    write("1029:01", "02")
    write("1016:01", "0A 00 7F 00")
    write("1016:02", "14 00 7E 00")
    silent.say("77F#05")
    silent.say("77E#05")
    assert silent.wait(20 * MS) == [(10 * MS, "081#30 81 11 00 00 00 00 00")]
    assert len(silent.application.events) == 3  # lost, left operational for stopped, lost
