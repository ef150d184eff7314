"""Torques along a run: of the reference as the thesis parts them, and of the motion that was measured."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.configuration import Configuration
from torquerig.control.components import TorqueComponents, torque_components
from torquerig.control.law import THESIS_STICTION
from torquerig.control.log import LoopLog
from torquerig.mechanism import Manipulator

STICTION: Final = (THESIS_STICTION, 0.0, 0.0)
"""The thesis compensated it at motor 1 only, 6.2 [N·m at the motor]."""
_AT_REST: Final = 1e-9  # [m/s², m/s] below this a reference's value is 0


def motion_part(log: LoopLog) -> slice:
    """The rows of the motion, and the one at which it ends."""
    rows = np.flatnonzero(log.in_motion)
    return slice(int(rows[0]), int(rows[-1]) + 2)


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

    Velocity and acceleration are central differences of the measured positions, which neither lag nor lead. Of dry
    friction the thesis' model knows no more than the stiction of motor 1.

    Args:
        model: The manipulator as the controller knew it.
        log: A run's log, with a row before the motion's first and after its last.

    Returns:
        The components at `motion_part`'s rows.
    """
    part = motion_part(log)
    rows = np.arange(part.start, part.stop)
    period = log.period_ns / 1e9
    before, here, after = log.position[rows - 1], log.position[rows], log.position[rows + 1]
    velocity, acceleration = (after - before) / (2 * period), (after - 2 * here + before) / period**2
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


def dry_and_viscous(parts: TorqueComponents) -> NDArray[np.float64]:
    """All friction that the model has, shape (rows, 3) [N·m at the motor]."""
    return parts.friction + parts.stiction


def true_torque(configuration: Configuration, tau: NDArray[np.float64]) -> NDArray[np.float64]:
    """What torques were in truth that the driver has read from the simulated drives.

    The drive tells counts of its own gain; the driver divides them by its own counts per N·m.

    Args:
        configuration: Of the run, with drives that tell counts.
        tau: Torques as the driver counts them, shape (rows, 3) [N·m at the motor].

    Returns:
        Torques of the motors, shape (rows, 3) [N·m].
    """
    rig = configuration.rig
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


def rms(values: NDArray[np.float64]) -> float:
    """Root mean square over everything that is a number; NaN when nothing is."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")
