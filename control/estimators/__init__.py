"""Joint rates from joint angles, one file an estimator: whatever `Estimator` a module of this package defines is found.

Each is a filter that runs inside the loop and allocates nothing there.
"""

import importlib
import inspect
import pkgutil
from types import ModuleType
from typing import Any, TypeGuard

import numpy as np

from torquerig.control.errors import UnknownEstimatorError
from torquerig.control.estimator import NANOSECONDS_PER_SECOND, THESIS_SAMPLING, Estimator, Parameter, Sampling
from torquerig.control.estimators.backward_difference import BackwardDifference
from torquerig.control.estimators.moving_window import THESIS_WINDOW, MovingWindow

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
        ValueError: If two estimators have the same name.
    """
    found: dict[str, type[Estimator]] = {}
    for entry in pkgutil.iter_modules(__path__):
        module = importlib.import_module(f"{__name__}.{entry.name}")
        for estimator in vars(module).values():
            if not _is_estimator_of(module, estimator):
                continue
            name = estimator.name
            if name in found:
                twins = f"{found[name].__module__} and {estimator.__module__}"
                raise ValueError(f"two estimators are named '{name}': {twins}")
            found[name] = estimator
    return dict(sorted(found.items()))


def estimator_named(name: str) -> type[Estimator]:
    """The estimator of this name.

    Args:
        name: As in configurations, "moving-window".

    Returns:
        Its class.

    Raises:
        UnknownEstimatorError: If no file of this package defines it.
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


def _is_estimator_of(module: ModuleType, thing: Any) -> TypeGuard[type[Estimator]]:  # noqa: ANN401  (as in the laws)
    """Whether a thing is an estimator that this module defines, not one that it imports or an abstract ancestor."""
    if not (inspect.isclass(thing) and issubclass(thing, Estimator)):
        return False
    return thing.__module__ == module.__name__ and not inspect.isabstract(thing)
