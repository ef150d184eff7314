"""When which torque is commanded: following a target with the drive's latency, ramps, and the cut."""

from collections import deque
from collections.abc import Callable, Iterable
from typing import Final

from torquerig.device_sim.canopen.timers import Timers
from torquerig.device_sim.devices import NEVER_NS
from torquerig.device_sim.drive.torque_path import TorquePath

_NS_PER_S: Final = 1e9


class TorqueCommand:
    """Feeds the torque path; one of nothing, following, or ramping at a time.

    A ramp is steps of one control period, the first a period after its start: a piecewise constant demand.

    Attributes:
        effect: The alarm of the next followed target's effect.
    """

    __slots__ = (
        "_done",
        "_effective",
        "_goal",
        "_path",
        "_pending",
        "_period_ns",
        "_ramp_timer",
        "_wanted",
        "effect",
    )

    def __init__(self, timers: Timers, path: TorquePath, *, period_ns: int, effective: Callable[[int], None]) -> None:
        """Build it.

        Args:
            timers: Alarms of the drive.
            path: Takes the commands.
            period_ns: Control period.
            effective: Called with the time at which a followed target took effect.
        """
        self._path = path
        self._period_ns = period_ns
        self._effective = effective
        self._pending: deque[tuple[int, float]] = deque()
        self._wanted = 0.0
        self._goal = 0.0  # what is wanted, as far as the limits allow
        self._done: Callable[[int], None] | None = None
        self.effect = timers.add(self._take_effect)
        self._ramp_timer = timers.add(self._step)

    @property
    def ramping(self) -> bool:
        """Whether a ramp is under way."""
        return self._ramp_timer.is_set

    def follow(self, at_ns: int, effect_ns: int) -> None:
        """Let the target that the objects ask for now take effect at a time.

        Args:
            at_ns: Now [ns].
            effect_ns: When the drive acts on it: now, or later [ns].
        """
        if self._ramp_timer.is_set:
            self._end_ramp()
        if effect_ns <= at_ns:
            self._forget()
            self._effective(at_ns)
            self._path.apply(self._path.target(), at_ns)
            return
        if not self._pending:
            self.effect.arm(effect_ns)
        self._pending.append((effect_ns, self._path.target()))

    def ramp(self, goal: float, at_ns: int, done: Callable[[int], None] | None = None) -> None:
        """Move the demand to a goal with the torque slope 6087.

        Args:
            goal: Where to; it is limited first [counts].
            at_ns: Now [ns].
            done: Called with the time at which the goal is reached; now, if the demand is there already.
        """
        self._forget()
        self._wanted = goal
        self._goal = self._path.clamp(goal)
        self._done = done
        if self._path.demand == self._goal:
            self._arrive(at_ns)
        else:
            self._ramp_timer.arm(at_ns + self._period_ns)

    def cut(self, at_ns: int) -> None:
        """No torque from now on."""
        self._forget()
        self._end_ramp()
        self._path.apply(0.0, at_ns)

    @property
    def pending(self) -> tuple[tuple[int, float], ...]:
        """The followed targets that wait: when each takes effect [ns], and what it is [counts]."""
        return tuple(self._pending)

    def take_back(self, pending: Iterable[tuple[int, float]]) -> None:
        """Go on with targets that wait."""
        self._pending = deque(pending)
        self.effect.arm(self._pending[0][0] if self._pending else NEVER_NS)

    def _take_effect(self, at_ns: int) -> None:
        _, counts = self._pending.popleft()
        if self._pending:
            self.effect.arm(self._pending[0][0])
        self._effective(at_ns)
        self._path.apply(counts, at_ns)

    def _step(self, at_ns: int) -> None:
        demand = self._path.demand
        step = self._path.slope * self._period_ns / _NS_PER_S
        if abs(self._goal - demand) <= step:
            self._arrive(at_ns)
            return
        self._ramp_timer.arm(at_ns + self._period_ns)
        self._path.apply(demand + step if self._goal > demand else demand - step, at_ns)

    def _arrive(self, at_ns: int) -> None:
        self._ramp_timer.cancel()
        self._path.apply(self._wanted, at_ns)
        done, self._done = self._done, None
        if done is not None:
            done(at_ns)

    def _forget(self) -> None:
        if self._pending:
            self._pending.clear()
            self.effect.cancel()

    def _end_ramp(self) -> None:
        self._done = None
        self._ramp_timer.cancel()
