"""Joint rates as they were, from all samples, past and future: for judging an estimator, never for a loop."""

import numpy as np
from numpy.typing import NDArray

from torquerig.control.estimator import Sampling

Floats = NDArray[np.float64]


def smoothed_rates(at_ns: NDArray[np.int64], q: Floats, sampling: Sampling, jerk_noise: float) -> Floats:
    """Joint rates without delay, by Rauch, Tung and Striebel's smoother (filterpy's).

    The model is that of the Kalman filter among the estimators: a constant acceleration disturbed by white jerk,
    measured with the encoder's resolution / sqrt(12). Samples may come at any instants.

    Args:
        at_ns: When the samples were taken, increasing, shape (n,).
        q: Joint angles, shape (n, axes) [rad].
        sampling: The nominal period and the angles' resolution.
        jerk_noise: Spectral density of the white jerk [rad²/s⁵].

    Returns:
        Joint rates at the same instants, shape (n, axes) [rad/s].
    """
    from filterpy.common import Q_continuous_white_noise  # noqa: PLC0415  (it takes two seconds: all of filterpy)

    # without units, angles in standard deviations and time in periods: matrices of well-behaved numbers
    steps = np.diff(at_ns, prepend=at_ns[0] - sampling.period_ns) / sampling.period_ns
    index = jerk_noise * sampling.period**5 / sampling.quantisation**2
    transitions = [np.array([[1.0, dt, dt * dt / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]]) for dt in steps]
    noises = [Q_continuous_white_noise(3, dt=dt, spectral_density=index) for dt in steps]
    scaled = (q - q[0]) / sampling.quantisation
    rates = np.column_stack([_rates(column, transitions, noises) for column in scaled.T])
    return rates * (sampling.quantisation / sampling.period)


def _rates(angles: Floats, transitions: list[Floats], noises: list[Floats]) -> Floats:
    """The rates of one joint without units, shape (n,)."""
    from filterpy.kalman import KalmanFilter  # noqa: PLC0415

    kalman = KalmanFilter(dim_x=3, dim_z=1)
    kalman.H = np.eye(1, 3)
    kalman.R = np.eye(1)
    kalman.P = np.diag([1.0, noises[0][1, 1], noises[0][2, 2]])
    means, covariances, _, _ = kalman.batch_filter(angles, Fs=transitions, Qs=noises)
    states: Floats = kalman.rts_smoother(means, covariances, Fs=transitions, Qs=noises)[0]
    return states[:, 1, 0]
