"""Where the end-effector has to be, when: the thesis' test motions, a smooth move, a hold.

Every motion is exact: position, velocity and acceleration come from one formula and its derivatives. All start and end
at rest.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from torquerig.control.errors import UnknownMotionError
from torquerig.control.profile import TrapezoidalAcceleration
from torquerig.mechanism import HOME


class Reference(NamedTuple):
    """What a motion asks for at one instant.

    Attributes:
        position: Shape (2,) [m].
        velocity: Shape (2,) [m/s].
        acceleration: Shape (2,) [m/s²].
    """

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]


class Motion(Protocol):
    """A motion of the end-effector from rest to rest."""

    @property
    def duration(self) -> float:
        """How long it lasts [s]."""
        ...

    def at(self, t: float) -> Reference:
        """What it asks for `t` seconds after its start; before and after it stands at its ends."""
        ...


@dataclass(frozen=True, slots=True)
class OutAndBack:
    """Along (1, 1) from a start, by the same distance on both axes, and back.

    Attributes:
        start: Where it starts and ends, (x, y) [m].
        stroke: One axis' way out; back is the same with the sign changed.
    """

    start: tuple[float, float]
    stroke: TrapezoidalAcceleration

    @property
    def duration(self) -> float:
        """Two strokes [s]."""
        return 2 * self.stroke.duration

    def at(self, t: float) -> Reference:
        """What the motion asks for at a time.

        Args:
            t: Time since its start [s].

        Returns:
            Position, velocity and acceleration.
        """
        out = self.stroke.duration
        if t < out:
            s, v, a = self.stroke.at(t)
        else:
            s, v, a = self.stroke.at(t - out)
            s, v, a = self.stroke.distance - s, -v, -a
        x, y = self.start
        return Reference(np.array((x + s, y + s)), np.array((v, v)), np.array((a, a)))


@dataclass(frozen=True, slots=True)
class SmoothMove:
    """A straight line from rest to rest by the quintic 10 u³ - 15 u⁴ + 6 u⁵, u = t / duration.

    Attributes:
        start: Where it starts, (x, y) [m].
        end: Where it ends, (x, y) [m].
        duration: How long it takes [s].
    """

    start: tuple[float, float]
    end: tuple[float, float]
    duration: float

    @classmethod
    def within(cls, start: tuple[float, float], end: tuple[float, float], *, speed: float, acceleration: float) -> Self:
        """The shortest such move inside two bounds.

        The quintic's greatest speed is 15/8 of distance / duration, its greatest acceleration 10/sqrt(3) of
        distance / duration².

        Args:
            start: Where it starts, (x, y) [m].
            end: Where it ends, (x, y) [m].
            speed: Greatest speed along the line [m/s].
            acceleration: Greatest acceleration along the line [m/s²].

        Returns:
            The move; it lasts 0 s when start and end are the same.

        Raises:
            ValueError: If a bound is not positive.
        """
        if not (speed > 0 and acceleration > 0):
            raise ValueError(f"a move at {speed} m/s and {acceleration} m/s²: both must be positive")
        distance = math.dist(start, end)
        duration = max(15 / 8 * distance / speed, math.sqrt(10 / math.sqrt(3) * distance / acceleration))
        return cls(start, end, duration)

    def at(self, t: float) -> Reference:
        """What the move asks for at a time.

        Args:
            t: Time since its start [s].

        Returns:
            Position, velocity and acceleration.
        """
        start, end = np.array(self.start), np.array(self.end)
        if t <= 0 or t >= self.duration:
            return Reference(start if t < self.duration else end, np.zeros(2), np.zeros(2))
        u = t / self.duration
        way = end - start
        return Reference(
            start + way * (u**3 * (10 + u * (6 * u - 15))),
            way * (30 * u**2 * (1 - u) ** 2 / self.duration),
            way * (60 * u * (1 - u) * (1 - 2 * u) / self.duration**2),
        )


@dataclass(frozen=True, slots=True)
class Hold:
    """Standing still.

    Attributes:
        position: Where, (x, y) [m].
        duration: How long [s].
    """

    position: tuple[float, float]
    duration: float

    def at(self, t: float) -> Reference:  # noqa: ARG002  (it asks for the same at all times)
        """What the hold asks for at any time: the position, at rest."""
        return Reference(np.array(self.position), np.zeros(2), np.zeros(2))


@dataclass(frozen=True, slots=True)
class ThesisStroke:
    """One axis of a test motion's way out (thesis 6.1, Figures 6.2 and 6.3).

    Attributes:
        distance: D [m].
        speed: Greatest speed v [m/s].
        acceleration: Greatest acceleration a [m/s²].
        ramp: Time tj in which the acceleration rises [s]; inferred from the figures' axes.
    """

    distance: float
    speed: float
    acceleration: float
    ramp: float


THESIS_STROKES: Final[Mapping[int, ThesisStroke]] = MappingProxyType(
    {
        # 6.1 names the two displacements exchanged; D / v and the figures' samples settle it
        1: ThesisStroke(distance=0.012096, speed=0.216, acceleration=7.2, ramp=0.014),
        2: ThesisStroke(distance=0.014400, speed=0.3, acceleration=15.0, ramp=0.012),
    }
)


def thesis_motion(number: int, *, ramp: float | None = None, start: tuple[float, float] = HOME) -> OutAndBack:
    """A test motion of the thesis: out along (1, 1) and back.

    Motion 1 lasts 200 ms, 50 samples of 4 ms; motion 2 lasts 160 ms, 40 samples.

    Args:
        number: 1 or 2.
        ramp: Time tj in which the acceleration rises [s]: the thesis' when None, a plain trapezoid of velocity when 0.
        start: Where it starts, (x, y) [m].

    Returns:
        The motion.

    Raises:
        UnknownMotionError: If there is no test motion of this number.
        ValueError: If the ramp does not fit into the stroke.
    """
    if number not in THESIS_STROKES:
        raise UnknownMotionError(f"unknown motion {number}: choose {' or '.join(map(str, THESIS_STROKES))}")
    stroke = THESIS_STROKES[number]
    tj = stroke.ramp if ramp is None else ramp
    return OutAndBack(start, TrapezoidalAcceleration(stroke.distance, stroke.speed, stroke.acceleration, tj))
