"""What a finding of the thesis is, before and after it is judged."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from torquerig.json_numbers import finite_number


@dataclass(frozen=True, slots=True)
class Finding:
    """A finding of the thesis on the runs of one plant.

    Attributes:
        key: Its name.
        claim: What the thesis found.
        motion: The motion that it is judged on; None for both.
        measure: What the number is.
        number: The number; None if a run that it takes was stopped.
        unit: Its unit, "1" for a ratio.
        bound: Where the number must lie for the verdict, in words.
        thesis: The thesis' own number; None where it gives none.
        reproduced: Whether the number lies there; None without a number.
        of: The law that the number is of; empty where it is of several.
        of_model: Whether the number is the model's, along the reference: the same on every plant, so that no run can
            confirm or refute it, and it does not count among the verdicts.
        note: What explains the number; empty for nothing.
    """

    key: str
    claim: str
    motion: int | None
    measure: str
    number: float | None
    unit: str
    bound: str
    thesis: float | None
    reproduced: bool | None
    of: str = ""
    of_model: bool = False
    note: str = ""

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        if self.reproduced is None:
            return "not judged"
        if self.of_model:
            return "model" if self.reproduced else "not in the model"
        return "reproduced" if self.reproduced else "not reproduced"

    def as_json(self) -> dict[str, Any]:
        """The finding as JSON holds it."""
        return {
            "finding": self.key,
            "claim": self.claim,
            "motion": self.motion,
            "measure": self.measure,
            "number": self.number,
            "unit": self.unit,
            "bound": self.bound,
            "thesis": self.thesis,
            "law": self.of or None,
            "verdict": self.verdict,
            "note": self.note or None,
        }


class Claim(NamedTuple):
    """A finding before it is judged: `Finding` without its number; `holds` is its bound as a function."""

    key: str
    claim: str
    motion: int | None
    measure: str
    unit: str
    bound: str
    holds: Callable[[float], bool]
    thesis: float | None = None
    of_model: bool = False

    def judged(self, number: float | None, of: str = "", note: str = "") -> Finding:
        """The finding with its number and verdict."""
        number = finite_number(number)
        reproduced = None if number is None else self.holds(number)
        return Finding(
            self.key,
            self.claim,
            self.motion,
            self.measure,
            number,
            self.unit,
            self.bound,
            self.thesis,
            reproduced,
            of,
            self.of_model,
            note,
        )
