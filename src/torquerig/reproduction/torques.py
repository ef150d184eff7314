"""Torques along a run: of the reference as the thesis parts them, and of the motion that was measured."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.components import TorqueComponents, torque_components
from torquerig.control.law import THESIS_STICTION
from torquerig.control.log import LoopLog
from torquerig.mechanism import Manipulator
from torquerig.reproduction.experiments import motion_part

STICTION: Final = (THESIS_STICTION, 0.0, 0.0)
"""The thesis compensated it at motor 1 only, 6.2 [N·m at the motor]."""
_AT_REST: Final = 1e-9  # [m/s², m/s] below this a reference's value is 0


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
    """What the motion that was measured takes, by the same model but without stiction.

    Velocity and acceleration are central differences of the measured positions, which neither lag nor lead.

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
    return torque_components(model, here, (after - before) / (2 * period), (after - 2 * here + before) / period**2)


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
