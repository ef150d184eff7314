"""Where the thesis is misprinted: each formula evaluated as printed, so that the evidence is computed, not quoted.

The same rows stand in docs/mechanism.md.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.control.motions import THESIS_STROKES, thesis_motion
from torquerig.mechanism import HOME, Manipulator
from torquerig.reproduction.thesis_axes import SAMPLES

Array = NDArray[np.float64]

SAMPLING_TIME: Final = 4e-3  # [s], thesis 6.4
PRINTED_HOME: Final = np.radians([48.918, 251.563, 183.609])  # theta_1 to theta_3, thesis 5.3
PRINTED_DISPLACEMENT: Final = {1: 0.02036, 2: 0.01711}  # [m], thesis 6.1
_PLACE: Final = (0.101, 0.055)  # any pose far from singularities [m]
_VELOCITY: Final = np.array([0.21, -0.13])  # any velocity [m/s]
_ACCELERATION: Final = np.array([3.0, -2.0])  # any acceleration [m/s²]
_STEP: Final = 1e-6  # [s] of the central difference


class Misprint(NamedTuple):
    """Something that the thesis prints and cannot mean.

    Attributes:
        where: Section or equation.
        printed: What stands there.
        right: What has to stand there.
        evidence: What shows it, with the number that came out.
    """

    where: str
    printed: str
    right: str
    evidence: str


def misprints() -> tuple[Misprint, ...]:
    """Evaluate all of them, with the thesis' own machine."""
    machine = Manipulator.thesis()
    return (
        _home_angles(machine),
        _denominator(machine),
        _arctan(machine),
        _angle_names(machine),
        _c11(machine),
        _lower_blocks(machine),
        _pseudo_inverse(machine),
        _regressor(machine),
        _displacements(),
        _time_axes(),
    )


def forward_kinematics(machine: Manipulator, theta: Array, *, as_printed: bool) -> Array:
    """5.3 and 5.4, whose denominator is printed with xB2 (yB3 - yB2), shape (2,) [m]."""
    elbows = np.array(machine.bases) + machine.link_length * np.column_stack([np.cos(theta), np.sin(theta)])
    (x1, y1), (x2, y2), (x3, y3) = elbows
    n1, n2, n3 = np.sum(elbows**2, axis=1)
    denominator = 2.0 * (x1 * (y2 - y3) + x2 * (y3 - (y2 if as_printed else y1)) + x3 * (y1 - y2))
    x = n1 * (y2 - y3) + n2 * (y3 - y1) + n3 * (y1 - y2)
    y = n1 * (x3 - x2) + n2 * (x1 - x3) + n3 * (x2 - x1)
    place: Array = np.array([x, y]) / denominator
    return place


def _home_angles(machine: Manipulator) -> Misprint:
    printed = _millimetres(forward_kinematics(machine, PRINTED_HOME, as_printed=False))
    exchanged = _millimetres(forward_kinematics(machine, PRINTED_HOME[[0, 2, 1]], as_printed=False))
    return Misprint(
        "home angles, 5.3",
        "θ2 = 251.563°, θ3 = 183.609°",
        "exchanged, for its A2 and A3",
        f"forward kinematics gives {printed} mm as printed, {exchanged} mm exchanged; home is (92, 62) mm",
    )


def _denominator(machine: Manipulator) -> Misprint:
    theta = machine.inverse_kinematics(HOME).theta
    printed = _millimetres(forward_kinematics(machine, theta, as_printed=True))
    right = _millimetres(forward_kinematics(machine, theta, as_printed=False))
    return Misprint(
        "5.3, 5.4 denominator",
        "xB2 (yB3 - yB2)",
        "xB2 (yB3 - yB1)",
        f"the joint angles of home map to {printed} mm as printed, to {right} mm put right",
    )


def _arctan(machine: Manipulator) -> Misprint:
    d = np.array(HOME) - np.array(machine.bases)
    h = np.arccos(np.hypot(d[:, 0], d[:, 1]) / (2.0 * machine.link_length))
    printed = np.arctan(d[:, 1] / d[:, 0]) + h
    off = np.degrees(machine.inverse_kinematics(HOME).theta - printed) % 360.0
    return Misprint(
        "5.5, function",
        "arctan",
        "atan2",
        f"legs 1, 2, 3 are off by {off[0]:.0f}°, {off[1]:.0f}°, {off[2]:.0f}° at home as printed",
    )


def _angle_names(machine: Manipulator) -> Misprint:
    d = np.array(HOME) - np.array(machine.bases)
    world = np.arctan2(d[:, 1], d[:, 0])
    apart = np.degrees(np.abs(np.angle(np.exp(1j * (world - machine.inverse_kinematics(HOME).phi)))))
    return Misprint(
        "5.5, name",
        "φi for the angle of AiC in the world",
        "another letter: φi is the angle of a distal link to its proximal one from 5.7 on",
        f"at home the two differ by {apart[0]:.1f}°, {apart[1]:.1f}°, {apart[2]:.1f}°",
    )


def _c11(machine: Manipulator) -> Misprint:
    _, _, _, C = _open_chains(machine)
    printed = C.copy()
    phi = machine.inverse_kinematics(_PLACE).phi
    beta = np.array(machine.inertia_constants()[1])
    printed[range(3), range(3)] = beta * np.sin(phi) * machine.joint_rates(_PLACE, _VELOCITY)[:3]
    return Misprint(
        "5.7, C11",
        "β sin(φ) θ̇",
        "−β sin(φ) φ̇",
        f"Ṁ − 2C must be skew symmetric: it misses by {_skewness_residual(machine, printed):.0%} of |Ṁ| as printed,"
        f" by {_skewness_residual(machine, C):.0e} put right",
    )


