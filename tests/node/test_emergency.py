"""Emergencies: told once, remembered, gone with 0x0000; those of others (CiA 301, 7.2.7)."""

from __future__ import annotations

from torquerig.driver.wire.emcy import Emergency

MS = 1_000_000


def report(bench, code: int, information: bytes = bytes(5)) -> list[str]:
    bench.node.emergency.report(code, bench.now_ns, information=information)
    return [text for _, text in bench.take()]


def clear(bench, code: int) -> list[str]:
    bench.node.emergency.clear(code, bench.now_ns)
    return [text for _, text in bench.take()]


def test_the_error_register_collects_the_classes_of_active_errors(bench):
    assert report(bench, 0x2310) == ["081#10 23 03 00 00 00 00 00"]
    assert report(bench, 0x3220) == ["081#20 32 07 00 00 00 00 00"]
    assert report(bench, 0x4310) == ["081#10 43 0F 00 00 00 00 00"]
    assert report(bench, 0x7305) == ["081#05 73 2F 00 00 00 00 00"]
    assert report(bench, 0xFF01) == ["081#01 FF AF 00 00 00 00 00"]
    bench.talk("""
        > 601#40 01 10 00 00 00 00 00
        < 581#4F 01 10 00 AF 00 00 00""")


def test_an_active_error_is_not_told_again(bench):
    report(bench, 0x2310)
    assert report(bench, 0x2310) == []


def test_the_error_free_emergency_comes_when_the_last_error_is_gone(bench):
    report(bench, 0x2310)
    report(bench, 0x3220)
    assert clear(bench, 0x2310) == []
    assert clear(bench, 0x3220) == ["081#00 00 00 00 00 00 00 00"]
    assert clear(bench, 0x3220) == []


def test_the_history_holds_the_latest_error_first_and_eight_of_them(bench):
    for code in range(0x2301, 0x230B):
        report(bench, code, b"\x01\x02\x03\x04\x05")
    bench.talk("""
        > 601#40 03 10 00 00 00 00 00
        < 581#4F 03 10 00 08 00 00 00
        > 601#40 03 10 01 00 00 00 00
        < 581#43 03 10 01 0A 23 01 02
        > 601#40 03 10 08 00 00 00 00
        < 581#43 03 10 08 03 23 01 02""")


def test_only_0_can_be_written_to_the_history_and_clears_it(bench):
    report(bench, 0x2310)
    bench.talk("""
        > 601#40 03 10 02 00 00 00 00
        < 581#80 03 10 02 24 00 00 08
        > 601#2F 03 10 00 01 00 00 00
        < 581#80 03 10 00 30 00 09 06
        > 601#2F 03 10 00 00 00 00 00
        < 581#60 03 10 00 00 00 00 00
        > 601#40 03 10 01 00 00 00 00
        < 581#80 03 10 01 24 00 00 08""")


def test_the_history_survives_a_communication_reset_but_not_a_node_reset(bench):
    report(bench, 0x2310)
    for command, count in (("82", "01"), ("81", "00")):
        bench.say(f"000#{command} 01")
        bench.wait(bench.now_ns + 2 * MS)
        bench.talk(f"""
            > 601#40 03 10 00 00 00 00 00
            < 581#4F 03 10 00 {count} 00 00 00""")


def test_errors_that_are_active_stay_in_the_error_register_over_a_communication_reset(bench):
    report(bench, 0x2310)
    bench.say("000#82 01")
    bench.wait(2 * MS)
    bench.talk("""
        > 601#40 01 10 00 00 00 00 00
        < 581#4F 01 10 00 03 00 00 00""")


def test_the_inhibit_time_spaces_emergencies(bench, write):
    write("1017", "00 00")
    write("1015", "64 00")  # 10 ms
    assert report(bench, 0x2310) == ["081#10 23 03 00 00 00 00 00"]
    assert report(bench, 0x3220) == []
    assert report(bench, 0x4310) == []
    assert bench.wait(50 * MS) == [
        (10 * MS, "081#20 32 07 00 00 00 00 00"),
        (20 * MS, "081#10 43 0F 00 00 00 00 00"),
    ]


def test_a_stopped_node_tells_the_latest_emergency_when_it_may(bench):
    bench.say("000#02 01")
    assert report(bench, 0x2310) == []
    assert report(bench, 0x3220) == []
    assert bench.say("000#80 01") == ["081#20 32 07 00 00 00 00 00"]


def test_the_identifier_is_1014s_and_bit_31_silences_the_node(bench, write):
    write("1014", "90 00 00 00", abort="30 00 09 06")
    write("1014", "81 00 00 80")
    assert report(bench, 0x2310) == []
    write("1014", "90 00 00 00")
    assert report(bench, 0x3220) == ["090#20 32 07 00 00 00 00 00"]


def test_emergencies_of_the_nodes_in_1028_are_heard(bench, write):
    write("1028:01", "82 00 00 00")
    bench.say("082#50 82 11 01 02 03 04 05")
    bench.say("083#50 82 11 01 02 03 04 05")
    bench.say("082#50 82")
    assert bench.application.emergencies == [Emergency(2, 0x8250, 0x11, b"\x01\x02\x03\x04\x05")]
    assert bench.node.counters()["emergency malformed"] == 1


def test_emergencies_that_waited_go_together_once_the_inhibit_time_is_0(bench, write):
    write("1017", "00 00")
    write("1015", "64 00")
    for code in (0x2310, 0x3220, 0x4310):
        report(bench, code)
    write("1015", "00 00")
    assert bench.wait(50 * MS) == [
        (10 * MS, "081#20 32 07 00 00 00 00 00"),
        (10 * MS, "081#10 43 0F 00 00 00 00 00"),
    ]
