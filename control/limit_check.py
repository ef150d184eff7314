"""The loop's look at the limits, compiled: a fraction of a microsecond in every cycle."""

# ruff: noqa: PLR0917  -- a kernel takes plain numbers, as many as the equation has

from math import hypot
from typing import Final

from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import Floats
from torquerig.mechanism.singularities import conditioning, singularity_distance

# layout of the bounds
X: Final = 0  # least, greatest [m]
Y: Final = 2
CONDITIONING: Final = 4  # least [1]
DISTANCE: Final = 5  # least, to a singular pose [m]
JOINT_SPEED: Final = 6  # greatest [rad/s]
POSITION_ERROR: Final = 7  # greatest [m]
TORQUE: Final = 8  # what is commanded at most [N·m at the motor]
TORQUE_STOP: Final = 9  # what stops the machine [N·m at the motor]


@compiled
def within(
    p: Floats, bounds: Floats, x: float, y: float, x_d: float, y_d: float, rate_1: float, rate_2: float, rate_3: float
) -> bool:
    """Whether a state keeps all bounds; what is not a number keeps none.

    Plain numbers, because kernels are compiled anew for arrays of another layout, and that may not happen in a cycle.

    Args:
        p: The manipulator's packed constants.
        bounds: In the layout above.
        x: The end-effector [m].
        y: Likewise.
        x_d: Where the reference wants it [m].
        y_d: Likewise.
        rate_1: Rate of active joint 1 [rad/s].
        rate_2: Likewise.
        rate_3: Likewise.
    """
    if not (bounds[X] <= x <= bounds[X + 1] and bounds[Y] <= y <= bounds[Y + 1]):
        return False
    speed = bounds[JOINT_SPEED]
    if not (abs(rate_1) <= speed and abs(rate_2) <= speed and abs(rate_3) <= speed):
        return False
    if not hypot(x_d - x, y_d - y) <= bounds[POSITION_ERROR]:
        return False
    return bool(singularity_distance(p, x, y) >= bounds[DISTANCE] and conditioning(p, x, y) >= bounds[CONDITIONING])
