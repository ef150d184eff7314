"""A stroke along one axis whose acceleration is a trapezoid: the S-shaped profile of the thesis' test motions."""

from bisect import bisect_right
from dataclasses import dataclass, field
from itertools import pairwise
from math import sqrt
from typing import Final, NamedTuple, Self

BELOW: Final = 1 - 1e-9
"""Keeps what is computed from a bound on its right side, whatever was rounded."""


class Along(NamedTuple):
    """A point of the stroke.

    Attributes:
        s: Way made [m].
        v: Speed [m/s].
        a: Acceleration [m/s²].
    """

    s: float
    v: float
    a: float


class _Phase(NamedTuple):
    """A stretch of the stroke in which the acceleration is a straight line.

    Attributes:
        begin: When it begins [s].
        duration: How long it lasts, above 0 [s].
        s: Way made by its begin [m].
        v: Speed at its begin [m/s].
        a: Acceleration at its begin [m/s²].
        rise: What the acceleration gains until its end [m/s²].
    """

    begin: float
    duration: float
    s: float
    v: float
    a: float
    rise: float

    def at(self, t: float) -> Along:
        """The point at a time of the stroke: a cubic and its derivatives."""
        dt = t - self.begin
        gained = self.rise * (dt / self.duration)
        return Along(
            self.s + dt * (self.v + dt * (self.a / 2 + gained / 6)),
            self.v + dt * (self.a + gained / 2),
            self.a + gained,
        )


@dataclass(frozen=True, slots=True)
class TrapezoidalAcceleration:
    """A stroke from rest to rest whose acceleration rises to `acceleration`, stays, falls, and mirrors that to brake.

    It lasts exactly T = D/v + v/a + tj: speeding up takes v/a + tj, in which the speed's mean is v/2, and so does
    braking; between them the speed is v.

    Attributes:
        distance: D, the way [m].
        speed: v, the greatest speed [m/s].
        acceleration: a, the greatest acceleration [m/s²].
        ramp: tj, the time in which the acceleration rises or falls [s]; 0 gives a plain trapezoid of velocity.
    """

    distance: float
    speed: float
    acceleration: float
    ramp: float
    _phases: tuple[_Phase, ...] = field(init=False, repr=False, compare=False)
    _begins: tuple[float, ...] = field(init=False, repr=False, compare=False)

    @classmethod
    def within(cls, distance: float, speed: float, acceleration: float, ramp: float) -> Self:
        """The quickest such stroke of a distance whose speed and acceleration stay within bounds.

        A short way leaves no time to reach a bound: then v is the root of v²/a + v tj = D, or, where the ramp is
        longer than v/a, v = D / (2 tj) with a = v / tj.

        Args:
            distance: D, the way [m].
            speed: Greatest speed allowed [m/s].
            acceleration: Greatest acceleration allowed [m/s²].
            ramp: tj, the time in which the acceleration rises or falls [s].

        Returns:
            The stroke.

        Raises:
            ValueError: If a number is not positive, or the ramp negative.
        """
        if not (distance > 0 and speed > 0 and acceleration > 0 and ramp >= 0):
            return cls(distance, speed, acceleration, ramp)  # which says so
        root = acceleration / 2 * (sqrt(ramp**2 + 4 * distance / acceleration) - ramp)
        reached = min(speed, root * BELOW)
        if reached * BELOW > acceleration * ramp:
            return cls(distance, reached, acceleration, ramp)
        reached = min(speed, distance / (2 * ramp) * BELOW**2)
        return cls(distance, reached, reached / ramp * BELOW, ramp)

    def __post_init__(self) -> None:
        """Lay out the phases.

        Raises:
            ValueError: If a number is not positive, or v or a would not be reached.
        """
        if not (self.distance > 0 and self.speed > 0 and self.acceleration > 0 and self.ramp >= 0):
            raise ValueError(f"{self}: distance, speed and acceleration must be positive, the ramp not negative")
        rise = self.speed / self.acceleration
        if self.ramp > rise:
            raise ValueError(f"a ramp of {self.ramp} s is longer than v/a = {rise:.6g} s: a would not be reached")
        cruise = self.distance / self.speed - rise - self.ramp
        if cruise < 0:
            longest = self.distance / self.speed - rise
            raise ValueError(
                f"a ramp of {self.ramp} s is longer than D/v - v/a = {longest:.6g} s: v would not be reached"
            )
        object.__setattr__(self, "_phases", self._lay_out(rise, cruise))
        object.__setattr__(self, "_begins", tuple(phase.begin for phase in self._phases))

    def _lay_out(self, rise: float, cruise: float) -> tuple[_Phase, ...]:
        """The phases of the stroke in order, those that last no time left out.

        Args:
            rise: v/a [s].
            cruise: Time at the greatest speed [s].

        Returns:
            Up to seven phases.
        """
        tj, a = self.ramp, self.acceleration
        lasting = (tj, rise - tj, tj, cruise, tj, rise - tj, tj)
        corners = (0.0, a, a, 0.0, 0.0, -a, -a, 0.0)
        phases: list[_Phase] = []
        begin = s = v = 0.0
        for duration, (first, last) in zip(lasting, pairwise(corners), strict=True):
            if duration > 0:
                phase = _Phase(begin, duration, s, v, first, last - first)
                phases.append(phase)
                begin += duration
                s, v, _ = phase.at(begin)
        return tuple(phases)

    @property
    def duration(self) -> float:
        """T = D/v + v/a + tj [s]."""
        return self.distance / self.speed + self.speed / self.acceleration + self.ramp

    def at(self, t: float) -> Along:
        """The point at a time since the start, `t` [s]; before and after the stroke it rests at its ends."""
        if t >= self.duration:
            return Along(self.distance, 0.0, 0.0)
        if t < 0:
            return Along(0.0, 0.0, 0.0)
        return self._phases[bisect_right(self._begins, t) - 1].at(t)
