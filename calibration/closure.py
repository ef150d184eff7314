"""The closure of the redundant mechanism: three joint angles, of which two fix the end-effector, so that one can err.

For geometry parameters p and angles theta_k of a sample, the end-effector is put where the angles that it would need
are nearest to the measured ones, in radians: that is what measurement noise, the same on all encoders, asks for.

    C_k = argmin |theta_k - IK(C; p)|²          r_k = nu_k' (theta_k - IK(C_k; p))

nu_k is the unit vector with nu_k' S = 0, the direction in which the angles cannot move, and r_k the closure residual
[rad]. By variable projection dr_k = nu_k' (d theta_k - dIK|_C), in closed form: with e = d x b, l and m the lengths of
the proximal and distal links and u the proximal link's direction,

    dIK = [ b' (dC - dA - u dl) - m dm ] / e
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.mechanism import Manipulator, SingularPoseError

Array = NDArray[np.float64]

LEGS: Final = 3
_STEPS: Final = 12
"""Of Gauss and Newton for the end-effectors: three do from 2 deg of error."""
_CONVERGED: Final = 1e-10
"""Change of the end-effector at which they end [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Geometry:
    """What closes: the links and where they stand.

    Attributes:
        bases: A_i, shape (3, 2) [m].
        proximal: Length of each proximal link, shape (3,) [m].
        distal: Of each distal link, shape (3,) [m].
        branches: Each leg's elbow sign, shape (3,).
    """

    bases: Array
    proximal: Array
    distal: Array
    branches: Array

    @classmethod
    def of(cls, model: Manipulator) -> "Geometry":
        """The geometry of a model."""
        lengths = np.full(LEGS, model.link_length)
        return cls(np.array(model.bases), lengths, lengths.copy(), np.array(model.branches, dtype=np.float64))


@dataclass(frozen=True, slots=True, eq=False)
class Closed:
    """The mechanism closed as well as it can be at n samples.

    Attributes:
        position: C_k, shape (n, 2) [m].
        residuals: r_k, shape (n,) [rad].
        normals: nu_k, shape (n, 3).
        slopes: Derivatives of the three angles at C_k, each of its own leg only: of the base's x and y, of the
            proximal and of the distal length; shape (n, 3, 4) [rad/m].
    """

    position: Array
    residuals: Array
    normals: Array
    slopes: Array


def close(geometry: Geometry, theta: Array, position: Array) -> Closed:
    """Close the mechanism at measured angles.

    Args:
        geometry: Its geometry.
        theta: Joint angles, shape (n, 3) [rad].
        position: Where the end-effector is about, shape (2,) or (n, 2) [m].

    Returns:
        End-effectors, residuals and derivatives.

    Raises:
        SingularPoseError: A leg cannot close, or the legs do not determine a position.
    """
    C = np.array(np.broadcast_to(position, (len(theta), 2)))
    for _ in range(_STEPS):
        error, S, slopes = _legs(geometry, theta, C)
        step = _project(S, error)
        C += step
        if not np.all(np.isfinite(C)):
            break
        if np.max(np.abs(step)) < _CONVERGED:
            break
    error, S, slopes = _legs(geometry, theta, C)
    normals = np.cross(S[:, :, 0], S[:, :, 1])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    residuals = np.einsum("ki,ki->k", normals, error)
    if not np.all(np.isfinite(residuals)):
        raise SingularPoseError("the legs cannot close at these joint angles: they, or the geometry, are far off")
    return Closed(C, residuals, normals, slopes)


def _legs(geometry: Geometry, theta: Array, C: Array) -> tuple[Array, Array, Array]:
    """Angle errors, shape (n, 3), S of shape (n, 3, 2), and slopes as in `Closed`; NaN where a leg is too short."""
    first, second = geometry.proximal, geometry.distal
    d = C[:, None, :] - geometry.bases
    r = np.hypot(d[..., 0], d[..., 1])
    with np.errstate(invalid="ignore"):
        bend = np.arccos((first**2 + r**2 - second**2) / (2.0 * first * r))
    angle = np.arctan2(d[..., 1], d[..., 0]) + geometry.branches * bend
    u = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    b = d - first[:, None] * u
    e = d[..., 0] * b[..., 1] - d[..., 1] * b[..., 0]
    S = b / e[..., None]
    along = np.einsum("kij,kij->ki", b, u) / e
    slopes = np.stack([-S[..., 0], -S[..., 1], -along, -second / e], axis=-1)
    error = np.remainder(theta - angle + np.pi, 2.0 * np.pi) - np.pi
    return error, S, slopes


def _project(S: Array, error: Array) -> Array:
    """The least-squares step of the end-effectors, (S'S)^-1 S' error, shape (n, 2)."""
    gram = np.einsum("kij,kil->kjl", S, S)
    right = np.einsum("kij,ki->kj", S, error)
    xx, xy, yy = gram[:, 0, 0], gram[:, 0, 1], gram[:, 1, 1]
    moved = np.column_stack([yy * right[:, 0] - xy * right[:, 1], xx * right[:, 1] - xy * right[:, 0]])
    with np.errstate(divide="ignore", invalid="ignore"):
        step: Array = moved / (xx * yy - xy * xy)[:, None]
    return step
