"""The search for a good excitation, and the two that it found.

Condition number alone likes motions of which hardly a sample is fast enough to be kept. So the cost is

    ln kappa - 1/2 ln sigma_min        of the regressor, rows weighted by how fast the slowest joint is

kappa its condition number, sigma_min its least singular value by the root of its rows: the first asks that the unknowns
can be told apart, the second that what tells them apart is large. SLSQP minimises it inside the envelope.
"""

import math
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from scipy.linalg import block_diag, null_space
from scipy.optimize import minimize

from torquerig.calibration.excitation import SCALE, SLOW, Array, Envelope, FourierMotion, Pair, reckoned_torques, worth
from torquerig.calibration.regressor import equation
from torquerig.mechanism import HOME, Manipulator, MechanismError

_GRID: Final = 72
"""Instants of a period at which a candidate is looked at: 14 to a period of the fifth harmonic."""
_SHARPNESS: Final = 24
"""Order of the norm that stands for the greatest value, so that it has a gradient; above it by _GRID^(1/24) at most."""
_UNIT: Final = 0.01
"""Size of a free number that the optimiser sees as 1 [m]."""
_STEP: Final = 1e-5
"""Of the gradient's differences, in those units."""
_NEVER: Final = 20.0
"""Cost where the machine cannot go."""
_CONSTRAINTS: Final = 4


@dataclass(frozen=True, slots=True)
class Search:
    """What is looked for.

    Attributes:
        model: The manipulator as far as it is known.
        envelope: What the motion must keep to.
        start: Where the motion starts and ends, inside the envelope, (x, y) [m].
        period: Of the fundamental [s].
        periods: How many.
        harmonics: How many of 1 / period, 2 or more.
        window: Samples of the fit's differentiation.
    """

    model: Manipulator
    envelope: Envelope
    start: Pair = HOME
    period: float = 1.75
    periods: int = 2
    harmonics: int = 5
    window: int = 9

    def motion(self, free: Array) -> FourierMotion:
        """The motion of so many free numbers: 4 (harmonics - 1), in units of 10 mm."""
        k = np.arange(1.0, self.harmonics + 1)
        # the free numbers are amplitudes of velocity, so that harmonics weigh alike: A_k = a_k / k
        at_rest, unaccelerated = null_space(np.ones((1, len(k)))), null_space(k[None])
        basis = _UNIT * block_diag(at_rest, unaccelerated) / np.concatenate([k, k])[:, None]
        x, y = (basis @ part for part in np.split(free, 2))
        (ax, bx), (ay, by) = (np.split(part, 2) for part in (x, y))
        sines, cosines = (_numbers(ax), _numbers(ay)), (_numbers(bx), _numbers(by))
        return FourierMotion(self.start, self.period, self.periods, sines, cosines)

    def rate(self, free: Array) -> Array:
        """Cost, and what is left of the bounds on x, y, joint speed and torque, as shares: shape (5,)."""
        motion, envelope = self.motion(free), self.envelope
        times = self.period / _GRID * np.arange(_GRID, dtype=np.float64)
        movement = motion.sampled(times)
        try:
            both = equation(self.model, movement)
            torque = reckoned_torques(self.model, movement.position, both.Y, both.force)
        except MechanismError:
            return np.array([_NEVER, *(-1.0,) * _CONSTRAINTS])
        squared = both.rates**2
        weight = np.prod(squared / (squared + SLOW**2), axis=1)
        rows = (weight[:, None, None] * both.Y).reshape(-1, len(SCALE)) * np.array(SCALE)
        values = np.linalg.svd(rows, compute_uv=False) / math.sqrt(len(rows))
        return np.array(
            [
                math.log(values[0] / values[-1]) - 0.5 * math.log(values[-1]),
                *(_room(part, bound) for part, bound in zip(movement.position.T, envelope[:2], strict=True)),
                1.0 - _greatest(both.rates) / envelope.joint_speed,
                1.0 - _greatest(torque) / envelope.torque,
            ]
        )


class Found(NamedTuple):
    """What a search found.

    Attributes:
        motion: The best motion.
        cost: Its cost.
    """

    motion: FourierMotion
    cost: float


def search(wanted: Search, *, seed: int, starts: int = 6, steps: int = 60) -> Found:
    """The best motion found from some random ones; the same seed gives the same motion.

    Args:
        wanted: What is looked for.
        seed: Of the random starts.
        starts: How many; each takes one to two seconds.
        steps: Of the optimiser from each.

    Returns:
        The best motion that keeps to the envelope.

    Raises:
        ValueError: None does.
    """
    rng = np.random.default_rng(seed)
    best: Found | None = None
    for _ in range(starts):
        free = _descend(wanted, rng.normal(size=4 * (wanted.harmonics - 1)), steps)
        found = Found(wanted.motion(free), float(wanted.rate(free)[0]))
        if found.cost < _NEVER and (best is None or found.cost < best.cost) and _fits(wanted, found.motion):
            best = found
    if best is None:
        raise ValueError(
            f"no excitation within {wanted.envelope} from {starts} starts of seed {seed}: widen the limits"
        )
    return best


def _fits(wanted: Search, motion: FourierMotion) -> bool:
    try:
        return not worth(wanted.model, motion, window=wanted.window).objections(wanted.envelope)
    except MechanismError:
        return False


def _descend(wanted: Search, first: Array, steps: int) -> Array:
    """The free numbers after SLSQP's steps."""
    seen: dict[bytes, Array] = {}
    slopes: dict[bytes, Array] = {}

    def value(free: Array) -> Array:
        key = free.tobytes()
        if key not in seen:
            seen.clear()
            seen[key] = wanted.rate(free)
        return seen[key]

    def slope(free: Array) -> Array:
        key = free.tobytes()
        if key not in slopes:
            here = value(free)
            steps_of_one = free + _STEP * np.eye(len(free))
            slopes.clear()
            slopes[key] = np.column_stack([(wanted.rate(moved) - here) / _STEP for moved in steps_of_one])
        return slopes[key]

    def cost(free: Array) -> float:
        return float(value(free)[0])

    def steepness(free: Array) -> Array:
        row: Array = slope(free)[0]
        return row

    inside: Any = {"type": "ineq", "fun": lambda free: value(free)[1:], "jac": lambda free: slope(free)[1:]}
    result = minimize(cost, first, jac=steepness, method="SLSQP", constraints=[inside], options={"maxiter": steps})
    best: Array = result.x
    return best


def _room(values: Array, bound: Pair) -> float:
    """What is left between values and the nearer bound, as a share of half the range."""
    middle, half = (bound[0] + bound[1]) / 2, (bound[1] - bound[0]) / 2
    return 1.0 - _greatest(values - middle) / half


def _greatest(values: Array) -> float:
    """A norm that is a little above the greatest size."""
    size = np.abs(values)
    top = float(size.max())
    return top * float(np.sum((size / top) ** _SHARPNESS)) ** (1 / _SHARPNESS) if top > 0.0 else 0.0


def _numbers(values: Array) -> tuple[float, ...]:
    """Coefficients to the nanometre: what is shipped and what is searched are the same."""
    return tuple(float(round(value, 9)) for value in values)
