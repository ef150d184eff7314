"""A motion that tells the four unknowns apart: a Fourier series, periodic and band-limited, from rest to rest.

    x(t) = start + sum_k  A_k sin(k w t) + B_k (cos(k w t) - 1)        w = 2 pi / period, k = 1 .. harmonics

With  sum k A_k = 0  and  sum k² B_k = 0  every period begins and ends at the start, at rest and without acceleration.
After Swevers et al., IEEE Trans. Robotics and Automation 13(5), 1997. `calibration.design` finds the coefficients.
"""

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d

from torquerig.calibration.regressor import Actuation, Movement, equation, motor_torques
from torquerig.control.motions import Reference
from torquerig.mechanism import Manipulator

Array = NDArray[np.float64]
Pair = tuple[float, float]

SCALE: Final = Actuation(I1=0.0289, K1=0.8315, K2=0.0938, Fc=0.5)
"""Columns are compared in these units: the thesis' values (5.4.2; 0.02 N·m of stiction through the gear, 6.2)."""
SLOW: Final = 0.25
"""Joint rate below which samples are dropped: friction is not Coulomb's there (experiments.md, 5.4.2) [rad/s]."""
FRICTION: Final = 1.64
"""Coulomb friction a torque is reckoned with before it is known: the `fitted` plant's [N·m at the joint]."""
RESOLUTION: Final = 0.005
"""Where a motion is looked at: the thesis' sampling period (5.4.2) [s]."""


@dataclass(frozen=True, slots=True)
class FourierMotion:
    """A motion of the end-effector that repeats.

    Attributes:
        start: Where each period starts and ends, (x, y) [m].
        period: Of the fundamental [s].
        periods: How many are run.
        sines: A_1, A_2, ... of x and of y [m].
        cosines: B_1, B_2, ... of x and of y [m].
    """

    start: Pair
    period: float
    periods: int
    sines: tuple[tuple[float, ...], tuple[float, ...]]
    cosines: tuple[tuple[float, ...], tuple[float, ...]]

    @property
    def duration(self) -> float:
        """All periods [s]."""
        return self.period * self.periods

    def at(self, t: float) -> Reference:
        """What the motion asks for at a time; before and after it stands at its start.

        Args:
            t: Time since its start [s].

        Returns:
            Position, velocity and acceleration.
        """
        if not 0.0 < t < self.duration:
            return Reference(np.array(self.start), np.zeros(2), np.zeros(2))
        movement = self.sampled(np.array([t]))
        return Reference(movement.position[0], movement.velocity[0], movement.acceleration[0])

    def sampled(self, t: Array) -> Movement:
        """The motion at times of shape (n,) inside it [s]."""
        A, B = np.array(self.sines), np.array(self.cosines)
        w = math.tau / self.period * np.arange(1, A.shape[1] + 1)
        sine, cosine = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
        return Movement(
            np.array(self.start) + sine @ A.T + (cosine - 1.0) @ B.T,
            (w * cosine) @ A.T - (w * sine) @ B.T,
            -(w**2 * sine) @ A.T - (w**2 * cosine) @ B.T,
        )


class Envelope(NamedTuple):
    """What a motion must keep to.

    Attributes:
        x: Least and greatest x of the end-effector [m].
        y: Least and greatest y of the end-effector [m].
        joint_speed: Greatest joint rate [rad/s].
        torque: Greatest motor torque [N·m at the motor].
        conditioning: Least sigma_min(S)/sigma_max(S).
    """

    x: Pair
    y: Pair
    joint_speed: float
    torque: float
    conditioning: float


@dataclass(frozen=True, slots=True)
class Worth:
    """What a motion tells and what it takes, from the model alone.

    Attributes:
        condition_number: Of the regressor's rows that a fit will keep, columns in the units of `SCALE`.
        kept: The share of samples that it will keep.
        joint_speed: Greatest joint rate [rad/s].
        torque: Greatest motor torque [N·m at the motor].
        conditioning: Least sigma_min(S)/sigma_max(S).
        x: Least and greatest x [m].
        y: Least and greatest y [m].
    """

    condition_number: float
    kept: float
    joint_speed: float
    torque: float
    conditioning: float
    x: Pair
    y: Pair

    def objections(self, envelope: Envelope) -> list[str]:
        """Why the motion does not keep to an envelope, a clause each; none if it does."""
        found = [
            f"{axis} from {1e3 * low:.1f} to {1e3 * high:.1f} mm leaves {1e3 * least:.1f} to {1e3 * most:.1f} mm"
            for axis, (low, high), (least, most) in (("x", self.x, envelope.x), ("y", self.y, envelope.y))
            if not least <= low <= high <= most
        ]
        if not self.joint_speed <= envelope.joint_speed:
            found.append(f"a joint rate of {self.joint_speed:.2f} rad/s is above {envelope.joint_speed:.2f}")
        if not self.torque <= envelope.torque:
            found.append(f"a motor torque of {self.torque:.3f} N·m is above {envelope.torque:.3f}")
        if not self.conditioning >= envelope.conditioning:
            found.append(f"a conditioning of {self.conditioning:.3f} is below {envelope.conditioning:.3f}")
        return found


def worth(model: Manipulator, motion: FourierMotion, *, window: int) -> Worth:
    """What a motion is worth for identification.

    Args:
        model: The manipulator as far as it is known.
        motion: The motion.
        window: Samples of the fit's differentiation: a slow one spoils all windows that hold it.

    Returns:
        Its figures.

    Raises:
        ReachError, SingularPoseError: The motion leaves the reach of a leg.
    """
    times = RESOLUTION * np.arange(round(motion.duration / RESOLUTION), dtype=np.float64)
    movement = motion.sampled(times)
    both = equation(model, movement)
    kept = moving(both.rates, window)
    torque = reckoned_torques(model, movement.position, both.Y, both.force)
    x, y = movement.position.T
    return Worth(
        condition_number=condition_number(both.Y[kept]),
        kept=float(np.mean(kept)),
        joint_speed=float(np.max(np.abs(both.rates))),
        torque=float(np.max(np.abs(torque))),
        conditioning=min(model.conditioning(at) for at in movement.position),
        x=(float(x.min()), float(x.max())),
        y=(float(y.min()), float(y.max())),
    )


def reckoned_torques(model: Manipulator, position: Array, Y: Array, force: Array) -> Array:
    """Motor torques of a movement by the model and `FRICTION`, shape (n, 3); `force` is what no torque left over."""
    known = (model.actuator_inertia, model.active_viscous, model.passive_viscous, FRICTION)
    return motor_torques(model, position, Y @ np.array(known) - force)


def moving(rates: Array, window: int) -> NDArray[np.bool_]:
    """Samples in whose window no joint is slow.

    Args:
        rates: Joint rates, shape (n, 3) [rad/s].
        window: Samples, odd.

    Returns:
        Shape (n,).
    """
    least: NDArray[np.bool_] = np.all(minimum_filter1d(np.abs(rates), window, axis=0, mode="nearest") > SLOW, axis=1)
    return least


def condition_number(Y: Array) -> float:
    """Of rows of a regressor, shape (n, 2, 4 or fewer), columns in the units of `SCALE`; inf where it is singular."""
    columns = Y.shape[-1]
    if len(Y) < columns:
        return math.inf
    values = np.linalg.svd(Y.reshape(-1, columns) * np.array(SCALE[:columns]), compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 0.0 else math.inf
