"""The fit as a least-squares problem: parameters as shares of their ranges, residuals as logarithms of ratios."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.comparison import PublishedRun
from torquerig.plant_fit.experiments import Errors, thesis_errors
from torquerig.plant_fit.parameters import PlantParameter, changed, from_unit
from torquerig.plant_fit.workers import Task, Workers
from torquerig.schema_machines import Plant

Array = NDArray[np.float64]

NUMBERS_A_RUN: Final = 2
"""Position and velocity error."""


@dataclass(slots=True)
class Problem:
    """Which parameters are free, what they are to explain, and the best that was met so far.

    A point is an array of shares, shape (k,): 0 at a parameter's lower bound, 1 at its upper.

    Attributes:
        parameters: The free parameters.
        plant: What the others are.
        runs: The thesis' runs.
        target: The errors to explain; the thesis' own, unless somebody tests the fit.
        workers: Who computes.
        told: Called with the number of plants tried so far.
        tried: How many plants were tried.
        best: The best point on all runs so far, and its residuals.
    """

    parameters: tuple[PlantParameter, ...]
    plant: Plant
    runs: tuple[PublishedRun, ...]
    workers: Workers
    target: Errors
    told: Callable[[int], None] = lambda _tried: None
    tried: int = 0
    best: tuple[Array, Array] | None = field(default=None)

    def residuals(self, points: Sequence[Array], which: Sequence[int]) -> Array:
        """ln(simulated / thesis) of some runs at several points.

        Args:
            points: The points.
            which: Places of the runs.

        Returns:
            One row a point, shape (points, 2 x runs): each run's position, then its velocity.
        """
        tasks = [Task(self.plant_at(point), tuple(which)) for point in points]
        rows = np.array([np.log(errors / self.target[list(which)]).ravel() for errors in self.workers.errors(tasks)])
        self.tried += len(points)
        if len(which) == len(self.runs):
            for point, row in zip(points, rows, strict=True):
                if self.best is None or row @ row < self.best[1] @ self.best[1]:
                    self.best = point.copy(), row
        self.told(self.tried)
        return rows

    def errors_over_the_wire(self, point: Array) -> Errors:
        """The errors of all runs at a point through the whole chain, shape (runs, 2)."""
        plant = self.plant_at(point)
        rows = self.workers.errors([Task(plant, (place,), wired=True) for place in range(len(self.runs))])
        return np.concatenate(rows)

    def plant_at(self, point: Array) -> Plant:
        """The plant of a point."""
        return changed(self.plant, self.parameters, from_unit(self.parameters, point).tolist())

    def all_runs(self) -> tuple[int, ...]:
        """Places of all runs."""
        return tuple(range(len(self.runs)))

    def runs_of(self, motion: int) -> tuple[int, ...]:
        """Places of one motion's runs."""
        return tuple(place for place, run in enumerate(self.runs) if run.motion == motion)


def factor_of(residuals: Array) -> float:
    """The typical factor that residuals stand for."""
    return math.exp(math.sqrt(float(np.mean(residuals**2))))


def columns(which: Sequence[int]) -> list[int]:
    """Where the residuals of some runs stand among those of all."""
    return [NUMBERS_A_RUN * place + number for place in which for number in range(NUMBERS_A_RUN)]


def thesis_target(runs: Sequence[PublishedRun]) -> Errors:
    """The thesis' errors as a target."""
    return thesis_errors(runs)
