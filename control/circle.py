"""Circles of the end-effector, from rest to rest."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from torquerig.control.motions import Reference
from torquerig.control.profile import TrapezoidalAcceleration


@dataclass(frozen=True, slots=True)
class Circle:
    """Whole laps of a circle, begun and ended at its point of greatest x.

    The way along the arc is a `TrapezoidalAcceleration`: with s(t), its speed v and acceleration a along the arc, the
    acceleration is a along the tangent and v²/r towards the centre. Both are continuous if the stroke has a ramp.

    Attributes:
        centre: Its centre, (x, y) [m].
        radius: Its radius r, above 0 [m].
        stroke: The way along the arc, 2 pi r a lap.
        turn: 1 counter-clockwise, -1 clockwise.
    """

    centre: tuple[float, float]
    radius: float
    stroke: TrapezoidalAcceleration
    turn: int

    @classmethod
    def laps(
        cls,
        centre: tuple[float, float],
        radius: float,
        count: int,
        *,
        speed: float,
        acceleration: float,
        ramp: float,
        turn: int = 1,
    ) -> Self:
        """So many laps at a speed.

        Args:
            centre: The circle's centre, (x, y) [m].
            radius: Its radius [m].
            count: Laps, 1 or more.
            speed: Greatest speed along the arc [m/s].
            acceleration: Greatest acceleration along the arc, at start and end [m/s²].
            ramp: Time in which that acceleration rises or falls [s].
            turn: 1 counter-clockwise, -1 clockwise.

        Returns:
            The motion; laps that are too short to reach the speed are made at a lower one.

        Raises:
            ValueError: If radius, count, speed or acceleration is not positive, or the ramp negative.
        """
        way = 2 * math.pi * radius * count
        return cls(centre, radius, TrapezoidalAcceleration.within(way, speed, acceleration, ramp), turn)

    @property
    def duration(self) -> float:
        """All laps [s]."""
        return self.stroke.duration

    def at(self, t: float) -> Reference:
        """What the motion asks for at a time.

        Args:
            t: Time since its start [s].

        Returns:
            Position, velocity and acceleration.
        """
        s, v, a = self.stroke.at(t)
        angle = self.turn * s / self.radius
        outward = np.array((math.cos(angle), math.sin(angle)))
        forward = self.turn * np.array((-outward[1], outward[0]))
        return Reference(
            np.array(self.centre) + self.radius * outward, v * forward, a * forward - v**2 / self.radius * outward
        )
