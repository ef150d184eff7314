"""What a redundant actuator gives (thesis, chapter 2): stiffness and force transmission of three legs, or of any two.

All functions take any number of positions at once, shape (..., 2) [m], in the machine's working mode. `legs` are the
driven legs, counted from 0; the others are thought away, actuator and links. Where a driven leg cannot reach, the
results are NaN; where it is stretched or folded, infinite or NaN.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from torquerig.mechanism.manipulator import Manipulator
from torquerig.mechanism.values import Array

ALL_LEGS: Final = (0, 1, 2)
PAIRS: Final = ((0, 1), (0, 2), (1, 2))
"""What is left of the machine when one leg is taken away."""


def distal_links(model: Manipulator, positions: npt.ArrayLike) -> Array:
    """The distal links as vectors b_i from elbow to end-effector, shape (..., 3, 2) [m]; NaN out of reach."""
    d = np.asarray(positions, dtype=np.float64)[..., np.newaxis, :] - np.array(model.bases)
    r = np.linalg.norm(d, axis=-1)
    height = np.sqrt(np.where(r <= 2.0 * model.link_length, model.link_length**2 - 0.25 * r * r, np.nan))
    with np.errstate(divide="ignore", invalid="ignore"):
        side = np.array(model.branches) * height / r
    across = np.stack((d[..., 1], -d[..., 0]), axis=-1)
    b: Array = 0.5 * d + side[..., np.newaxis] * across
    return b


def active_jacobian(model: Manipulator, positions: npt.ArrayLike, legs: Sequence[int] = ALL_LEGS) -> Array:
    """S of the driven legs, thetadot = S v, shape (..., len(legs), 2) [1/m]: rows b_i / (d_i x b_i) (5.12).

    Args:
        model: The machine.
        positions: Of the end-effector, shape (..., 2) [m].
        legs: The driven legs.
    """
    d = np.asarray(positions, dtype=np.float64)[..., np.newaxis, :] - np.array(model.bases)
    b = distal_links(model, positions)
    with np.errstate(divide="ignore", invalid="ignore"):
        S: Array = b / cross(d, b)[..., np.newaxis]
    return S[..., list(legs), :]


def stiffness(
    model: Manipulator, positions: npt.ArrayLike, legs: Sequence[int] = ALL_LEGS, joint_stiffness: float = 1.0
) -> Array:
    """Cartesian stiffness K = k S'S, shape (..., 2, 2) [N/m] (2.10).

    Args:
        model: The machine.
        positions: Of the end-effector, shape (..., 2) [m].
        legs: The driven legs.
        joint_stiffness: k, of every driven joint [N·m/rad]; the thesis' figure is drawn for 1.
    """
    S = active_jacobian(model, positions, legs)
    return joint_stiffness * np.swapaxes(S, -1, -2) @ S


def stiffness_norm(model: Manipulator, positions: npt.ArrayLike, legs: Sequence[int] = ALL_LEGS) -> Array:
    """Euclidean norm of the stiffness at k = 1 N·m/rad, sigma_max(S)², shape (...) [N/m] (Figure 2.2)."""
    return singular_values(model, positions, legs)[..., 0] ** 2


def transmission(model: Manipulator, positions: npt.ArrayLike, legs: Sequence[int] = ALL_LEGS) -> Array:
    """sigma_min / sigma_max of S, shape (...) (2.14, Figure 2.3): how even the force is that unit torques give.

    1 is the same force in all directions, 0 a direction in which the machine cannot push at all.
    """
    values = singular_values(model, positions, legs)
    ratio: Array = values[..., 1] / values[..., 0]
    return ratio


def force_bounds(model: Manipulator, positions: npt.ArrayLike, legs: Sequence[int] = ALL_LEGS) -> Array:
    """Force in the strongest and in the weakest direction, n sigma(S), shape (..., 2) [N per N·m of motor torques].

    By (2.14) motor torques of norm 1 N·m give forces between the two, if nothing of them is internal preload.
    """
    return model.gear_ratio * singular_values(model, positions, legs)


def singular_values(model: Manipulator, positions: npt.ArrayLike, legs: Sequence[int] = ALL_LEGS) -> Array:
    """The two singular values of S, the greater first, shape (..., 2) [1/m]; NaN out of reach.

    For two columns sigma_1² + sigma_2² is the squared norm, and sigma_1 sigma_2 the norm of the columns' product.
    """
    S = active_jacobian(model, positions, legs)
    a, b = S[..., 0], S[..., 1]
    xx, xy, yy = np.sum(a * a, axis=-1), np.sum(a * b, axis=-1), np.sum(b * b, axis=-1)
    greater = np.sqrt(0.5 * (xx + yy + np.hypot(xx - yy, 2.0 * xy)))
    pairs = [(i, j) for i in range(len(legs)) for j in range(i)]
    volume = np.linalg.norm([a[..., i] * b[..., j] - a[..., j] * b[..., i] for i, j in pairs], axis=0)
    return np.stack((greater, volume / greater), axis=-1)


def alignment(model: Manipulator, positions: npt.ArrayLike, legs: tuple[int, int]) -> Array:
    """Sine of the angle between the distal links of two legs, shape (...): 0 at their direct singularities (2.4)."""
    b = distal_links(model, positions)
    first, second = legs
    return cross(b[..., first, :], b[..., second, :]) / model.link_length**2


def cross(a: Array, b: Array) -> Array:
    """a_x b_y - a_y b_x over the last axis, shape (...)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
