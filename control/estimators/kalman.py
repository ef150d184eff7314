"""The Kalman filter of a joint whose jerk is white noise, with its steady gain."""

from typing import ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.control.estimator import (
    NANOSECONDS_PER_SECOND,
    THESIS_SAMPLING,
    Estimator,
    Parameter,
    Sampling,
)
from torquerig.mechanism.compiled import bind, compiled

Floats = NDArray[np.float64]

SETTLED: Final = 1e-13
"""Relative change of the gain in a step below which it counts as steady."""
MOST_STEPS: Final = 100_000
"""The slowest filter that the parameters' ranges allow settles in a tenth of these."""


class Gain(NamedTuple):
    """A steady gain without units, for a state of angle, rate times period and acceleration times period squared."""

    angle: float
    rate: float
    acceleration: float


class Kalman(Estimator):
    """Predict angle, rate and acceleration over the interval, then correct them by the residual with a steady gain.

    The model is a constant acceleration disturbed by white jerk of the spectral density `jerk_noise`; the measurement
    noise is the encoder's, resolution / sqrt(12). Both enter the gain by their ratio alone, the tracking index
    jerk_noise period⁵ / (resolution² / 12): at 250 Hz the thesis' encoder is so fine that the angles are nearly
    believed, at 4 kHz they are smoothed.

    filterpy finds the gain when the estimator is made; in the loop a few multiplications remain. At the nominal period
    the estimates are those of filterpy's KalmanFilter with that gain. Over another interval the prediction is exact,
    and the corrections of rate and acceleration are divided by that interval and its square: a joint that turns
    evenly, or accelerates evenly, is followed without an error whatever the intervals are.

    It has no delay at low frequency.
    """

    name: ClassVar[str] = "kalman"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("jerk_noise", "rad²/s⁵", 1.4e6, 1.0, 1e12, "spectral density of the joints' jerk"),
    )

    def __init__(self, axes: int, sampling: Sampling = THESIS_SAMPLING, **given: float) -> None:
        """Find the steady gain for `jerk_noise` [rad²/s⁵], and reserve room for the state."""
        super().__init__(axes, sampling, **given)
        index = self.values["jerk_noise"] * sampling.period**5 / sampling.quantisation**2
        self.gain: Final = steady_gain(index)
        self._state: Final = np.zeros((2, axes))
        self._correct: Final = bind(_correct, self.q, self._state, self.rate, scalars=("float64",) * 4)

    @property
    def delay(self) -> float:
        """Delay of the estimate in sampling periods, at low frequency."""
        return 0.0

    @property
    def noise_gain(self) -> float:
        """Standard deviation of rate times period, per standard deviation of the angles' white noise."""
        from scipy.linalg import solve_discrete_lyapunov  # noqa: PLC0415  (scipy.linalg takes a fifth of a second)

        K = np.array([self.gain]).T
        step = (np.eye(3) - K @ np.eye(1, 3)) @ TRANSITION
        return float(np.sqrt(solve_discrete_lyapunov(step, K @ K.T)[1, 1]))

    def _begin(self, at_ns: int) -> None:  # noqa: ARG002
        """The first sample: rest where it is."""
        self._state[0] = self.q
        self._state[1] = 0.0

    def _advance(self, at_ns: int, interval_ns: int) -> None:  # noqa: ARG002
        """Predict over the interval, and correct."""
        self._correct(interval_ns / NANOSECONDS_PER_SECOND, *self.gain)


TRANSITION: Final = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
"""The state a period later, without units."""


def steady_gain(tracking_index: float) -> Gain:
    """The gain that filterpy's filter settles at, without units.

    Args:
        tracking_index: Spectral density of the white jerk times the period to the fifth, over the variance of the
            measured angle.

    Returns:
        What a residual adds to the angle, to the rate times the period, to the acceleration times the period squared.

    Raises:
        ValueError: If the filter does not settle.
    """
    from filterpy.common import Q_continuous_white_noise  # noqa: PLC0415  (it takes two seconds: all of filterpy)
    from filterpy.kalman import KalmanFilter  # noqa: PLC0415

    kalman = KalmanFilter(dim_x=3, dim_z=1)
    kalman.F = TRANSITION
    kalman.H = np.eye(1, 3)
    kalman.Q = Q_continuous_white_noise(3, dt=1.0, spectral_density=tracking_index)
    kalman.R = np.eye(1)
    kalman.P = np.eye(3) * max(1.0, tracking_index)
    for _ in range(MOST_STEPS):
        before = kalman.K
        kalman.predict()
        kalman.update(0.0)
        if np.allclose(kalman.K, before, rtol=SETTLED, atol=0.0):
            return Gain(*kalman.K[:, 0].tolist())
    raise ValueError(f"a Kalman filter of the tracking index {tracking_index:g} does not settle")


@compiled
def _correct(  # noqa: PLR0917  (a kernel takes plain numbers)
    q: Floats, state: Floats, rate: Floats, interval: float, g: float, h: float, k: float
) -> None:
    """One step of prediction and correction; the state holds angles and accelerations."""
    for i in range(len(q)):
        predicted = state[0, i] + interval * (rate[i] + 0.5 * interval * state[1, i])
        residual = q[i] - predicted
        rate[i] += interval * state[1, i] + h * residual / interval
        state[0, i] = predicted + g * residual
        state[1, i] += k * residual / (interval * interval)
