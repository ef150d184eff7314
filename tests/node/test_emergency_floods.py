"""Emergencies that come faster than they may be told: some are dropped and counted, the last one never."""

from torquerig.device_sim.canopen.emergency import WAITING

MS = 1_000_000
SYNC_OF_9 = "> 080#09"  # 1019 is 0, so a SYNC has no byte: EMCY 0x8240


def flood(bench, pairs: int) -> list[str]:
    """Let the node complain and be content again so often; what it says meanwhile."""
    said = []
    for _ in range(pairs):
        said += [text for text in (*bench.say("080#09"), *bench.say("080#")) if text.startswith("081")]
    return said


def test_waiting_emergencies_are_bounded_and_the_last_ones_are_kept(bench, write):
    write("1015", "10 27")  # 1 s from one emergency to the next
    assert len(flood(bench, 100)) == 1
    assert bench.node.counters()["emergency dropped"] == 200 - 1 - WAITING
    told = [text for _, text in bench.wait((WAITING + 5) * 1000 * MS) if text.startswith("081")]
    assert len(told) == WAITING
    assert told[-1].startswith("081#00 00")


def test_emergencies_that_waited_go_out_at_once_when_the_inhibit_time_is_cleared(bench, write):
    write("1015", "FF FF")
    flood(bench, 2000)
    write("1015", "00 00")
    told = [text for _, text in bench.wait(7000 * MS) if text.startswith("081")]
    assert len(told) == WAITING
