"""Reception from several buses as from one: in the order of time, with one wait for all of them."""

import select
from collections.abc import Callable, Sequence
from typing import Final, Protocol, runtime_checkable

from torquerig.driver.bus.interface import Bus
from torquerig.driver.wire.frame import Arrival

LONG_AGO_NS: Final = 0
"""A deadline in the past: what waits already comes, and nothing is waited for."""

AGAIN_NS: Final = 10_000_000
"""How soon to look again at a bus that nothing can come from now: it may be back."""

NS_PER_S: Final = 10**9

Wait = Callable[[int], object]
"""Returns when one of the buses may have a frame, or once the time given [ns] has come; may return sooner."""


@runtime_checkable
class Waitable(Protocol):
    """A bus that can be waited for together with others."""

    def fileno(self) -> int:
        """Return a descriptor that is readable whenever a frame waits; -1 while none can come."""
        ...


class MergedReception:
    """Frames of several buses, the earliest first of those that wait."""

    def __init__(self, members: Sequence[Bus], wait: Wait) -> None:
        """Receive from buses whose clocks are one.

        Args:
            members: The buses.
            wait: Waits for all of them.
        """
        self._members = tuple(members)
        self._wait = wait
        self._heads: list[Arrival | None] = [None] * len(self._members)

    def receive(self, until_ns: int) -> tuple[int, Arrival] | None:
        """Return the place of a bus and its next frame, or None once `until_ns` has come.

        Raises:
            BusError: A link is down or gone, or a bus is closed.
        """
        while True:
            place = self._earliest()
            if place is not None:
                arrival, self._heads[place] = self._heads[place], None
                assert arrival is not None  # noqa: S101  (it is the earliest)
                return place, arrival
            if self._members[0].now_ns() >= until_ns:
                return None
            self._wait(until_ns)

    def _earliest(self) -> int | None:
        """Look at all buses, and return the place of the one whose next frame is the earliest."""
        first, heads = None, self._heads
        for place, member in enumerate(self._members):
            head = heads[place]
            if head is None:
                head = heads[place] = member.receive(LONG_AGO_NS)
            if head is not None and (first is None or head.at_ns < first[0]):
                first = head.at_ns, place
        return None if first is None else first[1]


class WaitForAny:
    """Waits for several real-time buses at once, sleeping and then spinning."""

    def __init__(self, members: Sequence[Waitable], now_ns: Callable[[], int], *, spin_ns: int) -> None:
        """Take what is waited for.

        Args:
            members: The buses.
            now_ns: Their clock.
            spin_ns: The last stretch of a wait, spent looking instead of sleeping [ns].
        """
        self._members = tuple(members)
        self._now_ns = now_ns
        self._spin_ns = spin_ns

    def __call__(self, until_ns: int) -> None:
        """Return when a bus may have a frame, or at `until_ns` less the stretch that is spun."""
        descriptors = [descriptor for member in self._members if (descriptor := member.fileno()) >= 0]
        left_ns = until_ns - self._spin_ns - self._now_ns()
        if len(descriptors) < len(self._members):
            left_ns = min(left_ns, AGAIN_NS)
        if left_ns > 0:
            select.select(descriptors, (), (), left_ns / NS_PER_S)
