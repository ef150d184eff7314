"""Our errors beside the thesis': its published runs, and one number for how far a set of runs is from them."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from torquerig.control.laws import load_laws


class PublishedRun(NamedTuple):
    """One run of the thesis.

    Attributes:
        law: Name of the law.
        motion: Number of the test motion.
        position_rmse_mm: Root mean square of the position error [mm].
        velocity_rmse_m_s: Root mean square of the velocity error [m/s].
    """

    law: str
    motion: int
    position_rmse_mm: float
    velocity_rmse_m_s: float


def published_runs() -> tuple[PublishedRun, ...]:
    """The thesis' runs, as the laws carry them (Tables 6.1 and 6.2).

    Returns:
        Motion by motion, in each the laws in alphabetical order. A law without a published result is left out, and so
        is one whose result is not the thesis'.
    """
    runs = [
        PublishedRun(name, motion, result.position_rmse_mm, result.velocity_rmse_m_s)
        for name, law in load_laws().items()
        for motion, result in law.published.items()
        if result.is_of_thesis
    ]
    return tuple(sorted(runs, key=lambda run: run.motion))


def typical_factor(simulated: Sequence[float], thesis: Sequence[float]) -> float:
    """By what factor simulated numbers typically differ from the thesis', in either direction.

    It is exp(sqrt(mean(ln(simulated / thesis)²))): 1 if all are equal, 2 if each is twice or half as large.

    Args:
        simulated: Our numbers, each in the unit of the thesis' beside it.
        thesis: The thesis' numbers in the same order, at least one.

    Returns:
        The factor, 1 or more.

    Raises:
        ValueError: If there are none, if their counts differ, or if one of them is not positive and finite.
    """
    if not thesis or len(simulated) != len(thesis):
        raise ValueError(f"{len(simulated)} simulated and {len(thesis)} thesis numbers: as many of each, at least one")
    for number in (*simulated, *thesis):
        if not (math.isfinite(number) and number > 0):
            raise ValueError(f"{number} has no ratio to compare: numbers must be positive and finite")
    squares = [math.log(ours / theirs) ** 2 for ours, theirs in zip(simulated, thesis, strict=True)]
    return math.exp(math.sqrt(math.fsum(squares) / len(squares)))
