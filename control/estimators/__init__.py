"""Joint rates from joint angles, one file an estimator: whatever `Estimator` a module of this package defines is found.

Each is a filter that runs inside the loop and allocates nothing there.
"""

from typing import Final

import numpy as np

from torquerig.control.errors import EstimatorFileError, UnknownEstimatorError
from torquerig.control.estimator import NANOSECONDS_PER_SECOND, THESIS_SAMPLING, Estimator, Parameter, Sampling
from torquerig.control.estimators.backward_difference import BackwardDifference
from torquerig.control.estimators.moving_window import THESIS_WINDOW, MovingWindow
from torquerig.control.scan import Scan

__all__ = [
    "NANOSECONDS_PER_SECOND",
    "THESIS_SAMPLING",
    "THESIS_WINDOW",
    "BackwardDifference",
    "Estimator",
    "MovingWindow",
    "Parameter",
    "Sampling",
    "estimator_named",
    "load_estimators",
    "make_estimator",
]


def load_estimators() -> dict[str, type[Estimator]]:
    """Find the estimators by scanning this package.

    Returns:
        Estimator classes by name, in alphabetical order.

    Raises:
        EstimatorFileError: If a file cannot be imported, an estimator has no name, or two have the same.
    """
    return _SCAN.of(__name__, __path__)


def estimator_named(name: str) -> type[Estimator]:
    """The estimator of this name.

    Args:
        name: As in configurations, "moving-window".

    Returns:
        Its class.

    Raises:
        UnknownEstimatorError: If no file of this package defines it.
        EstimatorFileError: If a file of this package defines an estimator that cannot be used.
    """
    estimators = load_estimators()
    if name not in estimators:
        raise UnknownEstimatorError(f"unknown estimator '{name}': choose {', '.join(estimators)}")
    return estimators[name]


def make_estimator(name: str, axes: int, sampling: Sampling = THESIS_SAMPLING, **parameters: float) -> Estimator:
    """A fresh estimator of this name, that has nothing left to compile or load: fit for a loop with deadlines.

    Args:
        name: As in configurations, "moving-window".
        axes: Number of joints.
        sampling: The nominal period and the angles' resolution.
        parameters: Its parameters by name; one that is missing has its default.

    Returns:
        The estimator.

    Raises:
        UnknownEstimatorError: If no estimator has this name.
        ValueError: If there is no such parameter, or it cannot have that value.
    """
    estimator = estimator_named(name)(axes, sampling, **parameters)
    for at_ns in (0, sampling.period_ns):
        estimator.update(np.zeros(axes), at_ns)
    estimator.reset()
    return estimator


_SCAN: Final[Scan[Estimator]] = Scan(Estimator, "estimator", EstimatorFileError)
