"""Real-time scheduling and the garbage collector: changed for a while, reported, restored."""

import gc
import os

import pytest

from torquerig.garbage import frozen_heap, no_collections
from torquerig.scheduling import real_time


def test_priority_zero_asks_for_nothing():
    before = os.sched_getscheduler(0)
    with real_time(0) as words:
        assert os.sched_getscheduler(0) == before
    assert words == "ordinary scheduling"


def test_what_is_got_is_told_and_given_back():
    before = os.sched_getscheduler(0)
    with real_time(5) as words:
        is_fifo = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO
        assert words == ("SCHED_FIFO, priority 5" if is_fifo else words)
        assert is_fifo or "SCHED_FIFO is refused" in words
    assert os.sched_getscheduler(0) == before


def test_a_refusal_is_told_and_not_fatal(monkeypatch):
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    with monkeypatch.context() as patch:
        patch.setattr(os, "sched_setscheduler", refuse)
        context = real_time(5)
        words = context.__enter__()
    context.__exit__(None, None, None)
    assert words == "ordinary scheduling, because SCHED_FIFO is refused (Operation not permitted)"


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
