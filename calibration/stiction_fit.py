"""From pushes that end in motion to the dry friction of each joint at rest.

No joint of the mechanism moves alone: two freedoms, three joints. While joint k stands still, the end-effector can only
go along v_k, across S_k, and turns joints i and j at the rates a = S v_k. Motors i and j push with one torque T, each
in the sense of its own rate, motor k is off. Friction of the joints holds a load F if some f within it has S'f = F;
at the limit the work of the push along v_k is that of both joints' friction:

    T (|a_i| + |a_j|) = F_i |a_i| + F_j |a_j|            F at the motor: joint friction over the gear

Three pairs in two senses are six equations for the friction of three joints in two senses. Friction that differs
between the senses shifts the set of loads that are held, by S'd: what of d lies in the null space of S' shifts nothing,
cannot be measured by any push, and is taken as zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from torquerig.calibration.procedure import CONFIDENCE, Estimate

Vector = NDArray[np.float64]

JOINTS: Final = 3
EXPONENTS: Final = (2.0, 2.25, 2.5, 2.75, 3.0)
"""How motion begins under a ramp of torque: with t³ against inertia, t² against viscous friction or after a drop."""
_LEAST_COUNTS: Final = 1.5  # one count may be the encoder's flicker
_LEAST_POINTS: Final = 3


class Push(NamedTuple):
    """One ramp that ended in motion.

    Attributes:
        held: Which joint is meant to stand still, from 0.
        sense: +1 or -1, along v_k or against it.
        rates: a, the joints' rates along v_k, shape (3,); that of the held joint is 0.
        torque: T at which motion began [N·m at the motor].
    """

    held: int
    sense: int
    rates: Vector
    torque: float


@dataclass(frozen=True, slots=True)
class Stiction:
    """Dry friction at rest.

    Attributes:
        friction: Of each joint in the positive and the negative sense, shape (3, 2) [N·m at the motor].
        half_width: Half of each interval of confidence, shape (3, 2) [N·m at the motor].
        spread: Standard deviation of one push about its kind's mean [N·m at the motor].
        unseen: Direction of the senses' differences that no push can show, shape (3,): the null space of S'.
    """

    friction: Vector
    half_width: Vector
    spread: float
    unseen: Vector

    def estimates(self) -> tuple[Estimate, ...]:
        """A row a joint and sense."""
        return tuple(
            Estimate(f"joint {joint + 1}, {('positive', 'negative')[side]}", value, value - half, value + half, "N·m")
            for joint, side in product(range(JOINTS), range(2))
            for value, half in [(float(self.friction[joint, side]), float(self.half_width[joint, side]))]
        )


def along(S: Vector, held: int) -> Vector:
    """The joints' rates when the end-effector moves at unit speed with one joint at rest.

    Args:
        S: Joint rates per end-effector velocity, shape (3, 2) [1/m].
        held: The joint at rest, from 0.

    Returns:
        S v_k, shape (3,) [rad/m]; exactly 0 for the joint at rest.
    """
    x, y = S[held] / np.linalg.norm(S[held])
    rates: Vector = S @ np.array([-y, x])
    rates[held] = 0.0
    return rates


def onset(t: Vector, moved: Vector) -> float:
    """When motion began, by the shape of its beginning: moved = A (t - t0)^p with the p that fits best.

    Args:
        t: Times of the samples, shape (m,) [s].
        moved: How far the joint that moved most had got, shape (m,) [counts].

    Returns:
        t0 [s], not after the first sample that shows motion.

    Raises:
        ValueError: Nothing moved.
    """
    begun = np.flatnonzero(moved >= _LEAST_COUNTS)
    if not begun.size:
        raise ValueError("nothing moved")
    first = float(t[begun[0]])
    if begun.size < _LEAST_POINTS:
        return first
    times, counts = t[begun[0] :], np.maximum(moved[begun[0] :], 1.0)
    fits = []
    for p in EXPONENTS:
        slope, offset = np.polyfit(times, counts ** (1.0 / p), 1)
        residual = float(np.sum((np.maximum(slope * times + offset, 0.0) ** p - counts) ** 2))
        fits.append((residual, -offset / slope if slope > 0 else first))
    return min(float(min(fits)[1]), first)


def fit_stiction(pushes: Sequence[Push], scale_uncertainty: float = 0.0) -> Stiction:
    """The joints' friction from pushes of all three pairs in both senses.

    Args:
        pushes: The pushes, at least one of each kind and two of one.
        scale_uncertainty: How well newton metres are known, as a share (95 %).

    Returns:
        Friction and intervals.

    Raises:
        ValueError: A kind of push is missing, or there is none twice.
    """
    kinds = {
        (held, sense): [each for each in pushes if (each.held, each.sense) == (held, sense)]
        for held, sense in product(range(JOINTS), (1, -1))
    }
    freedom = len(pushes) - len(kinds)
    if not all(kinds.values()) or freedom < 1:
        raise ValueError("pushes of all three pairs in both senses are needed, and one of them twice")
    torques = {kind: np.array([each.torque for each in some]) for kind, some in kinds.items()}
    spread = float(np.sqrt(sum(np.sum((some - some.mean()) ** 2) for some in torques.values()) / freedom))
    rates = np.array([np.mean([each.rates for each in kinds[k, 1] + kinds[k, -1]], axis=0) for k in range(JOINTS)])
    weights = np.abs(rates).sum(axis=1)
    mean_of = np.linalg.inv(np.abs(rates)) * weights  # from mean torques of a pair to mean friction
    difference_of = _seen_inverse(rates) * weights
    up = np.array([torques[k, 1].mean() for k in range(JOINTS)])
    down = np.array([torques[k, -1].mean() for k in range(JOINTS)])
    mean, difference = mean_of @ (up + down) / 2, difference_of @ (up - down) / 2
    noise = np.array([[1 / len(torques[k, 1]), 1 / len(torques[k, -1])] for k in range(JOINTS)]) * spread**2
    quantile = float(student.ppf((1 + CONFIDENCE) / 2, freedom))
    friction, half = np.empty((JOINTS, 2)), np.empty((JOINTS, 2))
    for side, sense in enumerate((1, -1)):
        by_up, by_down = (mean_of + sense * difference_of) / 2, (mean_of - sense * difference_of) / 2
        friction[:, side] = mean + sense * difference
        deviation = np.sqrt(by_up**2 @ noise[:, 0] + by_down**2 @ noise[:, 1])
        half[:, side] = np.hypot(quantile * deviation, scale_uncertainty * np.abs(friction[:, side]))
    return Stiction(friction, half, spread, _null_space(rates))


def _seen_inverse(rates: Vector) -> Vector:
    """The inverse of rates within what they see: they are of rank 2, but for the poses in which each was taken."""
    u, sizes, vt = np.linalg.svd(rates)
    inverse: Vector = vt[:2].T @ np.diag(1 / sizes[:2]) @ u[:, :2].T
    return inverse


def _null_space(rates: Vector) -> Vector:
    """The direction c with rates c = 0, of length 1."""
    null: Vector = np.linalg.svd(rates)[2][-1]
    upright: Vector = null * np.sign(null[np.argmax(np.abs(null))])
    return upright
