"""Moving under low limits: every joint after its own angle by a PD law (decoupled PD; thesis, 6.3)."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.conductor import Conductor, Moment, Script
from torquerig.calibration.notebook import Trace
from torquerig.control.motions import Motion, SmoothMove
from torquerig.mechanism import Manipulator

Vector = NDArray[np.float64]
JOINTS: Final = 3
KP: Final = 18.0  # [N·m at the motor per rad of the joint] thesis, Table 6.1, decoupled PD
KV: Final = 0.16  # [N·m·s at the motor per rad of the joint] likewise


def holding(q: Vector, torque: float) -> Script:
    """A script that holds joint angles.

    Args:
        q: Which, shape (n,) [rad].
        torque: The most that is used [N·m at the motor].
    """
    return following(lambda _: (q, np.zeros_like(q)), torque)


def following(wanted: Callable[[float], tuple[Vector, Vector]], torque: float) -> Script:
    """A script that follows joint angles and rates.

    Args:
        wanted: Angles [rad] and rates [rad/s], shape (n,) each, at a time since the stretch began [s].
        torque: The most that is used; more is cut [N·m at the motor].
    """

    def script(now: Moment) -> Vector:
        q, qd = wanted(now.t)
        law = KP * (q - now.q) + KV * (qd - now.qd)
        cut: Vector = np.clip(law, -torque, torque)
        return cut

    return script


def along_path(model: Manipulator, motion: Motion) -> Callable[[float], tuple[Vector, Vector]]:
    """Joint angles and rates of a motion of the end-effector."""

    def wanted(t: float) -> tuple[Vector, Vector]:
        at = motion.at(min(t, motion.duration))
        return model.inverse_kinematics(at.position).theta, model.joint_rates(at.position, at.velocity)[:JOINTS]

    return wanted


def move(
    conductor: Conductor,
    words: str,
    model: Manipulator,
    motion: SmoothMove,
    *,
    torque: float,
    hold: float = 0.0,
    guard: Callable[[Moment], None] | None = None,
) -> Trace:
    """Move the end-effector, hold it at the end for a while, and let go.

    Args:
        conductor: The drives, homed.
        words: What is being done.
        model: The mechanism.
        motion: From where the machine stands.
        torque: The most that is used [N·m at the motor].
        hold: How long the end is held [s].
        guard: Looks at every cycle before its torques are worked out, and raises what ends the move.

    Returns:
        The cycles.
    """
    law = following(along_path(model, motion), torque)

    def guarded(now: Moment) -> Vector | None:
        if guard is not None:
            guard(now)
        return law(now)

    return conductor.drive(words, motion.duration + hold, guarded)
