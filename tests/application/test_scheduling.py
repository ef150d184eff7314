"""Real-time scheduling and the garbage collector: changed for a while, reported, restored."""

import gc
import os
from pathlib import Path

import pytest

from torquerig.garbage import frozen_heap, no_collections
from torquerig.scheduling import Processor, RealTimeSetup, Step, real_time


def test_priority_zero_asks_for_nothing():
    before = os.sched_getscheduler(0)
    with real_time(0) as setup:
        assert os.sched_getscheduler(0) == before
    assert str(setup) == "ordinary scheduling"


def slack_ns():
    """The timer slack of this process [ns], as the kernel tells it."""
    return int(Path("/proc/self/timerslack_ns").read_text())


def locked_kib():
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmLck:")[2].split()[0])


def test_what_is_got_is_told_and_given_back():
    before = os.sched_getscheduler(0)
    usual_ns = slack_ns()
    processors = os.sched_getaffinity(0)
    with real_time(5) as setup:
        fifo, memory, slack, affinity, collector = setup.steps
        is_fifo = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO
        assert fifo.done == is_fifo
        assert memory.done == (locked_kib() > 0)
        assert slack.done
        assert is_fifo or slack_ns() == 1  # the kernel shows none for real-time threads
        assert ("SCHED_FIFO, priority 5" in str(setup)) == is_fifo
        assert affinity.done == (is_fifo and len(processors) > 1)
        assert os.sched_getaffinity(0) == ({max(processors)} if affinity.done else processors)
        assert not collector.done
    assert os.sched_getscheduler(0) == before
    assert locked_kib() == 0
    assert slack_ns() == usual_ns
    assert os.sched_getaffinity(0) == processors


def test_two_that_talk_to_each_other_keep_to_one_processor_each(monkeypatch):
    chosen = []
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: {2, 5, 7})
    monkeypatch.setattr(os, "sched_setaffinity", lambda _pid, processors: chosen.append(processors))
    monkeypatch.setattr(os, "sched_setscheduler", lambda *_: None)
    monkeypatch.setattr(os, "sched_getscheduler", lambda _pid: os.SCHED_FIFO)
    for processor in Processor:
        with real_time(5, processor):
            pass
    assert chosen == [{2}, {2, 5, 7}, {7}, {2, 5, 7}]


def test_nothing_is_pinned_that_would_wait_behind_others(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: {0, 1})
    monkeypatch.setattr(os, "sched_setscheduler", lambda *_: None)
    with real_time(5) as setup:
        assert "affinity (without SCHED_FIFO it would wait behind others there)" in str(setup)


def test_a_frozen_collector_is_told_as_a_step():
    with no_collections(), real_time(5) as setup:
        assert setup.steps[-1] == Step("collector", done=True, words="collector frozen")


def test_a_refusal_is_told_and_not_fatal(monkeypatch):
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    with monkeypatch.context() as patch:
        patch.setattr(os, "sched_setscheduler", refuse)
        context = real_time(5)
        setup = context.__enter__()
    context.__exit__(None, None, None)
    assert not setup.steps[0].done
    assert "refused: SCHED_FIFO (CAP_SYS_NICE or an rtprio limit allows it) (Operation not permitted)" in str(setup)


def test_without_any_of_it_scheduling_is_ordinary():
    assert str(RealTimeSetup((Step("it", done=False, words="why"),))) == "ordinary scheduling; refused: it (why)"


@pytest.mark.parametrize("enabled", [True, False])
def test_the_collector_is_as_it_was_afterwards(enabled):
    was = gc.isenabled()
    try:
        (gc.enable if enabled else gc.disable)()
        with no_collections():
            assert not gc.isenabled()
            assert gc.get_freeze_count() > 0
        assert gc.isenabled() == enabled
        with frozen_heap():
            assert gc.isenabled() == enabled
        assert gc.get_freeze_count() == 0
    finally:
        (gc.enable if was else gc.disable)()
