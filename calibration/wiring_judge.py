"""Whether motors of one wiring could have moved the joints as they moved: by their work, and by the direction.

- Work: what the motors did, n sum tau dq, is what the motion has and what viscous friction took, both by the model, and
  dry friction, sum F_i |dq_i| with one F_i >= 0 a joint for all pushes. The F_i come out of it.
- Direction: without dry friction the joints go along S Mt^-1 S' tau; where it rules, one joint holds and the others go
  along S v_k (`stiction_fit`), for the k with which the torques first overcome these F_i.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from torquerig.calibration.installation import JOINTS, Hypothesis
from torquerig.calibration.pushes import Evidence, Place
from torquerig.calibration.stiction_fit import along
from torquerig.calibration.wiring_closure import Closing

Vector = NDArray[np.float64]

FITS: Final = 0.2
"""Mean distance of unit vectors (0.2: 11 degrees) below which an installation explains the directions."""
WORKS: Final = 0.05
"""Share of the work, rms, that may be left over; right installations leave 0.01 to 0.02, two wrong signs 0.08."""
NOWHERE: Final = 2.0
"""The misfit of directions that are not asked for, because the work does not fit: as of opposite ones."""
KEPT: Final = 0.75
"""Share of the pushes that count, the best explained ones: where friction falls once a joint moves, some go astray."""
_GIVES_WAY: Final = 0.8  # of the load at which the first joint gives way: the frictions are known about as well
_BLENDS: Final = np.array([0.0, 0.25, 0.5, 0.75, 1.0])[:, None]
_ALIKE: Final = 0.005  # [N·m at the motor] of friction that all joints may have beside what the work tells
_INERTIA: Final = 0.3  # how well the model's inertia and viscous friction are believed, as a share


class Motion(NamedTuple):
    """What the joints did in each of n pushes, by one choice of encoders.

    Attributes:
        moved: How far they moved, shape (n, 3) [rad].
        taken: What the model's motion and viscous friction took, shape (n,) [N·m rad at the motor].
    """

    moved: Vector
    taken: Vector


class Field:
    """Where the joints may go at one place."""

    def __init__(self, place: Place) -> None:
        """Work out what does not depend on the torques."""
        self._place = place
        self._inverse: Vector = np.asarray(np.linalg.pinv(place.S), dtype=np.float64)
        self._free: Vector = place.S @ np.linalg.solve(place.Mt, place.S.T)
        self._ways: Vector = np.array([along(place.S, held) for held in range(JOINTS)])
        self._ways /= np.linalg.norm(self._ways, axis=1)[:, None]

    def directions(self, torque: Vector, dry: Vector) -> Vector:
        """Where the joints may go: frictionless to ruled by dry friction, for each joint that may hold.

        Args:
            torque: True motor torques, shape (n, 3), of any size.
            dry: Dry friction of each joint, shape (3,) [N·m at the motor].

        Returns:
            Unit vectors, shape (n, 3, blends, 3); NaN for joints that cannot be the one that holds.
        """
        work = torque @ self._ways.T
        loads = np.abs(work) / (np.abs(self._ways) @ (dry + _ALIKE))
        ways = np.sign(work)[..., None] * self._ways
        ways[loads < _GIVES_WAY * loads.max(axis=1, keepdims=True)] = np.nan
        free = torque @ self._free.T
        free /= np.linalg.norm(free, axis=1, keepdims=True)
        blended = _BLENDS * ways[:, :, None, :] + (1.0 - _BLENDS) * free[:, None, None, :]
        units: Vector = blended / np.linalg.norm(blended, axis=3, keepdims=True)
        return units

    def misfit(self, torque: Vector, moved: Vector, dry: Vector) -> float:
        """Root mean square distance of motions from the nearest direction that torques can make, 0 to 2."""
        units = moved / np.linalg.norm(moved, axis=1)[:, None]
        near = np.nanmax(np.einsum("khbj,kj->khb", self.directions(torque, dry), units), axis=(1, 2))
        kept = np.sort(2.0 - 2.0 * near)[: max(1, round(KEPT * len(near)))]
        return float(np.sqrt(np.mean(np.maximum(kept, 0.0))))

    def motion(self, evidence: Evidence, closing: Closing) -> Motion:
        """What the joints did, and what that took by the model."""
        place, inverse = self._place, self._inverse
        velocity = closing.true(evidence.rates) @ inverse.T
        turn = np.zeros((JOINTS, JOINTS))
        turn[list(closing.encoders), range(JOINTS)] = np.array(closing.sign) / np.array(closing.scale)
        squares = np.einsum("ia,kab,jb->kij", inverse @ turn, evidence.squares, inverse @ turn)
        kinetic = np.einsum("ki,ij,kj->k", velocity, place.Mt, velocity) / 2
        taken = (kinetic + np.einsum("kij,ij->k", squares, place.Ft)) / place.model.gear_ratio
        return Motion(closing.true(evidence.moved), taken)

    def judge(self, hypothesis: Hypothesis, evidence: Evidence, motion: Motion, factor: Vector) -> tuple[float, float]:
        """Misfit of the directions, and of the work; nothing speaks against an installation that no push shows.

        Args:
            hypothesis: The installation.
            evidence: The pushes.
            motion: What the joints did by its encoders.
            factor: How many times the configured torque each motor gives at its joint, shape (3,).
        """
        if not len(evidence):
            return 0.0, 0.0
        labour, dry = _labour(hypothesis, evidence, motion, factor)
        if labour >= WORKS:
            return NOWHERE, labour
        given = np.zeros_like(evidence.torque)
        given[:, list(hypothesis.motors)] = np.array(hypothesis.torque_sign) * evidence.torque
        return self.misfit(given * factor, motion.moved, dry), labour


def _labour(hypothesis: Hypothesis, evidence: Evidence, motion: Motion, factor: Vector) -> tuple[float, Vector]:
    """Root mean square share of the work that is left over, and each joint's dry friction, shape (3,) [N·m]."""
    read = [hypothesis.encoders.index(leg) for leg in hypothesis.motors]
    per_count = np.array(hypothesis.encoder_sign) / np.array(hypothesis.scale)
    torque = np.array(hypothesis.torque_sign) * factor[list(hypothesis.motors)]
    done = evidence.work[:, range(JOINTS), read] @ (torque * per_count[read])
    most = np.einsum("kpa,p,a->k", np.abs(evidence.work), np.abs(torque), np.abs(per_count))
    rows = np.column_stack([np.abs(motion.moved), motion.taken]) / most[:, None]
    believed = np.array([[*np.zeros(JOINTS), 1.0 / _INERTIA]])
    found, _ = nnls(np.vstack([rows, believed]), np.append(done / most, 1.0 / _INERTIA))
    return float(np.sqrt(np.mean((rows @ found - done / most) ** 2))), found[:JOINTS]
