"""How a task force may be shared by three motors: least norm, weighted, and with internal preload.

Of three torques the end-effector feels two numbers, F = n S'tau_m. The third is free: along the null space of S'
motors strain the machine and move nothing. Least norm is `Manipulator.distribute`.
"""

from typing import Final

import numpy as np
import numpy.typing as npt

from torquerig.mechanism.errors import SingularPoseError
from torquerig.mechanism.kernels import NEAR_ZERO
from torquerig.mechanism.manipulator import Manipulator
from torquerig.mechanism.parameters import LEGS, require_positive, vector
from torquerig.mechanism.values import Array

UNREACHED: Final = 1e-6
"""Part of the preload's direction below which a motor counts as not preloaded at all."""


def weighted(model: Manipulator, position: npt.ArrayLike, force: npt.ArrayLike, weights: npt.ArrayLike) -> Array:
    """The torques of least sum w_i tau_i² that give a task force, R S (S'R S)^-1 F / n with R = diag(1/w), shape (3,).

    Weights 1 / (greatest torque)² use each motor up to the same share of what it can; equal weights are least norm.

    Args:
        model: The machine.
        position: Of the end-effector, shape (2,) [m].
        force: Wanted there, shape (2,) [N].
        weights: Above 0, shape (3,); only their ratios count.

    Raises:
        ValueError: A weight is not above 0.
        ReachError: A leg cannot get there.
        SingularPoseError: A leg is stretched or folded there, or all distal links stand in a line.
    """
    w = vector(weights, LEGS)
    for i, weight in enumerate(w.tolist()):
        require_positive(f"weight {i + 1}", weight)
    least = model.distribute(position, force)
    null = preload_direction(model, position)
    # what least norm lacks lies in the null space: the step along it at which the weighted sum is least
    preloaded: Array = least - (w * null @ least) / (w * null @ null) * null
    return preloaded


def preload_direction(model: Manipulator, position: npt.ArrayLike) -> Array:
    """Motor torques of norm 1 that the end-effector does not feel, S'tau = 0, shape (3,) [1].

    Each part is the minor of the other two legs, so that the direction goes smoothly with the position, and a motor's
    part is 0 where the other two legs pull along one line. The machine has no other such direction.

    Args:
        model: The machine.
        position: Of the end-effector, shape (2,) [m].

    Raises:
        ReachError: A leg cannot get there.
        SingularPoseError: A leg is stretched or folded there, or all distal links stand in a line.
    """
    (ax, ay), (bx, by), (cx, cy) = model.jacobians(position)[1].tolist()
    null = np.array((bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx))
    size = float(np.sqrt(null @ null))
    if not size > NEAR_ZERO * (ax * ax + ay * ay + bx * bx + by * by + cx * cx + cy * cy):
        raise SingularPoseError("all distal links stand in a line: a preload has no one direction there")
    return null / size


def preloaded(model: Manipulator, position: npt.ArrayLike, force: npt.ArrayLike, preload: float) -> Array:
    """The least torques for a task force, and a preload on top of them, shape (3,) [N·m at the motor].

    Args:
        model: The machine.
        position: Of the end-effector, shape (2,) [m].
        force: Wanted there, shape (2,) [N].
        preload: Norm of the three torques that strain the machine [N·m at the motor]; below 0 the other way round.

    Raises:
        ReachError: A leg cannot get there.
        SingularPoseError: A leg is stretched or folded there, or all distal links stand in a line.
    """
    torques: Array = model.distribute(position, force) + preload * preload_direction(model, position)
    return torques


def preload_against_backlash(model: Manipulator, position: npt.ArrayLike, force: npt.ArrayLike, margin: float) -> float:
    """The least preload with which no motor lets its gear's teeth change sides [N·m at the motor].

    With it every torque has the sign that the motor's part of `preload_direction` has, and at least `margin` of size.

    Args:
        model: The machine.
        position: Of the end-effector, shape (2,) [m].
        force: Wanted there, shape (2,) [N].
        margin: Least torque that presses the teeth of any gear together [N·m at the motor].

    Raises:
        ReachError: A leg cannot get there.
        SingularPoseError: As in `preload_direction`; or a motor cannot be preloaded there, the message says which.
    """
    null = preload_direction(model, position)
    least = model.distribute(position, force)
    for i, part in enumerate(null.tolist()):
        if abs(part) < UNREACHED:
            raise SingularPoseError(f"motor {i + 1} cannot be preloaded: the other two legs pull along one line")
    return float(np.max((margin - least * np.sign(null)) / np.abs(null)))
