"""Torques along a run as the findings need them: all friction, steady samples, and what torques were in truth."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.configuration import Configuration
from torquerig.control.components import TorqueComponents
from torquerig.control.log import LoopLog
from torquerig.driver.master.profile import DEFAULT_PROFILE
from torquerig.torque_parts import motion_part

_AT_REST: Final = 1e-9  # [m/s², m/s] below this a reference's value is 0


def dry_and_viscous(parts: TorqueComponents) -> NDArray[np.float64]:
    """All friction that the model has, shape (rows, 3) [N·m at the motor]."""
    return parts.friction + parts.stiction


def true_torque(configuration: Configuration, tau: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """What torques were in truth that the driver has read from the simulated drives.

    The drive tells counts of its own gain; the driver divides them by its own counts per N·m.

    Args:
        configuration: Of the run.
        tau: Torques as the driver counts them, shape (rows, 3) [N·m at the motor].

    Returns:
        Torques of the motors, shape (rows, 3) [N·m]; None where a drive's profile has it tell something else than
        counts of its gain, as per mille of a rated torque.
    """
    rig = configuration.rig
    if any(axis.profile != DEFAULT_PROFILE for axis in rig.axes.legs):
        return None
    signs = np.array([axis.sign for axis in rig.axes.legs])
    positive = np.array([axis.counts_per_nm_positive for axis in rig.axes.legs]) / rig.drive.gain_positive
    negative = np.array([axis.counts_per_nm_negative for axis in rig.axes.legs]) / rig.drive.gain_negative
    return tau * np.where(signs * tau >= 0.0, positive, negative)


def at_constant_velocity(log: LoopLog) -> NDArray[np.bool_]:
    """Which of `motion_part`'s rows ask for a velocity that is neither zero nor changing."""
    part = motion_part(log)
    is_moving = np.abs(log.desired_velocity[part]).max(axis=1) > _AT_REST
    is_steady: NDArray[np.bool_] = is_moving & (np.abs(log.desired_acceleration[part]).max(axis=1) < _AT_REST)
    return is_steady
