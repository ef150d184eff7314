"""Whether a wrong gear or wrong encoder counts keep the legs from closing: the zeros with one axis' scale beside them.

An axis that shows g times its motion tells theta_h + g (theta - theta_h) of the true angle theta, with theta_h where it
was homed. The closure residual (calibration.closure) changes with 1 / g as nu_k (told - theta_h), beside the zeros.
"""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from torquerig.calibration.closure import LEGS, Array, Geometry, close
from torquerig.calibration.zeros import different
from torquerig.mechanism import Manipulator, SingularPoseError

RIGHT: Final = 0.003
"""A scale that is nearer to 1 is no wrong gear: a link 0.2 mm off its drawing does as much."""
_STEPS: Final = 8  # of Gauss and Newton
_SETTLED: Final = 1e-9  # change of the unknowns at which they end


class WrongScale(NamedTuple):
    """An axis whose scale would let the legs close.

    Attributes:
        axis: From 1.
        scale: Measured over true motion.
        rms: Root mean square of the closure residuals that are left [rad].
    """

    axis: int
    scale: float
    rms: float


def wrong_scales(
    model: Manipulator, q: Array, *, start: tuple[float, float], homed: Sequence[float]
) -> list[WrongScale]:
    """Each axis' scale that lets the legs close best, the best axis first.

    Args:
        model: The manipulator, by its drawing.
        q: Joint angles of a motion, shape (n, 3) [rad]; with NaN where a sample is missing.
        start: Where the end-effector is about, (x, y) [m].
        homed: Joint angles at which the axes were homed, shape (3,) [rad].

    Returns:
        Those whose scale is not right; none if the legs cannot close at all.
    """
    theta = different(q)
    found = []
    for axis in range(LEGS):
        try:
            told = theta[:, axis] - homed[axis]
            unknowns, rms = _solve(Geometry.of(model), theta, told, axis, np.array(start))
        except SingularPoseError:
            continue
        if unknowns[LEGS] > 0.0 and abs(unknowns[LEGS] - 1.0) > RIGHT:
            found.append(WrongScale(axis + 1, 1.0 / float(unknowns[LEGS]), rms))
    return sorted(found, key=lambda each: each.rms)


def _solve(geometry: Geometry, theta: Array, told: Array, axis: int, start: Array) -> tuple[Array, float]:
    """Zeros and 1 / g, shape (4,), and the residuals' root mean square [rad]."""
    unknowns = np.array([0.0, 0.0, 0.0, 1.0])
    for _ in range(_STEPS):
        moved = theta + unknowns[:LEGS]
        moved[:, axis] += (unknowns[LEGS] - 1.0) * told
        closed = close(geometry, moved, start)
        slopes = np.column_stack([closed.normals, closed.normals[:, axis] * told])
        step = np.linalg.lstsq(slopes, -closed.residuals, rcond=None)[0]
        unknowns += step
        if float(np.abs(step).max()) < _SETTLED:
            break
    return unknowns, math.sqrt(float(np.mean(closed.residuals**2)))
