"""From sampled joint angles to position, velocity and acceleration, three ways; what is wrong at the ends is cut off.

- `causal_window`: the thesis' way. The mean difference over nine samples, and the same again for the acceleration:
  the velocity is 4 periods late and the acceleration 8, while the torque is not.
- `savitzky_golay`: a quartic through nine samples about each instant: no delay.
- `smoothed`: a Kalman filter forwards and the Rauch-Tung-Striebel smoother backwards (filterpy), with a random walk of
  the jerk whose intensity makes the measured samples likeliest.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from filterpy.common import Q_continuous_white_noise
from filterpy.kalman import KalmanFilter
from scipy.optimize import minimize_scalar
from scipy.signal import savgol_coeffs, savgol_filter

from torquerig.calibration.regressor import LEGS, Array, Movement
from torquerig.mechanism import Manipulator

WINDOW: Final = 9
"""Samples (thesis, 5.4.2: a window of length nine)."""
ORDER: Final = 4
"""Of Savitzky and Golay's polynomial: the least even order whose second derivative has no bias of second order."""
STATES: Final = 4
"""Position, velocity, acceleration, jerk."""
_FINEST: Final = 1e-6
"""No encoder of such a machine resolves less [rad at the joint]; smaller differences are rounding."""
_LEARNT: Final = 250
"""Samples from which the intensity is learnt: a second of the motion."""
_SETTLING: Final = 2 * WINDOW
_INTENSITIES: Final = (0.0, 12.0)
"""Where the intensity of the jerk's random walk is sought, powers of ten [m²/s⁷]: from 2 mm/s³ to 2 km/s³ in 5 s."""


@dataclass(frozen=True, slots=True, eq=False)
class Kinematics:
    """A movement found from samples.

    Attributes:
        movement: At the samples that are kept.
        rows: Which samples these are, a slice of all of them.
        weights: c_j: the acceleration is  sum_j c_j x(t + j T) / T²,  j = -h .. h; shape (2 h + 1,), empty where it
            looks into the past only.
    """

    movement: Movement
    rows: slice
    weights: Array


def positions(model: Manipulator, q: Array) -> Array:
    """The end-effector at n samples of joint angles of shape (n, 3) [rad]: shape (n, 2) [m]."""
    return np.array([model.forward_kinematics(theta) for theta in q])


def causal_window(model: Manipulator, q: Array, period: float) -> Kinematics:
    """The thesis' way (5.4.2): differences over a window of nine, of the angles and again of their rates.

    Args:
        model: The manipulator.
        q: Joint angles, shape (n, 3) [rad].
        period: Sampling period [s].

    Returns:
        Position and estimates as an observer has them at each sample, late as they are.
    """
    span = WINDOW - 1
    rates = (q[span:] - q[:-span]) / (span * period)
    slopes = (rates[span:] - rates[:-span]) / (span * period)
    rates, angles = rates[span:], q[2 * span :]
    x = positions(model, angles)
    v = np.array([model.task_velocity(at, rate) for at, rate in zip(x, rates, strict=True)])
    a = np.array(
        [
            # thetaddot = S a + Sdot v; least squares for a has the same matrix as for v
            model.task_velocity(at, slope - model.jacobian_rates(at, speed)[:LEGS] @ speed)
            for at, speed, slope in zip(x, v, slopes, strict=True)
        ]
    )
    return Kinematics(Movement(x, v, a), slice(2 * span, len(q)), np.empty(0))


