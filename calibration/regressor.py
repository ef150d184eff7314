"""The equation of identification, linear in what the actuators are (thesis 5.4.2).

    n S' tau_m - Mt_l a - Ct_l v  =  [ S'(S a + Sdot v),  S'S v,  Wp'Wp v,  S' sgn(thetadot) ] [ I1, K1, K2, Fc ]

S are the first three rows of W, Wp the others; Mt_l and Ct_l are the task dynamics of the links alone, so that the left
side holds only what is measured or known from the drawings.
"""

from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration import kernels
from torquerig.mechanism import Manipulator
from torquerig.mechanism.kernels import OK

Array = NDArray[np.float64]
LEGS: Final = 3


class Actuation(NamedTuple):
    """What the actuators and elbows add to the links; all at the joint, the same for all legs.

    Attributes:
        I1: Inertia of motor and gear, active joints [kg·m²].
        K1: Viscous friction, active joints [N·m·s/rad].
        K2: Viscous friction, passive joints [N·m·s/rad].
        Fc: Coulomb friction, active joints [N·m].
    """

    I1: float
    K1: float
    K2: float
    Fc: float


@dataclass(frozen=True, slots=True, eq=False)
class Movement:
    """The end-effector at n instants.

    Attributes:
        position: Shape (n, 2) [m].
        velocity: Shape (n, 2) [m/s].
        acceleration: Shape (n, 2) [m/s²].
    """

    position: Array
    velocity: Array
    acceleration: Array

    def __len__(self) -> int:
        return len(self.position)


class Equation(NamedTuple):
    """The equation at n instants: force = Y [I1, K1, K2, Fc].

    Attributes:
        Y: The regressor, shape (n, 2, 4): force at the end-effector [N] a unit of each.
        force: The left side: the motors' force at the end-effector less what moves the links, shape (n, 2) [N].
        rates: thetadot = S v, shape (n, 3) [rad/s].
    """

    Y: Array
    force: Array
    rates: Array


def equation(model: Manipulator, movement: Movement, tau_m: Array | None = None) -> Equation:
    """The equation of identification.

    Args:
        model: The manipulator; its own I1, K1 and K2 do not count.
        movement: n instants.
        tau_m: Motor torques at these instants, shape (n, 3) [N·m at the motor]; none when None.

    Returns:
        Both sides.

    Raises:
        ReachError, SingularPoseError: A position has no W.
    """
    links = replace(model, actuator_inertia=0.0, active_viscous=0.0, passive_viscous=0.0)
    n = len(movement)
    x, v, a = (np.ascontiguousarray(part) for part in (movement.position, movement.velocity, movement.acceleration))
    tau = np.zeros((n, LEGS)) if tau_m is None else np.ascontiguousarray(tau_m)
    out = Equation(np.empty((n, 2, len(Actuation._fields))), np.empty((n, 2)), np.empty((n, LEGS)))
    if kernels.equation(links.packed, x, v, a, tau, out.Y, out.force, out.rates) != OK:
        _complain(model, x)
    return out


def motor_torques(model: Manipulator, position: Array, force: Array) -> Array:
    """Forces at the end-effector as the least motor torques that give them, S (S'S)^-1 F / n.

    Args:
        model: The manipulator.
        position: Shape (n, 2) [m].
        force: Shape (n, 2) [N].

    Returns:
        Shape (n, 3) [N·m at the motor].

    Raises:
        ReachError, SingularPoseError: As `equation`.
    """
    x, tau_m = np.ascontiguousarray(position), np.empty((len(position), LEGS))
    if kernels.least_torques(model.packed, x, np.ascontiguousarray(force), tau_m) != OK:
        _complain(model, x)
    return tau_m


def _complain(model: Manipulator, position: Array) -> None:
    """Raises for the first position without W what the mechanism has to say of it."""
    for x in position:
        model.distribute(x, (0.0, 0.0))
