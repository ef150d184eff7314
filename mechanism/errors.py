"""The mechanism's errors.

MechanismError
├── ReachError (also ValueError)          a pose that a leg cannot reach
└── SingularPoseError (also ValueError)   a pose where the asked quantity does not exist
"""


class MechanismError(Exception):
    """Root of the mechanism's errors."""


class ReachError(MechanismError, ValueError):
    """A leg cannot reach the position: the message names leg, distance and reach."""


class SingularPoseError(MechanismError, ValueError):
    """A leg is stretched or folded, or the elbows do not determine the position."""
