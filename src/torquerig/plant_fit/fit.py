"""A whole fit: screening, descents, look around, cross-validation, and the same over the wire."""

from dataclasses import dataclass, field
from typing import Final, NamedTuple, Protocol

import numpy as np

from torquerig.control.comparison import typical_factor
from torquerig.plant_fit.experiments import Errors
from torquerig.plant_fit.flatness import Flatness, flatness
from torquerig.plant_fit.parameters import from_unit, to_unit
from torquerig.plant_fit.problem import Array, Problem, factor_of
from torquerig.plant_fit.search import Effort, Optimum, Screening, descend, optima, screen

MOTIONS: Final = (1, 2)


class Watcher(Protocol):
    """Who is told what a fit is doing."""

    def phase(self, words: str) -> None:
        """Something new begins."""
        ...

    def prepare(self, words: str, cycles: int) -> None:
        """Something begins that takes so many steps."""
        ...

    def cycles_done(self, done: int) -> None:
        """So many steps are done."""
        ...


class CrossValidation(NamedTuple):
    """A fit to one motion's runs, judged on the other's.

    Attributes:
        fitted: The motion that was fitted.
        judged: The other one.
        values: The parameters found, each in its unit.
        fitted_factor: The typical factor on the fitted motion's runs.
        judged_factor: The typical factor on the other's.
    """

    fitted: int
    judged: int
    values: Array
    fitted_factor: float
    judged_factor: float


@dataclass(slots=True)
class PlantFit:
    """What a fit has found so far; what it did not come to is None or empty.

    Attributes:
        problem: What was asked.
        start_factor: The typical factor of the plant that the fit began with.
        optima: Where the descents ended, the best first.
        found: The best of all points met when the descents were done.
        flatness: What surrounds the best.
        validations: Fits to one motion, judged on the other.
        wired: Errors of the best through the whole chain, shape (runs, 2).
    """

    problem: Problem
    start_factor: float | None = None
    optima: list[Optimum] = field(default_factory=list)
    found: Optimum | None = None
    flatness: Flatness | None = None
    validations: list[CrossValidation] = field(default_factory=list)
    wired: Errors | None = None

    @property
    def best(self) -> Optimum | None:
        """What was found, or the best so far when the fit was stopped; None when nothing was tried."""
        if self.found is not None:
            return self.found
        return None if self.problem.best is None else Optimum(*self.problem.best)

    @property
    def wired_factor(self) -> float | None:
        """The typical factor through the whole chain; None where it is not known or a run did not end."""
        if self.wired is None or not np.isfinite(self.wired).all():
            return None
        return typical_factor(self.wired.ravel().tolist(), self.problem.target.ravel().tolist())


def carry_out(fit: PlantFit, effort: Effort, seed: int, watcher: Watcher) -> None:
    """Fit; what is found is there in `fit` as soon as it is, so that a stop loses nothing.

    Args:
        fit: Where the findings go.
        effort: How much to try.
        seed: Of the screening.
        watcher: Who is told.
    """
    problem = fit.problem
    everything = problem.all_runs()
    watcher.prepare("screening and descents", effort.plants(len(problem.parameters)))
    problem.told = watcher.cycles_done
    screening = screen(problem, effort, seed)
    fit.start_factor = factor_of(screening.residuals[-1])
    fit.optima = optima(problem, screening, everything, effort)
    problem.told = _nobody
    for fitted, judged in (MOTIONS, MOTIONS[::-1]):
        watcher.phase(f"cross-validation: fitting motion {fitted}")
        fit.validations.append(_cross_validate(problem, screening, effort, (fitted, judged)))
    watcher.phase("descents from where the cross-validation ended")
    for each in fit.validations:  # half of the numbers may lead into a valley that all of them had hidden
        start = to_unit(problem.parameters, each.values.tolist())
        fit.optima.append(descend(problem, start, everything, effort))
    fit.optima.sort(key=lambda optimum: optimum.factor)
    fit.found = found = fit.best or fit.optima[0]
    watcher.phase("looking around the optimum")
    fit.flatness = flatness(problem, found)
    watcher.phase("the same runs over the wire")
    fit.wired = problem.errors_over_the_wire(found.point)


def _cross_validate(
    problem: Problem, screening: Screening, effort: Effort, motions: tuple[int, int]
) -> CrossValidation:
    """Fit one motion's runs from the screening's best points for them, and judge by the other's."""
    fitted, judged = motions
    found = optima(problem, screening, problem.runs_of(fitted), effort)[0]
    judgement = problem.residuals([found.point], problem.runs_of(judged))[0]
    return CrossValidation(
        fitted, judged, from_unit(problem.parameters, found.point), found.factor, factor_of(judgement)
    )


def _nobody(_tried: int) -> None:
    """Tell nobody."""
