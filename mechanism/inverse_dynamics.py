"""Inverse dynamics of the redundant machine in the four ways of the thesis' chapter 3, to be held against one another.

Each function gives the motor torques of least norm for a motion, viscous friction included, shape (3,) [N·m]. The
control loop uses Lagrange-D'Alembert's form only (`Manipulator.dynamics`, `Manipulator.inverse_dynamics`).
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

import numpy as np
import numpy.typing as npt

from torquerig.mechanism import multipliers, reductions
from torquerig.mechanism.kernels import Floats
from torquerig.mechanism.manipulator import Manipulator
from torquerig.mechanism.parameters import LEGS, vector
from torquerig.mechanism.status import require_ok
from torquerig.mechanism.values import Array

InverseDynamics = Callable[[Manipulator, npt.ArrayLike, npt.ArrayLike, npt.ArrayLike], Array]


def lagrange_dalembert(
    model: Manipulator, position: npt.ArrayLike, velocity: npt.ArrayLike, acceleration: npt.ArrayLike
) -> Array:
    """Motor torques by Lagrange-D'Alembert's equations, W'tau_t = S'tau_a (3.50), shape (3,) [N·m].

    Args:
        model: The machine.
        position: Of the end-effector, shape (2,) [m].
        velocity: Its velocity, shape (2,) [m/s].
        acceleration: Its acceleration, shape (2,) [m/s²].

    Raises:
        ReachError: A leg cannot get there.
        SingularPoseError: A leg is stretched or folded there, or all distal links stand in a line.
    """
    return _reduced(reductions.lagrange_dalembert, model, position, velocity, acceleration)


def nakamura(
    model: Manipulator, position: npt.ArrayLike, velocity: npt.ArrayLike, acceleration: npt.ArrayLike
) -> Array:
    """Motor torques by Nakamura's reduction (3.15 to 3.18), arguments and errors as in `lagrange_dalembert`.

    Its free scalar alpha is chosen for the least norm. There are motions in which alpha has no effect (the thesis'
    "ambiguity"): there the torques are right, and not the least.
    """
    return _reduced(reductions.nakamura, model, position, velocity, acceleration)


def ropponen(
    model: Manipulator, position: npt.ArrayLike, velocity: npt.ArrayLike, acceleration: npt.ArrayLike
) -> Array:
    """Motor torques by Ropponen's reduction (3.19 to 3.24), arguments and errors as in `lagrange_dalembert`."""
    return _reduced(reductions.ropponen, model, position, velocity, acceleration)


def lagrange_multipliers(
    model: Manipulator, position: npt.ArrayLike, velocity: npt.ArrayLike, acceleration: npt.ArrayLike
) -> Array:
    """Motor torques by Lagrange's equations with constraints (3.32), arguments and errors as above."""
    return _constrained(model, position, velocity, acceleration)[0]


def constraint_forces(
    model: Manipulator, position: npt.ArrayLike, velocity: npt.ArrayLike, acceleration: npt.ArrayLike
) -> Array:
    """The multipliers lambda of (3.32) at the least torques: what holds the ends of the legs together, shape (4,) [N].

    The joint pushes the end of leg 2 with the first two (x, y), that of leg 3 with the last two, and that of leg 1
    against both. Arguments and errors as in `lagrange_dalembert`.
    """
    return _constrained(model, position, velocity, acceleration)[1]


METHODS: Final[Mapping[str, InverseDynamics]] = MappingProxyType(
    {
        "lagrange-dalembert": lagrange_dalembert,
        "nakamura": nakamura,
        "ropponen": ropponen,
        "lagrange-multipliers": lagrange_multipliers,
    }
)
"""The four by name, the thesis' own first."""


def _reduced(
    reduction: Callable[[Floats, Floats, Floats], int],
    model: Manipulator,
    position: npt.ArrayLike,
    velocity: npt.ArrayLike,
    acceleration: npt.ArrayLike,
) -> Array:
    """The tree's torques, reduced to the motors'."""
    x, (W, _, tau_t), tau_a = vector(position, 2), _tree(model, position, velocity, acceleration), np.empty(LEGS)
    require_ok(reduction(W, tau_t, tau_a), x, model.bases, model.link_length)
    return tau_a / model.gear_ratio


def _constrained(
    model: Manipulator, position: npt.ArrayLike, velocity: npt.ArrayLike, acceleration: npt.ArrayLike
) -> tuple[Array, Array]:
    """The motors' torques, shape (3,) [N·m], and the multipliers, shape (4,) [N]."""
    x, (_, links, tau_t) = vector(position, 2), _tree(model, position, velocity, acceleration)
    tau_a, forces = np.empty(LEGS), np.empty(multipliers.CONSTRAINTS)
    require_ok(multipliers.lagrange_multipliers(links, tau_t, tau_a, forces), x, model.bases, model.link_length)
    return tau_a / model.gear_ratio, forces


def _tree(
    model: Manipulator, position: npt.ArrayLike, velocity: npt.ArrayLike, acceleration: npt.ArrayLike
) -> tuple[Array, Array, Array]:
    """W, shape (6, 2), each leg's d and b, shape (3, 4) [m], and the cut tree's torques, shape (6,) [N·m]."""
    x, v, a = vector(position, 2), vector(velocity, 2), vector(acceleration, 2)
    W, links, tau_t = np.empty((2 * LEGS, 2)), np.empty((LEGS, 4)), np.empty(2 * LEGS)
    status = reductions.open_chain(model.constants, x, v, a, W, links, tau_t)
    require_ok(status, x, model.bases, model.link_length)
    return W, links, tau_t
