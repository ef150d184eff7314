"""A motion through given points at given times."""

from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.motions import Reference

DEGREE: Final = 5
AT_REST: Final[Any] = [(1, np.zeros(2)), (2, np.zeros(2))]
"""Velocity and acceleration zero, as a boundary condition of scipy's."""


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """The quintic spline through points, from rest to rest.

    It passes through every point at its time. Position to the fourth derivative are continuous; at both ends velocity
    and acceleration are zero, so that acceleration is continuous with the standing still before and after it.

    Attributes:
        times: When each point is passed, increasing from 0, shape (n,), n at least 2 [s].
        points: The points, shape (n, 2) [m].
    """

    times: NDArray[np.float64]
    points: NDArray[np.float64]
    _derivatives: tuple[Any, Any, Any] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Lay the spline through the points.

        Raises:
            ValueError: If there are too few points, or the times do not increase from 0.
        """
        from scipy.interpolate import make_interp_spline  # noqa: PLC0415  (other motions need not wait for it)

        if len(self.times) < 2 or self.times[0] != 0 or not np.all(np.diff(self.times) > 0):
            raise ValueError(f"{len(self.times)} times from {self.times[:1]} s: two at least, increasing from 0")
        spline = make_interp_spline(self.times, self.points, k=DEGREE, bc_type=(AT_REST, AT_REST))
        object.__setattr__(self, "_derivatives", (spline, spline.derivative(), spline.derivative(2)))

    @property
    def duration(self) -> float:
        """From the first point to the last [s]."""
        return float(self.times[-1])

    def at(self, t: float) -> Reference:
        """What the motion asks for at a time.

        Args:
            t: Time since its start [s].

        Returns:
            Position, velocity and acceleration.
        """
        if t <= 0 or t >= self.duration:
            return Reference(self.points[0 if t <= 0 else -1].copy(), np.zeros(2), np.zeros(2))
        return Reference(*(derivative(t) for derivative in self._derivatives))
