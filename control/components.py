"""What a motion's motor torques are made of (thesis 6.2, Figures 6.4 and 6.5)."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from torquerig.control.tracking import rms
from torquerig.mechanism import Manipulator

AXES = 3


class Shares(NamedTuple):
    """Root mean square of each component over that of the total; components may oppose, so they need not sum to 1.

    Attributes:
        inertia: Of Mt a.
        coriolis: Of Ct v.
        friction: Of Ft v.
        stiction: Of stiction.
    """

    inertia: float
    coriolis: float
    friction: float
    stiction: float


@dataclass(frozen=True, slots=True, eq=False)
class TorqueComponents:
    """The torques that a motion takes, one row a sample, one column a motor, shape (rows, 3) [N·m at the motor].

    Attributes:
        inertia: S(S'S)^-1 Mt a / n.
        coriolis: S(S'S)^-1 Ct v / n: Coriolis and centrifugal.
        friction: S(S'S)^-1 Ft v / n: viscous, active and passive joints.
        stiction: The given torque in the direction of each joint's rate.
    """

    inertia: NDArray[np.float64]
    coriolis: NDArray[np.float64]
    friction: NDArray[np.float64]
    stiction: NDArray[np.float64]

    @property
    def total(self) -> NDArray[np.float64]:
        """The sum of all, shape (rows, 3) [N·m at the motor]."""
        return self.inertia + self.coriolis + self.friction + self.stiction

    @property
    def share(self) -> Shares:
        """Each component's share of the total, over all motors and all rows that are numbers; NaN without torque."""
        total = rms(self.total)
        parts = (self.inertia, self.coriolis, self.friction, self.stiction)
        return Shares(*(rms(part) / total if total > 0.0 else np.nan for part in parts))


def torque_components(
    model: Manipulator,
    position: NDArray[np.float64],
    velocity: NDArray[np.float64],
    acceleration: NDArray[np.float64],
    *,
    stiction: npt.ArrayLike = 0.0,
) -> TorqueComponents:
    """The motor torques of inertia, Coriolis and centrifugal forces, viscous friction and stiction along a motion.

    Each force is distributed over the motors at minimum norm, as the control laws do.

    Args:
        model: The manipulator.
        position: Of the end-effector, desired or measured, shape (rows, 2) [m].
        velocity: Its velocity, shape (rows, 2) [m/s].
        acceleration: Its acceleration, shape (rows, 2) [m/s²].
        stiction: Torque that each motor takes to turn at all, a number or shape (3,) [N·m at the motor]; the thesis
            compensated 0.02 at motor 1 only (6.2).

    Returns:
        The components; rows in which anything is NaN, as in skipped cycles, are NaN.

    Raises:
        ValueError: If the arrays' shapes do not match.
        ReachError, SingularPoseError: As `Manipulator.distribute` at any of the positions.
    """
    if not position.shape == velocity.shape == acceleration.shape == (len(position), 2):
        shapes = ", ".join(str(array.shape) for array in (position, velocity, acceleration))
        raise ValueError(f"position, velocity and acceleration have shapes {shapes}: must all be (rows, 2)")
    dry = np.broadcast_to(np.array(stiction, dtype=np.float64), (AXES,))
    parts = np.full((len(position), 4, AXES), np.nan)
    known = np.isfinite(np.hstack((position, velocity, acceleration))).all(axis=1)
    for k in np.flatnonzero(known):
        x, v = position[k], velocity[k]
        terms = model.dynamics(x, v)
        forces = (terms.Mt @ acceleration[k], terms.Ct @ v, terms.Ft @ v)
        parts[k, :3] = [model.distribute(x, force) for force in forces]
        parts[k, 3] = dry * np.sign(terms.S @ v)
    return TorqueComponents(*(parts[:, i] for i in range(4)))
