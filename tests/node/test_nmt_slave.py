"""NMT states, boot-up and both resets, by bytes typed from CiA 301, 7.2.8.3 and 7.3.2."""

from __future__ import annotations

import pytest

from torquerig.device_sim.canopen.application import CommunicationEvent
from torquerig.driver.wire.frame import Frame

MS = 1_000_000
READ_1000 = "601#40 00 10 00 00 00 00 00"
DEVICE_TYPE = "581#43 00 10 00 92 01 02 00"


def test_the_first_word_is_the_boot_up_message_and_the_heartbeat_follows_after_its_period(bench):
    assert bench.wait(49 * MS) == []
    assert bench.wait(110 * MS) == [(50 * MS, "701#7F"), (100 * MS, "701#7F")]


def test_start_stop_and_pre_operational_lead_where_the_standard_says(bench):
    for command, state in (("01", "05"), ("80", "7F"), ("02", "04"), ("01", "05"), ("02", "04"), ("80", "7F")):
        assert bench.say(f"000#{command} 01") == []
        at_ns = bench.now_ns
        assert bench.wait(at_ns + 50 * MS)[-1][1] == f"701#{state}"


def test_node_0_means_all_and_another_node_means_nobody(bench):
    bench.say("000#01 02")
    assert bench.wait(50 * MS)[-1][1] == "701#7F"
    bench.say("000#01 00")
    assert bench.wait(100 * MS)[-1][1] == "701#05"


@pytest.mark.parametrize("data", ["", "01", "01 01 00", "03 01", "01 80"])
def test_what_is_no_nmt_command_is_counted_and_changes_nothing(bench, data):
    bench.say(f"000#{data}")
    assert bench.node.counters()["NMT malformed"] == 1
    assert bench.wait(50 * MS)[-1][1] == "701#7F"


def test_a_stopped_node_answers_no_sdo_but_its_heartbeat_goes_on(bench):
    bench.talk(f"""
        > {READ_1000}
        < {DEVICE_TYPE}
        > 000#02 01
        > {READ_1000}""")
    assert bench.node.refused == 1
    assert bench.wait(50 * MS) == [(50 * MS, "701#04")]
    bench.talk(f"""
        > 000#80 01
        > {READ_1000}
        < {DEVICE_TYPE}""")


def test_pdos_are_exchanged_in_operational_only(bench):
    bench.talk("""
        > 080#
        > 201#06 00 00 00
        > 601#40 40 60 00 00 00 00 00
        < 581#4B 40 60 00 00 00 00 00
        > 000#01 01
        > 080#
        < 181#00 00 00 00 00 00 00 00
        > 201#06 00 00 00
        > 601#40 40 60 00 00 00 00 00
        < 581#4B 40 60 00 06 00 00 00
        > 000#80 01
        > 080#""")
    assert bench.node.refused == 1


def test_reset_communication_restores_1000_to_1fff_and_nothing_else(bench):
    bench.talk("""
        > 601#2B 17 10 00 0A 00 00 00
        < 581#60 17 10 00 00 00 00 00
        > 601#2B 5A 60 00 05 00 00 00
        < 581#60 5A 60 00 00 00 00 00
        > 000#82 01""")
    assert bench.wait(2 * MS) == [(1 * MS, "701#00")]
    bench.talk("""
        > 601#40 17 10 00 00 00 00 00
        < 581#4B 17 10 00 32 00 00 00
        > 601#40 5A 60 00 00 00 00 00
        < 581#4B 5A 60 00 05 00 00 00""")
    assert bench.application.power_ons == [0]


def test_reset_node_restores_everything_and_starts_the_device_anew(bench):
    bench.talk("""
        > 601#2B 5A 60 00 05 00 00 00
        < 581#60 5A 60 00 00 00 00 00
        > 000#01 01
        > 000#81 01""")
    assert bench.wait(2 * MS) == [(1 * MS, "701#00")]
    bench.talk("""
        > 601#40 5A 60 00 00 00 00 00
        < 581#4B 5A 60 00 02 00 00 00""")
    assert bench.application.power_ons == [0, 1 * MS]
    assert bench.wait(51 * MS) == [(51 * MS, "701#7F")]


def test_while_it_initialises_a_node_is_deaf(bench):
    bench.say("000#81 01")
    bench.now_ns = MS // 2
    bench.talk(f"""
        > {READ_1000}
        > 000#01 01
        > 701#R1""")
    assert bench.wait(52 * MS) == [(1 * MS, "701#00"), (51 * MS, "701#7F")]


def test_the_application_is_told_before_operational_is_left(operational):
    operational.say("000#80 01")
    operational.say("000#01 01")
    operational.say("000#02 01")
    operational.say("000#01 01")
    operational.say("000#82 01")
    assert operational.application.events == [(0, CommunicationEvent.LEFT_OPERATIONAL)] * 3


def test_extended_frames_and_foreign_remote_frames_are_counted_as_ignored(bench):
    bench.node.receive(Frame(0x601, bytes(8), extended=True), 0)
    bench.node.receive(Frame(0x601, bytes(8), remote=True), 0)
    assert bench.take() == []
    assert bench.node.counters()["remote or extended"] == 2


def test_answers_are_ready_after_the_time_that_the_node_takes(slow_bench):
    slow_bench.now_ns = 7 * MS
    slow_bench.node.receive(Frame(0x601, bytes.fromhex("4000100000000000")), 7 * MS)
    assert slow_bench.take() == [(7 * MS + 100_000, DEVICE_TYPE)]
    slow_bench.say("000#01 01")
    slow_bench.node.receive(Frame(0x080), 8 * MS)
    assert slow_bench.take() == [(8 * MS + 20_000, "181#00 00 00 00 00 00 00 00")]
