"""1010 and 1011: what a node remembers without power (CiA 301, 7.5.2.13 and 7.5.2.14)."""

from __future__ import annotations

MS = 1_000_000
SAVE = "601#23 10 10 01 73 61 76 65"
LOAD = "601#23 11 10 01 6C 6F 61 64"
STORED = "581#60 10 10 01 00 00 00 00"
RESTORED = "581#60 11 10 01 00 00 00 00"


def restart(bench) -> None:
    at_ns = bench.now_ns + MS
    bench.node.power_cycle(at_ns)
    assert bench.wait(at_ns) == [(at_ns, "701#00")]


def read(bench, index: int, subindex: int = 0) -> int:
    return bench.node.store.get(index, subindex)


def test_both_objects_say_that_they_act_on_command(bench):
    bench.talk(f"""
        > {SAVE}
        < {STORED}
        > 601#40 10 10 01 00 00 00 00
        < 581#43 10 10 01 01 00 00 00
        > 601#40 11 10 01 00 00 00 00
        < 581#43 11 10 01 01 00 00 00""")


def test_a_wrong_signature_is_refused(write):
    write("1010:01", "6C 6F 61 64", abort="20 00 00 08")
    write("1011:01", "73 61 76 65", abort="20 00 00 08")


def test_what_was_not_stored_is_gone_after_a_power_cycle(bench, write):
    write("605A", "05 00")
    restart(bench)
    assert read(bench, 0x605A) == 2


def test_what_was_stored_survives_power_cycles_and_node_resets(bench, write):
    write("605A", "05 00")
    write("1017", "0A 00")
    write("607C", "39 30 00 00")
    bench.talk(f"""
        > {SAVE}
        < {STORED}""")
    write("605A", "06 00")
    restart(bench)
    assert (read(bench, 0x605A), read(bench, 0x1017), read(bench, 0x607C)) == (5, 10, 12345)
    write("605A", "06 00")
    bench.say("000#81 01")
    bench.wait(bench.now_ns + 2 * MS)
    assert read(bench, 0x605A) == 5


def test_commands_are_not_stored(bench, write):
    write("2071", "64 00")
    write("6040", "06 00")
    bench.talk(f"""
        > {SAVE}
        < {STORED}""")
    restart(bench)
    assert (read(bench, 0x2071), read(bench, 0x6040)) == (0, 0)


def test_a_stored_mapping_is_in_force_after_a_power_cycle(bench, write):
    write("1800:01", "81 01 00 80")
    write("1A00:00", "01")
    write("1800:01", "81 01 00 00")
    bench.talk(f"""
        > {SAVE}
        < {STORED}""")
    restart(bench)
    bench.talk("""
        > 000#01 01
        > 080#
        < 181#00 00""")


def test_load_gives_the_defaults_back_at_the_next_reset(bench, write):
    write("605A", "05 00")
    bench.talk(f"""
        > {SAVE}
        < {STORED}
        > {LOAD}
        < {RESTORED}""")
    assert read(bench, 0x605A) == 5
    restart(bench)
    assert read(bench, 0x605A) == 2
