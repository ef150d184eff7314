"""Alarms of a node, at exact times."""

from collections.abc import Callable, Iterable

from torquerig.device_sim.devices import NEVER_NS


class Timers:
    """The alarms of one node; which is next is known without a search.

    Alarms at the same time ring in the order in which they were added.

    Attributes:
        now_ns: Time of what is being served, or was last [ns].
        next_ns: When the next alarm rings, NEVER_NS when none is set [ns].
    """

    __slots__ = ("_board", "_place", "actions", "dues", "next_ns", "now_ns")

    def __init__(self, now_ns: int = 0) -> None:
        self.now_ns = now_ns
        self.next_ns = NEVER_NS
        self.dues: list[int] = []
        self.actions: list[Callable[[int], None]] = []
        self._board, self._place = [NEVER_NS], 0

    def show_next(self, board: list[int], place: int) -> None:
        """From now on keep `next_ns` in `board[place]` as well, where it is seen without asking."""
        self._board, self._place = board, place
        self.expect(self.next_ns)

    def expect(self, next_ns: int) -> None:
        """Ring next at a time [ns]; for alarms only."""
        self.next_ns = self._board[self._place] = next_ns

    def add(self, action: Callable[[int], None]) -> "Timer":
        """A new alarm, not set yet.

        Args:
            action: Called with the time for which the alarm was set; the alarm is then unset.
        """
        self.dues.append(NEVER_NS)
        self.actions.append(action)
        return Timer(self, len(self.dues) - 1)

    def ring(self) -> None:
        """Ring the next alarm; there must be one."""
        dues = self.dues
        due_ns = self.next_ns
        slot = dues.index(due_ns)
        dues[slot] = NEVER_NS
        self.expect(min(dues))
        self.now_ns = due_ns
        self.actions[slot](due_ns)

    def next_but(self, timers: "Iterable[Timer]") -> int:
        """When the next alarm rings that is not one of these, NEVER_NS when no other is set [ns]."""
        dues = self.dues.copy()
        for timer in timers:
            dues[timer.slot] = NEVER_NS
        return min(dues)

    def clear(self) -> None:
        """Unset all alarms."""
        self.dues[:] = [NEVER_NS] * len(self.dues)
        self.expect(NEVER_NS)


class Timer:
    """One alarm.

    Attributes:
        slot: Its place among the alarms of its node.
    """

    __slots__ = ("_timers", "slot")

    def __init__(self, timers: Timers, slot: int) -> None:
        self._timers = timers
        self.slot = slot

    @property
    def due_ns(self) -> int:
        """When it rings, NEVER_NS when it is not set [ns]."""
        return self._timers.dues[self.slot]

    @property
    def is_set(self) -> bool:
        """Whether it will ring."""
        return self._timers.dues[self.slot] < NEVER_NS

    def arm(self, due_ns: int) -> None:
        """Set it, or set it anew, to an absolute time [ns]."""
        timers = self._timers
        was_ns = timers.dues[self.slot]
        timers.dues[self.slot] = due_ns
        if due_ns < timers.next_ns:
            timers.expect(due_ns)
        elif was_ns == timers.next_ns:
            timers.expect(min(timers.dues))

    def cancel(self) -> None:
        """Unset it."""
        self.arm(NEVER_NS)

    def ring(self) -> None:
        """Ring it, whatever else is due; it must be set."""
        timers, due_ns = self._timers, self.due_ns
        self.cancel()
        timers.now_ns = due_ns
        timers.actions[self.slot](due_ns)
