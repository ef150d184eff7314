"""Timing that bears a busy machine: variants take turns, A B C A B C ..., and are compared within the same turn.

Whatever disturbs the machine for longer than a turn disturbs all variants alike: ratios hold where times do not.
All turns last about the same: on a busy machine a short one ends before the scheduler takes the processor away, and a
long one does not.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median
from typing import Final

from torquerig.garbage import no_collections

NS_PER_US: Final = 1000.0
NS_PER_S: Final = 1e9

Turn = Callable[[int], int]
"""Does its work so many times, and returns how long that took [ns]."""


@dataclass(frozen=True, slots=True)
class Timings:
    """How long each variant took, turn by turn.

    Attributes:
        by_variant: Time of one execution in each turn, by the variant's name [us].
    """

    by_variant: Mapping[str, tuple[float, ...]]

    def median_us(self, name: str) -> float:
        """The median over the turns [us]."""
        return median(self.by_variant[name])

    def best_us(self, name: str) -> float:
        """The best turn, the one that was disturbed least [us]."""
        return min(self.by_variant[name])

    def ratio(self, name: str, to: str) -> float:
        """How many times as long as another variant: the median of the ratios in the same turn."""
        return median(a / b for a, b in zip(self.by_variant[name], self.by_variant[to], strict=True))


def take_turns(variants: Mapping[str, Turn], *, turns: int, turn_s: float) -> Timings:
    """Time variants in turns, after a few shorter turns of each that do not count.

    Args:
        variants: What is timed, by name.
        turns: How many turns each has.
        turn_s: How long a turn lasts, about [s].
    """
    times: dict[str, list[float]] = {name: [] for name in variants}
    with no_collections():
        executions = {name: _executions(turn, round(turn_s * NS_PER_S)) for name, turn in variants.items()}
        for _ in range(turns):
            for name, turn in variants.items():
                times[name].append(turn(executions[name]) / executions[name] / NS_PER_US)
    return Timings({name: tuple(each) for name, each in times.items()})


def _executions(turn: Turn, turn_ns: int) -> int:
    """How many executions make a turn of a length; the first one is not representative, so it is asked twice."""
    turn(1)
    executions = 1
    for _ in range(2):
        executions = max(1, executions * turn_ns // max(turn(executions), 1))
    return executions