def savitzky_golay(model: Manipulator, q: Array, period: float) -> Kinematics:
    """Zero-phase: a quartic through nine samples about each instant.

    Args:
        model: The manipulator.
        q: Joint angles, shape (n, 3) [rad].
        period: Sampling period [s].

    Returns:
        Estimates without delay; half a window is lost at each end.
    """
    sampled = positions(model, q)
    keep = slice(WINDOW // 2, len(q) - WINDOW // 2)
    x, v, a = (savgol_filter(sampled, WINDOW, ORDER, deriv=n, delta=period, axis=0)[keep] for n in range(3))
    return Kinematics(Movement(x, v, a), keep, savgol_coeffs(WINDOW, ORDER, deriv=2, use="dot"))


def smoothed(model: Manipulator, q: Array, period: float, *, noise: float) -> Kinematics:
    """Kalman filter and Rauch-Tung-Striebel smoother of the end-effector's two coordinates.

    Args:
        model: The manipulator.
        q: Joint angles, shape (n, 3) [rad].
        period: Sampling period [s].
        noise: Standard deviation of a sampled coordinate: the encoder's floor at the end-effector [m].

    Returns:
        Estimates without delay; two windows are cut off at each end, where the smoother knows one side only.
    """
    sampled = positions(model, q)

    def unlikeliness(power: float) -> float:
        return sum(_unlikeliness(_filter(period, noise, 10.0**power), axis) for axis in sampled[:_LEARNT].T)

    best = minimize_scalar(unlikeliness, bounds=_INTENSITIES, method="bounded", options={"xatol": 0.2})
    keep = slice(_SETTLING, len(q) - _SETTLING)
    states = np.stack([_smooth(_filter(period, noise, 10.0**best.x), axis) for axis in sampled.T], axis=-1)[keep]
    x, v, a = states[:, 0], states[:, 1], states[:, 2]
    impulse = np.zeros(4 * _SETTLING + 1)
    impulse[2 * _SETTLING] = 1.0  # what it does to the acceleration around it are the weights, mirrored: they are even
    answer = _smooth(_filter(period, noise, 10.0**best.x), impulse)[_SETTLING : 3 * _SETTLING + 1, 2]
    return Kinematics(Movement(x, v, a), keep, period**2 * answer)


def _filter(period: float, noise: float, intensity: float) -> KalmanFilter:
    """One coordinate: position measured, jerk a random walk of this intensity [m²/s⁷]."""
    kalman = KalmanFilter(dim_x=STATES, dim_z=1)
    t = period
    kalman.F = np.array([[1, t, t**2 / 2, t**3 / 6], [0, 1, t, t**2 / 2], [0, 0, 1, t], [0, 0, 0, 1]])
    kalman.H = np.array([[1.0, 0.0, 0.0, 0.0]])
    kalman.Q = Q_continuous_white_noise(STATES, t, intensity)
    kalman.R *= noise**2
    # at first the machine may be anywhere near and do anything it can
    kalman.P = np.diag([1e-2, 1.0, 1e2, 1e4]) ** 2
    return kalman


def _unlikeliness(kalman: KalmanFilter, samples: Array) -> float:
    """Minus the logarithm of the likelihood of samples of shape (n,) [m], up to a constant."""
    kalman.x = np.array([[samples[0]], [0.0], [0.0], [0.0]])
    total = 0.0
    for z in samples:
        kalman.predict()
        kalman.update(z)
        variance = kalman.S.item()
        total += 0.5 * (math.log(variance) + kalman.y.item() ** 2 / variance)
    return total


def _smooth(kalman: KalmanFilter, samples: Array) -> Array:
    """Position, velocity, acceleration and jerk at all samples, shape (n, 4)."""
    kalman.x = np.array([[samples[0]], [0.0], [0.0], [0.0]])
    means, covariances, _, _ = kalman.batch_filter(samples)
    result: Array = kalman.rts_smoother(means, covariances)[0][:, :, 0]
    return result


def acting_torque(tau_m: Array, period: float, delay: Array, weights: Array) -> Array:
    """The torque about each sample, averaged as the acceleration there is.

    What is linear and sees no constant and no steady velocity averages the acceleration with a kernel (Peano):

        sum_j c_j x(t + j T) / T² = integral of k(s) a(t + s) ds ,   k(s) = sum_j c_j max(j T - s, 0) / T²

    a straight line between two samples. Its integral over each hold weighs that hold's torque: half a hold and the
    delay are accounted for, and so is what the differentiation smooths away.

    Args:
        tau_m: Torques commanded after each sample, shape (n, 3) [N·m].
        period: They hold for a period [s] ...
        delay: ... that begins so long after the sample at each axis, at most a period, shape (3,) [s].
        weights: c_j, shape (2 h + 1,).

    Returns:
        Shape (n, 3) [N·m]; where the window leaves the record the torque's end values are taken.
    """
    half = len(weights) // 2
    holds = np.arange(-half - 1, half + 1)
    begins = holds[:, None] + delay / period
    shares = _kernel_integral(begins + 1.0, weights) - _kernel_integral(begins, weights)
    rows = np.clip(np.arange(len(tau_m))[:, None] + holds, 0, len(tau_m) - 1)
    average: Array = np.einsum("hj,khj->kj", shares, tau_m[rows])
    return average


def _kernel_integral(s: Array, weights: Array) -> Array:
    """Integral of the kernel up to s [samples], of any shape; 1 beyond the weights."""
    half = len(weights) // 2
    knots = np.arange(-half, half + 1)
    kernel = np.maximum(knots[None, :] - knots[:, None], 0) @ weights
    area = np.concatenate([[0.0], np.cumsum((kernel[1:] + kernel[:-1]) / 2)])
    inside = np.clip(s, -half, half)
    i = np.minimum((inside + half).astype(int), 2 * half - 1)
    u = inside - knots[i]
    integral: Array = area[i] + u * (kernel[i] + u / 2 * (kernel[i + 1] - kernel[i]))
    return integral


def encoder_floor(model: Manipulator, q: Array) -> float:
    """Standard deviation of a sampled coordinate, from the finest step of the joint angles [m].

    Args:
        model: The manipulator.
        q: Joint angles, shape (n, 3) [rad].

    Returns:
        Root mean square over the record of what one count's rounding is at the end-effector; 0.9 um on the rig.
    """
    steps = np.abs(np.diff(q, axis=0))
    count = float(np.min(steps[steps > 0.1 * _FINEST], initial=math.inf))
    S = [model.jacobians(x)[1] for x in positions(model, q[:: max(1, len(q) // 50)])]
    spread = [np.trace(np.linalg.inv(s.T @ s)) / 2 for s in S]
    return (count if math.isfinite(count) else _FINEST) * math.sqrt(float(np.mean(spread)) / 12)
