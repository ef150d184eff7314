"""Dry friction of the active joints, as parameters."""

from dataclasses import dataclass
from math import isfinite
from typing import Self

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Friction:
    """Dry friction of the three active joints, on the joint side of the gear; viscous friction is the manipulator's.

    Attributes:
        coulomb: While a joint moves, against its motion [N·m].
        breakaway: The most it holds while the joint is at rest, never below `coulomb` [N·m].

    Raises:
        ValueError: A value is negative or not finite, or a breakaway lies below its Coulomb friction.
    """

    coulomb: Triple
    breakaway: Triple

    def __post_init__(self) -> None:
        for joint, (moving, resting) in enumerate(zip(self.coulomb, self.breakaway, strict=True), start=1):
            if not (isfinite(moving) and moving >= 0.0):
                raise ValueError(f"coulomb of joint {joint} is {moving} N·m: must be finite and not below 0")
            if not (isfinite(resting) and resting >= moving):
                raise ValueError(
                    f"breakaway of joint {joint} is {resting} N·m: must be finite and not below coulomb, {moving} N·m"
                )

    @classmethod
    def none(cls) -> Self:
        """No dry friction at all."""
        return cls((0.0,) * 3, (0.0,) * 3)

    @classmethod
    def uniform(cls, coulomb: float, breakaway: float | None = None) -> Self:
        """The same at all three joints; without `breakaway` a joint at rest holds no more than a moving one [N·m]."""
        return cls((coulomb,) * 3, (coulomb if breakaway is None else breakaway,) * 3)