def _lower_blocks(machine: Manipulator) -> Misprint:
    _, _, M, C = _open_chains(machine)
    left, right = C.copy(), C.copy()
    left[3:, :3] = C[:3, 3:]
    right[3:, 3:] = M[3:, 3:]
    return Misprint(
        "5.10, lower blocks of C",
        "C12 on the left, M22 on the right",
        "C21 and 0",
        f"Ṁ − 2C misses skew symmetry by {_skewness_residual(machine, left):.0%} of |Ṁ| with the left one as printed,"
        f" by {_skewness_residual(machine, right):.0%} with the right one",
    )


def _pseudo_inverse(machine: Manipulator) -> Misprint:
    _, S = machine.jacobians(HOME)
    product = np.linalg.pinv(S.T) @ S.T
    rank = int(np.linalg.matrix_rank(product))
    return Misprint(
        "after 3.67",
        "(Sᵀ)⁺ Sᵀ = I",
        f"a projector of rank {rank}",
        f"an element differs from I by {np.abs(product - np.eye(3)).max():.2f} at home;"
        f" the product's square differs from itself by {np.abs(product @ product - product).max():.0e}",
    )


def _regressor(machine: Manipulator) -> Misprint:
    W, Wdot, M, C = _open_chains(machine)
    actuators = np.diag([machine.actuator_inertia] * 3 + [0.0] * 3)
    viscous = np.diag([machine.active_viscous] * 3 + [machine.passive_viscous] * 3)
    a, v = _ACCELERATION, _VELOCITY
    identified = W.T @ actuators @ (W @ a + Wdot @ v) + W.T @ viscous @ W @ v
    drive = machine.gear_ratio * machine.jacobians(_PLACE)[1].T @ machine.inverse_dynamics(_PLACE, v, a)
    along = drive - W.T @ (M - actuators) @ W @ a
    rigid = (W.T @ (M - actuators) @ Wdot + W.T @ C @ W) @ v
    missed, met = (np.linalg.norm(side - identified) / np.linalg.norm(rigid) for side in (along + rigid, along - rigid))
    return Misprint(
        "5.16 to 5.18",
        "several W as M; the velocity terms with the other sign on the left",
        "n Sᵀτm − WᵀMW a − (WᵀMẆ + WᵀCW) v on the left",
        f"the left side misses the right by {missed:.2f} times the velocity terms as printed, by {met:.0e} put right;"
        f" with M for W the factors are {M.shape[0]}x{M.shape[1]} times {v.shape[0]}, which is no product",
    )


def _displacements() -> Misprint:
    def samples(displacement: float, motion: int) -> float:
        return displacement / (math.sqrt(2.0) * THESIS_STROKES[motion].speed * SAMPLING_TIME)

    printed = {motion: samples(norm, motion) for motion, norm in PRINTED_DISPLACEMENT.items()}
    exchanged = {motion: samples(PRINTED_DISPLACEMENT[3 - motion], motion) for motion in printed}
    return Misprint(
        "6.1",
        "motion 1 is 20.36 mm, motion 2 is 17.11 mm",
        "exchanged; speed and acceleration are an axis', the displacement is the norm",
        f"D / v is {exchanged[1]:.3f} and {exchanged[2]:.3f} samples of 4 ms exchanged, whole numbers,"
        f" {printed[1]:.2f} and {printed[2]:.2f} as printed",
    )


def _time_axes() -> Misprint:
    lasts = {motion: thesis_motion(motion).duration for motion in SAMPLES}
    counts = {motion: duration / SAMPLING_TIME for motion, duration in lasts.items()}
    return Misprint(
        "Figures 6.6 to 6.10, abscissa",
        f"time (ms), 0 to {SAMPLES[1]} and 0 to {SAMPLES[2]}",
        "samples of 4 ms, as in Figures 6.2 to 6.5",
        f"the motions last {1e3 * lasts[1]:.0f} and {1e3 * lasts[2]:.0f} ms:"
        f" {counts[1]:.0f} and {counts[2]:.0f} samples",
    )


def _open_chains(machine: Manipulator) -> tuple[Array, Array, Array, Array]:
    """W, Wdot, M, C of a pose that moves."""
    W, _ = machine.jacobians(_PLACE)
    phi = machine.inverse_kinematics(_PLACE).phi
    rates = machine.joint_rates(_PLACE, _VELOCITY)
    return W, machine.jacobian_rates(_PLACE, _VELOCITY), machine.joint_inertia(phi), machine.joint_coriolis(phi, rates)


def _skewness_residual(machine: Manipulator, C: Array) -> float:
    """How far Ṁ − 2C is from skew symmetric, relative to Ṁ."""
    phi, step = machine.inverse_kinematics(_PLACE).phi, _STEP * machine.joint_rates(_PLACE, _VELOCITY)[3:]
    rate = (machine.joint_inertia(phi + step) - machine.joint_inertia(phi - step)) / (2.0 * _STEP)
    difference = rate - 2.0 * C
    return float(np.linalg.norm(difference + difference.T) / np.linalg.norm(rate))


def _millimetres(place: Array) -> str:
    """A place for a person."""
    return f"({1e3 * place[0]:.2f}, {1e3 * place[1]:.2f})"
