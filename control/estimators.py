"""Joint rates from joint angles: filters that run inside the loop and allocate nothing there."""

import math
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from torquerig.control.errors import UnknownEstimatorError

NANOSECONDS_PER_SECOND: Final = 1_000_000_000
THESIS_WINDOW: Final = 9
"""Length of the thesis' velocity filter in samples (5.4.2, "a one dimension window filter of a length nine")."""


class Estimator(Protocol):
    """An estimator of joint rates."""

    @property
    def name(self) -> str:
        """Its name in configurations and records."""
        ...

    @property
    def delay(self) -> float:
        """How old the estimate is, in sampling periods, once as many samples came as it uses."""
        ...

    @property
    def noise_gain(self) -> float:
        """Standard deviation of the rate times the period, per standard deviation of white noise on the angles."""
        ...

    def reset(self) -> None:
        """Forget every sample: the machine stands, a run begins."""
        ...

    def update(self, q: NDArray[np.float64], at_ns: int) -> NDArray[np.float64]:
        """Take the next sample and estimate the rates.

        Args:
            q: Joint angles, shape (n,) [rad].
            at_ns: When they were sampled, later than the sample before.

        Returns:
            Joint rates, shape (n,) [rad/s], zero after the first sample. The same buffer every time: it holds until
            the next update.
        """
        ...


class MovingWindow:
    """Mean of the last n backward differences: the thesis' filter.

    The thesis differentiates numerically and passes the velocity through "a one dimension window filter of a length
    nine" (5.4.2): the mean of nine differences, which telescopes to (q_k - q_{k-n}) / (t_k - t_{k-n}). Time is
    taken from the samples, so a skipped cycle does not bend the estimate. Until n differences are there, all there
    are count.

    It is n/2 periods late, and white noise on the angles comes out sqrt(2)/n times as large per period.
    """

    def __init__(self, axes: int, length: int = THESIS_WINDOW) -> None:
        """Reserve room for the window.

        Args:
            axes: Number of joints.
            length: Number n of differences in the window, 1 or more.

        Raises:
            ValueError: If `length` is below 1.
        """
        if length < 1:
            raise ValueError(f"a window of {length} differences: 1 is the least")
        self.length: Final = length
        self._slots: Final = length + 1
        self._angles: Final = np.zeros((self._slots, axes))
        self._times: Final = [0] * self._slots
        self._rate: Final = np.zeros(axes)
        self._taken = 0

    @property
    def name(self) -> str:
        """Its name in configurations and records."""
        return "moving-window"

    @property
    def delay(self) -> float:
        """Delay of the estimate in sampling periods."""
        return self.length / 2

    @property
    def noise_gain(self) -> float:
        """Standard deviation of rate times period, per standard deviation of the angles' white noise."""
        return math.sqrt(2) / self.length

    def reset(self) -> None:
        """Forget every sample."""
        self._taken = 0
        self._rate[:] = 0.0

    def update(self, q: NDArray[np.float64], at_ns: int) -> NDArray[np.float64]:
        """Take the next sample and estimate the rates.

        Args:
            q: Joint angles, shape (axes,) [rad].
            at_ns: When they were sampled.

        Returns:
            Joint rates, shape (axes,) [rad/s]: one buffer, valid until the next update.

        Raises:
            ValueError: If `at_ns` is not later than the sample before.
        """
        taken = self._taken
        newest = taken % self._slots
        if taken:
            previous = self._times[(taken - 1) % self._slots]
            if at_ns <= previous:
                raise ValueError(f"a sample at {at_ns} ns is not later than the one before, at {previous} ns")
            oldest = (taken - min(taken, self.length)) % self._slots
            np.subtract(q, self._angles[oldest], out=self._rate)
            np.multiply(self._rate, NANOSECONDS_PER_SECOND / (at_ns - self._times[oldest]), out=self._rate)
        self._angles[newest] = q
        self._times[newest] = at_ns
        self._taken = taken + 1
        return self._rate


class BackwardDifference(MovingWindow):
    """(q_k - q_{k-1}) / (t_k - t_{k-1}): half a period late, the least delay a difference can have.

    The velocity of the thesis' control loops: the window of nine makes every run oscillate (experiments.md,
    "Controllers").
    """

    def __init__(self, axes: int) -> None:
        """Reserve room for one difference.

        Args:
            axes: Number of joints.
        """
        super().__init__(axes, length=1)

    @property
    def name(self) -> str:
        """Its name in configurations and records."""
        return "backward-difference"


def make_estimator(name: str, axes: int, length: int = THESIS_WINDOW) -> Estimator:
    """The estimator of this name.

    Args:
        name: "backward-difference" or "moving-window".
        axes: Number of joints.
        length: Differences in a moving window.

    Returns:
        A fresh estimator.

    Raises:
        UnknownEstimatorError: If no estimator has this name.
        ValueError: If `length` is below 1.
    """
    match name:
        case "backward-difference":
            return BackwardDifference(axes)
        case "moving-window":
            return MovingWindow(axes, length)
        case _:
            raise UnknownEstimatorError(f"unknown estimator '{name}': choose backward-difference or moving-window")
