"""What a run's torques are made of: along its reference as the thesis parts them, and along what was measured."""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from torquerig.control.components import TorqueComponents, torque_components
from torquerig.control.law import THESIS_STICTION
from torquerig.control.log import LoopLog
from torquerig.mechanism import Manipulator

STICTION: Final = (THESIS_STICTION, 0.0, 0.0)
"""The thesis compensated it at motor 1 only, 6.2 [N·m at the motor]."""
DIFFERENCE_NS: Final = 4_000_000
"""Half of what a central difference spans: the thesis' sampling time. Over less, acceleration is encoder counts."""


@dataclass(frozen=True, slots=True, eq=False)
class TorqueParts:
    """The torques of a run's motion, one row a sample of `motion_part`, one column a motor.

    Attributes:
        reference: What the reference takes by the model.
        measured: What the motion that was measured takes by the model.
        recorded: What the drives reported, shape (rows, 3) [N·m at the motor].
    """

    reference: TorqueComponents
    measured: TorqueComponents
    recorded: NDArray[np.float64]

    @classmethod
    def of(cls, model: Manipulator, log: LoopLog) -> Self:
        """The torques of a log that has a row of its motion.

        Args:
            model: The manipulator as the controller knew it.
            log: A run's log.

        Returns:
            Its torques; NaN where a row was skipped, or where a difference would need a row that there is not.

        Raises:
            ReachError, SingularPoseError: The model has no torque at a position that was asked for or measured.
        """
        return cls(reference_components(model, log), measured_components(model, log), recorded_torque(log))

    @property
    def residual(self) -> NDArray[np.float64]:
        """What the model does not explain of the recorded torque, shape (rows, 3) [N·m at the motor]."""
        return self.recorded - self.measured.total


def motion_part(log: LoopLog) -> slice:
    """The rows of the motion, as far as they were run, and the one at which it ends."""
    rows = np.flatnonzero(log.in_motion[: log.rows])
    return slice(int(rows[0]), min(int(rows[-1]) + 2, log.rows))


def reference_components(model: Manipulator, log: LoopLog) -> TorqueComponents:
    """What the reference takes, as the thesis' Figures 6.4 and 6.5 part it.

    Args:
        model: The manipulator as the controller knew it.
        log: A run's log.

    Returns:
        The components at `motion_part`'s rows.
    """
    part = motion_part(log)
    place, velocity = log.desired_position[part], log.desired_velocity[part]
    return torque_components(model, place, velocity, log.desired_acceleration[part], stiction=STICTION)


def measured_components(model: Manipulator, log: LoopLog) -> TorqueComponents:
    """What the motion that was measured takes, by the same model.

    Velocity and acceleration are central differences of the measured positions over `DIFFERENCE_NS` on either side,
    which neither lag nor lead. Of dry friction the thesis' model knows no more than the stiction of motor 1.

    Args:
        model: The manipulator as the controller knew it.
        log: A run's log.

    Returns:
        The components at `motion_part`'s rows; NaN in those that lack a row so long before or after them.
    """
    part = motion_part(log)
    away = max(round(DIFFERENCE_NS / log.period_ns), 1)
    span = away * log.period_ns / 1e9
    beyond = np.full((away, log.position.shape[1]), np.nan)
    position = np.concatenate((beyond, log.position[: log.rows], beyond))
    rows = np.arange(part.start, part.stop) + away
    before, here, after = position[rows - away], position[rows], position[rows + away]
    velocity, acceleration = (after - before) / (2 * span), (after - 2 * here + before) / span**2
    return torque_components(model, here, velocity, acceleration, stiction=STICTION)


def recorded_torque(log: LoopLog) -> NDArray[np.float64]:
    """The motors' torques that acted while the machine was where `motion_part`'s rows measured it.

    SYNC latches a drive's position and actual torque together, and its TPDO1 brings both: they stand in one row. It is
    the torque that the command of the row before has brought, which left about 3 ms after its SYNC and holds for 4 ms.

    Args:
        log: A run's log.

    Returns:
        Torques as the driver counts them, shape (rows, 3) [N·m at the motor].
    """
    return log.tau_actual[motion_part(log)]
