"""Real-time scheduling and the garbage collector: changed for a while, reported, restored."""

import gc
import os
from pathlib import Path

import pytest

from torquerig.garbage import frozen_heap, no_collections
from torquerig.scheduling import RealTimeSetup, Step, real_time


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
    with real_time(5) as setup:
        fifo, memory, slack = setup.steps
        is_fifo = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO
        assert fifo.done == is_fifo
        assert memory.done == (locked_kib() > 0)
        assert slack.done
        assert is_fifo or slack_ns() == 1  # the kernel shows none for real-time threads
        assert ("SCHED_FIFO, priority 5" in str(setup)) == is_fifo
    assert os.sched_getscheduler(0) == before
    assert locked_kib() == 0
    assert slack_ns() == usual_ns


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
