"""Which encoders, senses and scales make the legs close while the joints move: the first question to an installation.

Rates close when c(X)'thetadot = 0. Over a small move from rest to rest that holds for the whole move with c half way,
so with m_a the motion that axis a tells of, its encoder's leg e_a, sense s_a and scale g_a (measured over true motion)

    sum_a c[e_a](X) s_a m_a / g_a = 0 .

That is linear in 1 / g_a. X follows from the same motion, so that c bends with it: mirrored motion does not close. A
machine that stands beside the fixture's pose bends c too, and is allowed to by `BESIDE`.
"""

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.installation import JOINTS, ORDERS, SIGNS, Legs, Scales, Signs
from torquerig.calibration.pushes import Evidence, Place

Vector = NDArray[np.float64]

BESIDE: Final = 0.5e-3
"""How far the machine may stand beside the fixture's pose [m]: what the plan asks for."""
FARTHEST: Final = 3e-3
"""How far it may stand beside it to be named as a reason at all [m]; our choice."""
CLOSING: Final = 0.003
"""Share of a move that rounding to counts leaves open: one count of the 318 of a push."""
OPENS: Final = 2.0
"""Times as much that may be open, rms; right installations of all plants leave 0.15 to 0.55."""
_SCALE: Final = (1e-3, 1e3)
_RIGHT: Final = 0.005  # a scale that is nearer to 1 is none
_PLANE: Final = 0.1  # of the larger extent of the moves that the smaller has at least, to be a plane
_ROUNDS: Final = 3  # the place of a move follows from the scales
_FREE: Final[tuple[tuple[int, ...], ...]] = ((), (0,), (1,), (2,), (0, 1), (0, 2), (1, 2))


class Closing(NamedTuple):
    """Encoders with which the legs close.

    Attributes:
        encoders: Which leg's encoder each axis reads.
        sign: In which sense.
        scale: Measured over true motion of each axis.
        opening: What is left open, rms, in `CLOSING`.
        beside: How far the machine then stands beside the fixture's pose [m].
    """

    encoders: Legs
    sign: Signs
    scale: Scales
    opening: float
    beside: float

    def true(self, told: Vector) -> Vector:
        """The joints' motion of what the axes tell, shape (n, 3)."""
        joints = np.zeros_like(told)
        joints[:, list(self.encoders)] = told * np.array(self.sign) / np.array(self.scale)
        return joints


def closings(evidence: Evidence, place: Place, most: int) -> Iterator[Closing]:
    """All encoders with at most so many wrong scales that let the legs close; without any motion all are possible."""
    for encoders in ORDERS:
        inverse = _inverse(evidence, place, encoders)
        for sign in SIGNS:
            if not _may_close(evidence, place, encoders, sign):
                continue
            for free in _FREE:
                if len(free) > most or (free and not len(evidence)):
                    continue
                found = _fit(evidence, place, inverse, Closing(encoders, sign, (1.0, 1.0, 1.0), 0.0, 0.0), free)
                if found is not None and found.opening <= OPENS and found.beside <= FARTHEST:
                    yield found


def _may_close(evidence: Evidence, place: Place, encoders: Legs, sign: Signs) -> bool:
    """Whether any positive scales let the legs close: where all moves lie in one plane, its normal tells."""
    told = place.normal[list(encoders)] * np.array(sign) * evidence.moved
    if len(told) < JOINTS:
        return True
    _, size, ways = np.linalg.svd(told)
    return bool(size[1] < _PLANE * size[0] or np.ptp(np.sign(ways[-1])) == 0.0)


def _fit(evidence: Evidence, place: Place, inverse: Vector, guess: Closing, free: tuple[int, ...]) -> Closing | None:
    """The scales of the axes that are free, and the place, with which most closes; None if they cannot be scales."""
    if not len(evidence):
        return guess
    found = guess
    length = np.linalg.norm(evidence.moved, axis=1)[:, None]
    fixed = [axis for axis in range(JOINTS) if axis not in free]
    held = np.hstack([np.zeros((2, len(free))), np.eye(2) / (BESIDE / 2)])
    for _ in range(_ROUNDS if free else 1):
        halfway = found.true(evidence.before + evidence.moved / 2) @ inverse
        normal = place.normal + halfway @ place.bend.T
        told = normal[:, list(guess.encoders)] * np.array(guess.sign) * evidence.moved / length
        shifted = (found.true(evidence.moved) / length) @ place.bend
        rows = np.vstack([np.hstack([told[:, list(free)], shifted]) / CLOSING, held])
        right = np.concatenate([-told[:, fixed].sum(axis=1) / CLOSING, [0.0, 0.0]])
        solution = np.linalg.lstsq(rows, right, rcond=None)[0]
        counts = solution[: len(free)]  # true over measured motion
        if not np.all((counts > _SCALE[0]) & (counts < _SCALE[1]) & (np.abs(counts - 1.0) > _RIGHT)):
            return None
        scale = np.ones(JOINTS)
        scale[list(free)] = 1.0 / counts
        first, second, third = scale.tolist()
        left = (rows @ solution - right)[:-2]
        opening, beside = float(np.sqrt(np.mean(left**2))), float(np.hypot(*solution[len(free) :]))
        found = found._replace(scale=(first, second, third), opening=opening, beside=beside)
    return found


def _inverse(evidence: Evidence, place: Place, encoders: Legs) -> Vector:
    """From joints' ways to the end-effector's, by those whose motors hold on, shape (3, 2) [m]; 0 by fewer than two."""
    legs = [leg for axis, leg in enumerate(encoders) if axis not in evidence.spun]
    inverse = np.zeros((JOINTS, 2))
    if len(legs) > 1:
        inverse[legs] = np.linalg.pinv(place.S[legs]).T
    return inverse
