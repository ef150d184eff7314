"""Straight lines from corner to corner, with a stop at each."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import accumulate, pairwise
from typing import NamedTuple, Self

import numpy as np

from torquerig.control.motions import Reference
from torquerig.control.profile import TrapezoidalAcceleration


class Side(NamedTuple):
    """A straight line from rest to rest.

    Attributes:
        start: Where it starts, (x, y) [m].
        direction: Unit vector along it.
        stroke: The way along it.
    """

    start: tuple[float, float]
    direction: tuple[float, float]
    stroke: TrapezoidalAcceleration


@dataclass(frozen=True, slots=True)
class Polyline:
    """Sides one after another. The path is exact: each corner is passed at rest, none is rounded.

    Attributes:
        sides: The sides in order, each starting where the one before ends; at least one.
    """

    sides: tuple[Side, ...]
    _begins: tuple[float, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Lay the sides along time."""
        lasting = (side.stroke.duration for side in self.sides)
        object.__setattr__(self, "_begins", tuple(accumulate(lasting, initial=0.0)))

    @classmethod
    def through(cls, corners: Sequence[tuple[float, float]], *, speed: float, acceleration: float, ramp: float) -> Self:
        """From the first corner through all others.

        Args:
            corners: Where to stop, (x, y) [m]; at least two, neighbours not the same.
            speed: Greatest speed along a side [m/s].
            acceleration: Greatest acceleration along a side [m/s²].
            ramp: Time in which the acceleration rises or falls [s].

        Returns:
            The motion; a side that is too short to reach the speed is made at a lower one.

        Raises:
            ValueError: If there are too few corners, two neighbours are the same, speed or acceleration is not
                positive, or the ramp negative.
        """
        if len(corners) < 2:
            raise ValueError(f"{len(corners)} corners: a path has two at least")
        sides = []
        for number, (start, end) in enumerate(pairwise(corners), start=1):
            length = math.dist(start, end)
            if length == 0:
                raise ValueError(f"corners {number} and {number + 1} are the same, {start} m")
            stroke = TrapezoidalAcceleration.within(length, speed, acceleration, ramp)
            sides.append(Side(start, ((end[0] - start[0]) / length, (end[1] - start[1]) / length), stroke))
        return cls(tuple(sides))

    @property
    def duration(self) -> float:
        """All sides [s]."""
        return self._begins[-1]

    def at(self, t: float) -> Reference:
        """What the motion asks for at a time.

        Args:
            t: Time since its start [s].

        Returns:
            Position, velocity and acceleration.
        """
        number = min(max(bisect_right(self._begins, t) - 1, 0), len(self.sides) - 1)
        start, along, stroke = self.sides[number]
        s, v, a = stroke.at(t - self._begins[number])
        direction = np.array(along)
        return Reference(np.array(start) + s * direction, v * direction, a * direction)
