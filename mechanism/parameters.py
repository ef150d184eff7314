"""Links and the constants derived from them, checked and packed for the kernels."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, isfinite, pi
from typing import Final

import numpy as np
import numpy.typing as npt

from torquerig.mechanism import kernels

LEGS: Final = 3
_FLOAT: Final = np.dtype(np.float64)
Point = tuple[float, float]
Triple = tuple[float, float, float]


def require_positive(name: str, value: float) -> None:
    """Raises ValueError, with name and value, unless the value is finite and above zero."""
    if not (isfinite(value) and value > 0.0):
        raise ValueError(f"{name} is {value}: must be finite and above 0")


def require_not_negative(name: str, value: float) -> None:
    """Raises ValueError, with name and value, unless the value is finite and not below zero."""
    if not (isfinite(value) and value >= 0.0):
        raise ValueError(f"{name} is {value}: must be finite and not below 0")


@dataclass(frozen=True, slots=True)
class Link:
    """A rigid link.

    Attributes:
        mass: [kg].
        centre: Distance of the centre of mass from the link's proximal joint [m].
        inertia: About the centre of mass [kg·m²].
    """

    mass: float
    centre: float
    inertia: float

    def __post_init__(self) -> None:
        for name in ("mass", "centre", "inertia"):
            require_positive(name, getattr(self, name))


Links = tuple[Link, Link, Link]

THESIS_PROXIMAL: Final[Links] = (Link(0.55, 0.045, 6.214e-4),) * 3
"""Table 5.1, links 11, 21, 31."""
THESIS_DISTAL: Final[Links] = (
    Link(0.504, 0.0508, 3.08e-4),
    Link(0.376, 0.0512, 3.065e-4),
    Link(0.125, 0.035, 1.001e-4),
)
"""Table 5.1, links 12, 22, 32."""


def inertia_constants(proximal: Links, distal: Links, length: float) -> tuple[Triple, Triple, Triple]:
    """alpha, beta, gamma of the three legs, links alone [kg·m²] (5.8, Table 5.2)."""
    pairs = list(zip(proximal, distal, strict=True))
    alpha = [a.inertia + b.inertia + a.mass * a.centre**2 + b.mass * (length**2 + b.centre**2) for a, b in pairs]
    beta = [b.mass * b.centre * length for _, b in pairs]
    gamma = [b.inertia + b.mass * b.centre**2 for _, b in pairs]
    return _triple(alpha), _triple(beta), _triple(gamma)


def facings(bases: Sequence[Point]) -> Triple:
    """Each base joint's direction towards the middle of all, in [0, 2 pi) [rad]: theta is continuous about it."""
    middle = (sum(x for x, _ in bases) / LEGS, sum(y for _, y in bases) / LEGS)
    angles = [atan2(middle[1] - y, middle[0] - x) for x, y in bases]
    return _triple([angle + 2.0 * pi if angle < -kernels.NEAR_ZERO else angle for angle in angles])


def pack(values: dict[int, float | Sequence[float]]) -> npt.NDArray[np.float64]:
    """The constants in the kernels' layout, shape (kernels.PACKED,): offset -> one or more values."""
    packed = np.zeros(kernels.PACKED)
    for offset, value in values.items():
        items = np.atleast_1d(np.asarray(value, dtype=np.float64))
        packed[offset : offset + items.size] = items
    return packed


def vector(value: npt.ArrayLike, size: int) -> npt.NDArray[np.float64]:
    """The value as the contiguous, writable float array that kernels are compiled for; a copy unless it is one.

    Raises:
        ValueError: The shape is not (size,).
    """
    if type(value) is np.ndarray and value.dtype is _FLOAT and value.shape == (size,) and value.flags.carray:
        return value
    copy = np.array(value, dtype=np.float64)
    if copy.shape != (size,):
        raise ValueError(f"shape is {copy.shape}: must be ({size},)")
    return copy


def signs(branches: Sequence[int]) -> list[float]:
    """The three elbow signs as floats; ValueError unless each is +1 or -1."""
    if len(branches) != LEGS or any(sign not in {1, -1} for sign in branches):
        raise ValueError(f"branches are {tuple(branches)}: must be three of +1 or -1")
    return [float(sign) for sign in branches]


def _triple(values: Sequence[float]) -> Triple:
    a, b, c = values
    return (a, b, c)
