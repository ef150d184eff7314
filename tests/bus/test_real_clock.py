"""Real time: never early."""

from __future__ import annotations

import pytest

from torquerig.driver.bus.clock import RealClock


@pytest.mark.parametrize("spin_ns", [0, 150_000, 10**9])
def test_a_wait_ends_at_its_time_or_later(spin_ns):
    clock = RealClock(spin_ns)
    for wait_ns in (0, 50_000, 2_000_000):
        due_ns = clock.now_ns() + wait_ns
        clock.wait_until(due_ns)
        assert clock.now_ns() >= due_ns


def test_a_time_that_has_passed_is_not_waited_for():
    clock = RealClock()
    clock.wait_until(clock.now_ns() - 10**12)
