"""What Manipulator's methods return when it is more than one array."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class JointAngles(NamedTuple):
    """Joint angles of a pose.

    Attributes:
        theta: World angles of the proximal links, shape (3,) [rad].
        phi: Angles of the distal links relative to them, shape (3,) [rad].
    """

    theta: Array
    phi: Array


class TaskDynamics(NamedTuple):
    """The machine in task coordinates: Mt a + Ct v + Ft v = n S' tau_m.

    Attributes:
        Mt: Inertia, shape (2, 2) [kg].
        Ct: Coriolis and centrifugal matrix, shape (2, 2) [kg/s].
        Ft: Viscous friction, shape (2, 2) [N·s/m].
        S: Jacobian of the active joints, thetadot = S v, shape (3, 2) [1/m].
    """

    Mt: Array
    Ct: Array
    Ft: Array
    S: Array
