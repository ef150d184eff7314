"""Real time."""

import time
from typing import Final

SPIN_NS: Final = 150_000
"""Sleeping alone wakes 0.1 ms late in the median; with the last 0.15 ms spun, 0.1 us."""


class RealClock:
    """CLOCK_MONOTONIC, waiting by sleep and then by spinning.

    Attributes:
        spin_ns: The last stretch of a wait, spent spinning instead of sleeping [ns]; 0 sleeps only, which is right
            wherever whom one waits for needs the same processor.
    """

    def __init__(self, spin_ns: int = SPIN_NS) -> None:
        self.spin_ns = spin_ns

    now_ns = staticmethod(time.monotonic_ns)

    def wait_until(self, due_ns: int) -> None:
        """Return once the clock shows `due_ns` or later."""
        while (left_ns := due_ns - time.monotonic_ns()) > 0:
            if left_ns > self.spin_ns:
                time.sleep((left_ns - self.spin_ns) / 1e9)
