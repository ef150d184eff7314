"""The mathematics of the machine: geometry, kinematics, dynamics. No I/O, no clock, no drive."""

if __name__ == "mechanism":
    raise ImportError("import torquerig.mechanism: this folder is part of torquerig, not a package of its own")

from torquerig.mechanism.errors import MechanismError, ReachError, SingularPoseError
from torquerig.mechanism.manipulator import HOME, Manipulator
from torquerig.mechanism.parameters import Link
from torquerig.mechanism.values import JointAngles, TaskDynamics
from torquerig.mechanism.warm_up import warm_up

__all__ = [
    "HOME",
    "JointAngles",
    "Link",
    "Manipulator",
    "MechanismError",
    "ReachError",
    "SingularPoseError",
    "TaskDynamics",
    "warm_up",
]
