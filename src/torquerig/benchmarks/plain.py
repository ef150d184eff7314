"""The machine's equations in plain numpy, as one would type them from the thesis: what compiled code is measured by.

Nothing of `torquerig.mechanism` is called: only numbers are taken from it. Arrays are of legs, shape (3,), or of the
plane, shape (2,); a matrix has its equation's shape.
"""

from dataclasses import dataclass, field
from typing import Self, cast

import numpy as np
from numpy.typing import NDArray

from torquerig.mechanism import Manipulator

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PlainManipulator:
    """A 3-RRR manipulator (thesis, chapter 5).

    Attributes:
        bases: Actuated joints, shape (3, 2) [m].
        length: Of every link [m].
        gear: Motor revolutions per joint revolution.
        branches: Elbow signs, shape (3,).
        alpha: Of (5.8), with the actuators, shape (3,) [kg·m²].
        beta: Likewise.
        gamma: Likewise.
        viscous: K1 three times, K2 three times on the diagonal, shape (6, 6) [N·m·s/rad].
    """

    bases: Array
    length: float
    gear: float
    branches: Array
    alpha: Array
    beta: Array
    gamma: Array
    viscous: Array
    _facing: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Find where theta is cut: behind each base joint, seen from the middle of all."""
        away = self.bases.mean(axis=0) - self.bases
        directions = np.arctan2(away[:, 1], away[:, 0])
        object.__setattr__(self, "_facing", np.where(directions < -1e-7, directions + 2.0 * np.pi, directions))

    @classmethod
    def like(cls, model: Manipulator) -> Self:
        """The same machine as a model."""
        alpha, beta, gamma = (np.array(each) for each in model.inertia_constants())
        return cls(
            bases=np.array(model.bases),
            length=model.link_length,
            gear=model.gear_ratio,
            branches=np.array(model.branches, dtype=np.float64),
            alpha=alpha + model.actuator_inertia,
            beta=beta,
            gamma=gamma,
            viscous=np.diag([model.active_viscous] * 3 + [model.passive_viscous] * 3),
        )

    def position(self, theta: Array) -> Array:
        """The point at equal distance from the elbows (5.3, 5.4), shape (2,) [m]."""
        elbows = self.bases + self.length * np.column_stack((np.cos(theta), np.sin(theta)))
        differences = elbows[1:] - elbows[0]
        squares = np.sum(elbows[1:] ** 2, axis=1) - np.sum(elbows[0] ** 2)
        return np.linalg.solve(2.0 * differences, squares)

    def angles(self, position: Array) -> tuple[Array, Array]:
        """Both angles, theta and phi, of all legs (5.6), shape (3,) each [rad]."""
        d = position - self.bases
        h = np.arccos(np.hypot(d[:, 0], d[:, 1]) / (2.0 * self.length))
        turned = np.arctan2(d[:, 1], d[:, 0]) - self._facing
        psi = self._facing + (turned + np.pi) % (2.0 * np.pi) - np.pi
        return psi + self.branches * h, -2.0 * self.branches * h

    def jacobian(self, position: Array) -> Array:
        """W of (5.12), qdot = W v; its first three rows are S. Shape (6, 2) [1/m]."""
        _, d, b, e = self._legs(position)
        return np.vstack((b / e, -d / e))

    def dynamics(self, position: Array, velocity: Array) -> tuple[Array, Array, Array, Array]:
        """Mt, Ct, Ft, shape (2, 2) each, and S, shape (3, 2): M and C of the open chains, reduced by W (5.13)."""
        phi, d, b, e = self._legs(position)
        W = np.vstack((b / e, -d / e))
        theta_rate, phi_rate = (W @ velocity).reshape(2, 3)
        b_rate = (theta_rate + phi_rate)[:, None] * np.column_stack((-b[:, 1], b[:, 0]))
        e_rate = (self.length**2 * np.cos(phi) * phi_rate)[:, None]
        W_rate = np.vstack((b_rate / e - b * e_rate / e**2, -velocity / e + d * e_rate / e**2))
        bend, swing, across = self.beta * np.cos(phi), self.beta * np.sin(phi), np.diag(self.gamma)
        M = np.block(
            [[np.diag(self.alpha + 2.0 * bend), across + np.diag(bend)], [across + np.diag(bend), np.diag(self.gamma)]]
        )
        C = np.block(
            [
                [np.diag(-swing * phi_rate), np.diag(-swing * (theta_rate + phi_rate))],
                [np.diag(swing * theta_rate), np.zeros((3, 3))],
            ]
        )
        return W.T @ M @ W, W.T @ M @ W_rate + W.T @ C @ W, W.T @ self.viscous @ W, W[:3]

    def _legs(self, position: Array) -> tuple[Array, Array, Array, Array]:
        """Passive angles phi, shape (3,) [rad]; d and b, shape (3, 2) [m]; e = L² sin phi, shape (3, 1) [m²]."""
        theta, phi = self.angles(position)
        b = self.length * np.column_stack((np.cos(theta + phi), np.sin(theta + phi)))
        return phi, position - self.bases, b, (self.length**2 * np.sin(phi))[:, None]

    def distribute(self, position: Array, force: Array) -> Array:
        """S (S'S)^-1 F / n, shape (3,) [N·m at the motor] (5.15)."""
        S = self.jacobian(position)[:3]
        return S @ cast("Array", np.linalg.solve(S.T @ S, force) / self.gear)

    def task_velocity(self, position: Array, theta_rate: Array) -> Array:
        """The least-squares solution of S v = thetadot, shape (2,) [m/s]."""
        S = self.jacobian(position)[:3]
        return cast("Array", np.linalg.solve(S.T @ S, S.T @ theta_rate))

    def acceleration(self, position: Array, velocity: Array, tau_m: Array) -> Array:
        """Mt^-1 (n S' tau_m - Ct v - Ft v), shape (2,) [m/s²]."""
        Mt, Ct, Ft, S = self.dynamics(position, velocity)
        return cast("Array", np.linalg.solve(Mt, self.gear * S.T @ tau_m - Ct @ velocity - Ft @ velocity))

    def conditioning(self, position: Array) -> float:
        """sigma_min / sigma_max of S."""
        sigma = np.linalg.svd(self.jacobian(position)[:3], compute_uv=False)
        return float(sigma[-1] / sigma[0])

    def singularity_distance(self, position: Array, direct: Array) -> float:
        """How far the nearest singular pose is [m].

        Args:
            position: End-effector, shape (2,) [m].
            direct: Where all distal links stand in a line, shape (m, 2) [m].
        """
        legs = np.linalg.norm(position - self.bases, axis=1)
        others = np.linalg.norm(position - direct, axis=1)
        return float(np.min(np.concatenate((legs, 2.0 * self.length - legs, others))))

    def step(self, position: Array, velocity: Array, tau_m: Array, h: float) -> tuple[Array, Array]:
        """Position and velocity after `h` [s] of constant motor torques: classic Runge-Kutta."""
        v1, a1 = velocity, self.acceleration(position, velocity, tau_m)
        v2 = velocity + h / 2.0 * a1
        a2 = self.acceleration(position + h / 2.0 * v1, v2, tau_m)
        v3 = velocity + h / 2.0 * a2
        a3 = self.acceleration(position + h / 2.0 * v2, v3, tau_m)
        v4 = velocity + h * a3
        a4 = self.acceleration(position + h * v3, v4, tau_m)
        return (
            position + h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4),
            velocity + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4),
        )
