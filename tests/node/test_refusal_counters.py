"""What a node did not take is counted, and read from object 2140 by whoever asks."""

from __future__ import annotations

import pytest

MS = 1_000_000
NAMES = (
    *("refused in the NMT state", "remote or extended", "NMT malformed", "SDO malformed", "SDO refused"),
    *("SDO aborted by the client", "SDO segment skipped", "SYNC of wrong length", "heartbeat malformed"),
    *("emergency malformed", "RPDO too short", "RPDO too late", "RPDO value refused", "emergency dropped"),
)


def read(bench, subindex: int) -> int:
    (answer,) = bench.say(f"601#40 40 21 {subindex:02X} 00 00 00 00")
    assert answer.startswith(f"581#43 40 21 {subindex:02X}")
    return int.from_bytes(bytes.fromhex(answer[4:])[4:], "little")


def test_the_object_has_the_counters_in_their_order(bench):
    assert tuple(bench.node.counters()) == NAMES
    assert bench.say("601#40 40 21 00 00 00 00 00") == [f"581#4F 40 21 00 {len(NAMES):02X} 00 00 00"]
    assert [read(bench, subindex) for subindex in range(1, len(NAMES) + 1)] == [0] * len(NAMES)


@pytest.mark.parametrize(
    ("subindex", "said"),
    [
        (1, "201#0F 00 00 00"),  # an RPDO in pre-operational
        (2, "701#R1"),  # guarding while there is a heartbeat
        (2, "000#R2"),
        (3, "000#01"),
        (3, "000#07 01"),
        (3, "000#01 01 00"),
        (4, "601#40 00 10"),
        (5, "601#40 00 55 00 00 00 00 00"),  # no such object
        (5, "601#60 00 00 00 00 00 00 00"),  # a segment of nothing
        (8, "080#01"),
    ],
)
def test_a_refusal_is_read_where_it_belongs(bench, subindex, said):
    bench.say(said)
    assert read(bench, subindex) == 1
    assert sum(bench.node.counters().values()) == 1


def test_a_remote_frame_to_a_pdo_that_forbids_it_is_counted(bench, write):
    write("1800:01", "81 01 00 C0")
    write("1800:01", "81 01 00 40")
    bench.say("000#01 01")
    assert bench.say("181#R8") == []
    assert read(bench, 2) == 1


def test_no_reset_over_the_bus_clears_a_counter(bench):
    bench.say("000#07 01")
    for reset in ("000#82 01", "000#81 01"):
        bench.say(reset)
        bench.wait(bench.now_ns + 10 * MS)
    assert read(bench, 3) == 1


def test_a_client_that_aborts_is_counted(bench):
    bench.talk("""
        > 601#21 40 60 00 02 00 00 00
        < 581#60 40 60 00 00 00 00 00
        > 601#80 40 60 00 00 00 04 05""")
    assert read(bench, 6) == 1


def test_segments_out_of_their_sequence_are_counted(bench):
    bench.talk("""
        > 601#C2 40 60 00 02 00 00 00
        < 581#A0 40 60 00 7F 00 00 00
        > 601#02 00 00 00 00 00 00 00
        > 601#80 40 60 00 00 00 04 05""")
    assert read(bench, 7) == 1
