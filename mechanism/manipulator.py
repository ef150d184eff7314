"""The planar 3-RRR manipulator: two freedoms, three actuated legs (thesis, chapter 5; misprints: docs/mechanism.md).

q = (theta_1, theta_2, theta_3, phi_1, phi_2, phi_3): world angles of the proximal links, and angles of the distal
links relative to them. Positions, velocities and forces are in the plane of the links; there is no gravity in it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from torquerig.mechanism import kernels, singularities, solvers
from torquerig.mechanism.parameters import (
    LEGS,
    THESIS_DISTAL,
    THESIS_PROXIMAL,
    Links,
    Point,
    Triple,
    facings,
    inertia_constants,
    pack,
    require_not_negative,
    require_positive,
    signs,
    vector,
)
from torquerig.mechanism.status import require_ok
from torquerig.mechanism.values import Array, JointAngles, TaskDynamics

HOME: Final[Point] = (0.092, 0.062)
"""The end-effector's home [m] (5.3)."""


@dataclass(frozen=True, slots=True)
class Manipulator:
    """Geometry, working mode and inertia of a 3-RRR manipulator, and its equations.

    Every method takes any sequence and leaves it as it was. What is asked at a position raises ReachError where a leg
    is too short, and, if it needs W, SingularPoseError where one is stretched or folded.

    Attributes:
        bases: The three actuated base joints [m].
        link_length: Of every link [m].
        proximal: Links from base joint to elbow.
        distal: Links from elbow to end-effector.
        actuator_inertia: I1, motor and gear at the joint, each active joint [kg·m²].
        active_viscous: K1, on thetadot [N·m·s/rad].
        passive_viscous: K2, on phidot [N·m·s/rad].
        gear_ratio: Motor revolutions per joint revolution.
        branches: Working mode: each leg's elbow sign, +1 or -1.
    """

    bases: tuple[Point, Point, Point]
    link_length: float
    proximal: Links
    distal: Links
    actuator_inertia: float
    active_viscous: float
    passive_viscous: float
    gear_ratio: float
    branches: tuple[int, int, int] = (1, 1, 1)
    _packed: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        require_positive("link_length", self.link_length)
        require_positive("gear_ratio", self.gear_ratio)
        for name in ("actuator_inertia", "active_viscous", "passive_viscous"):
            require_not_negative(name, getattr(self, name))
        if len(set(self.bases)) != LEGS:
            raise ValueError(f"bases are {self.bases}: must be three different points")
        alpha, beta, gamma = self.inertia_constants()
        branches = signs(self.branches)
        direct = singularities.direct_singularities(self.bases, self.link_length, self.branches)
        packed = pack(
            {
                kernels.BASES: np.ravel(self.bases).tolist(),
                kernels.LENGTH: self.link_length,
                kernels.ALPHA: [value + self.actuator_inertia for value in alpha],
                kernels.BETA: beta,
                kernels.GAMMA: gamma,
                kernels.K1: self.active_viscous,
                kernels.K2: self.passive_viscous,
                kernels.GEAR: self.gear_ratio,
                kernels.BRANCH: branches,
                kernels.FACING: facings(self.bases),
                kernels.DIRECT_COUNT: float(len(direct)),
                kernels.DIRECT: np.ravel(direct).tolist(),
            }
        )
        object.__setattr__(self, "_packed", packed)

    @classmethod
    def thesis(cls) -> Self:
        """The machine of the thesis: Table 5.1, and I1, K1, K2 as identified in 5.4.2."""
        return cls(
            bases=((0.0, 0.062), (0.184, 0.0), (0.184, 0.124)),
            link_length=0.070,
            proximal=THESIS_PROXIMAL,
            distal=THESIS_DISTAL,
            actuator_inertia=0.0289,
            active_viscous=0.8315,
            passive_viscous=0.0938,
            gear_ratio=25.0,
        )

    @property
    def packed(self) -> Array:
        """The constants as the compiled kernels take them, a copy, shape (kernels.PACKED,)."""
        return self._packed.copy()

    @property
    def constants(self) -> Array:
        """The same without a copy, for kernels that are called in every cycle; nobody writes to it."""
        return self._packed

    @property
    def direct_singularities(self) -> list[Point]:
        """Where all three distal links stand in a line, in the working mode [m]; the thesis' machine: nowhere."""
        return singularities.direct_singularities(self.bases, self.link_length, self.branches)

    def inertia_constants(self) -> tuple[Triple, Triple, Triple]:
        """alpha, beta, gamma of the three legs' links, without the actuators [kg·m²] (5.8, Table 5.2)."""
        return inertia_constants(self.proximal, self.distal, self.link_length)

    def inverse_kinematics(self, position: npt.ArrayLike, branches: Sequence[int] | None = None) -> JointAngles:
        """The joint angles at a position (5.6).

        theta is continuous over all of the workspace between the bases; its cut lies behind each base joint.

        Args:
            position: End-effector, shape (2,) [m].
            branches: Elbow signs, three of +1 or -1; default: the working mode.

        Raises:
            ReachError: A leg is too short; the message names leg, distance and reach.
        """
        packed = self._packed
        if branches is not None:
            packed = packed.copy()
            packed[kernels.BRANCH : kernels.BRANCH + LEGS] = signs(branches)
        x = vector(position, 2)
        angles = JointAngles(np.empty(LEGS), np.empty(LEGS))
        self._require(kernels.inverse_kinematics(packed, x, angles.theta, angles.phi), x)
        return angles

    def forward_kinematics(self, theta: npt.ArrayLike) -> Array:
        """The end-effector's position from the active joints, shape (2,) [m] (5.3, 5.4, denominator put right).

        With measured angles: the point at equal distance from the three elbows (`closure_residuals` says how far
        that distance is from a link).

        Raises:
            SingularPoseError: The elbows stand in a line.
        """
        return self._forward_kinematics(theta)[0]

    def closure_residuals(self, theta: npt.ArrayLike) -> Array:
        """|C - B_i| - L of each leg at measured angles, shape (3,) [m]: zero if homing and geometry are right."""
        return self._forward_kinematics(theta)[1]

    def jacobians(self, position: npt.ArrayLike) -> tuple[Array, Array]:
        """W, shape (6, 2), qdot = W v, and S, its first three rows, thetadot = S v [1/m] (5.12)."""
        W = self._rates(position, (0.0, 0.0))[0]
        return W, W[:LEGS].copy()

    def jacobian_rates(self, position: npt.ArrayLike, velocity: npt.ArrayLike) -> Array:
        """Wdot at a position and velocity, shape (6, 2) [1/(m·s)]."""
        return self._rates(position, velocity)[1]

    def joint_rates(self, position: npt.ArrayLike, velocity: npt.ArrayLike) -> Array:
        """Rates of all joints, qdot = W v, in the order of q, shape (6,) [rad/s]."""
        rates: Array = self._rates(position, (0.0, 0.0))[0] @ vector(velocity, 2)
        return rates

    def task_velocity(self, position: npt.ArrayLike, theta_rate: npt.ArrayLike) -> Array:
        """The velocity that fits three measured joint rates best, v = S^+ thetadot, shape (2,) [m/s]."""
        x, velocity = vector(position, 2), np.empty(2)
        self._require(solvers.task_velocity(self._packed, x, vector(theta_rate, LEGS), velocity), x)
        return velocity

    def dynamics(self, position: npt.ArrayLike, velocity: npt.ArrayLike) -> TaskDynamics:
        """Mt, Ct, Ft and S in one compiled call: the control laws' way."""
        x = vector(position, 2)
        out = np.empty((9, 2))
        self._require(kernels.task_dynamics(self._packed, x, vector(velocity, 2), out), x)
        return TaskDynamics(out[:2], out[2:4], out[4:6], out[6:])

    def task_inertia(self, position: npt.ArrayLike) -> Array:
        """Mt = W'MW, shape (2, 2) [kg]."""
        return self.dynamics(position, (0.0, 0.0)).Mt

    def task_coriolis(self, position: npt.ArrayLike, velocity: npt.ArrayLike) -> Array:
        """Ct = W'M Wdot + W'CW, shape (2, 2) [kg/s]; Mt_dot - 2 Ct is skew symmetric."""
        return self.dynamics(position, velocity).Ct

    def task_viscous(self, position: npt.ArrayLike) -> Array:
        """Ft = W'FW, shape (2, 2) [N·s/m]."""
        return self.dynamics(position, (0.0, 0.0)).Ft

    def distribute(self, position: npt.ArrayLike, force: npt.ArrayLike) -> Array:
        """The smallest motor torques that give a task force: S (S'S)^-1 F / n, shape (3,) [N·m].

        Args:
            position: End-effector, shape (2,) [m].
            force: Wanted at the end-effector, shape (2,) [N].
        """
        x, tau_m = vector(position, 2), np.empty(LEGS)
        self._require(solvers.distribute(self._packed, x, vector(force, 2), tau_m), x)
        return tau_m

    def conditioning(self, position: npt.ArrayLike) -> float:
        """sigma_min / sigma_max of S: 1 the same in all directions, 0 at a singularity of any kind."""
        x = vector(position, 2)
        at_x, at_y = x.tolist()
        status = kernels.reach_status(self._packed, at_x, at_y)
        if status < kernels.SINGULAR_LEG:
            self._require(status, x)
        return singularities.conditioning(self._packed, at_x, at_y)

    def singularity_distance(self, position: npt.ArrayLike) -> float:
        """How far the end-effector may be moved, in any direction, before the machine is singular [m].

        Singular is where a leg is stretched or folded, or all distal links stand in a line, in the working mode. The
        distance is along a straight line; it is below 0 where a leg cannot reach.
        """
        x, y = vector(position, 2).tolist()
        return singularities.singularity_distance(self._packed, x, y)

    def forward_dynamics(self, position: npt.ArrayLike, velocity: npt.ArrayLike, tau_m: npt.ArrayLike) -> Array:
        """The acceleration Mt^-1 (n S' tau_m - Ct v - Ft v), shape (2,) [m/s²]; no dry friction.

        Args:
            position: End-effector, shape (2,) [m].
            velocity: End-effector, shape (2,) [m/s].
            tau_m: Motor torques, shape (3,) [N·m].
        """
        x, acceleration = vector(position, 2), np.empty(2)
        status = solvers.forward_dynamics(self._packed, x, vector(velocity, 2), vector(tau_m, LEGS), acceleration)
        self._require(status, x)
        return acceleration

    def inverse_dynamics(self, position: npt.ArrayLike, velocity: npt.ArrayLike, acceleration: npt.ArrayLike) -> Array:
        """The smallest motor torques for an acceleration, viscous friction included, shape (3,) [N·m]."""
        x, force, tau_m = vector(position, 2), np.empty(2), np.empty(LEGS)
        v, a = vector(velocity, 2), vector(acceleration, 2)
        self._require(solvers.inverse_dynamics(self._packed, x, v, a, force, tau_m), x)
        return tau_m

    def joint_inertia(self, phi: npt.ArrayLike) -> Array:
        """M of the three open chains with their actuators, in the order of q, shape (6, 6) [kg·m²] (5.7, 5.10)."""
        alpha, beta, gamma = self._packed[kernels.ALPHA : kernels.ALPHA + 3 * LEGS].reshape(3, LEGS)
        bend = beta * np.cos(vector(phi, LEGS))
        across = np.diag(gamma + bend)
        return np.block([[np.diag(alpha + 2.0 * bend), across], [across, np.diag(gamma)]])

    def joint_coriolis(self, phi: npt.ArrayLike, rates: npt.ArrayLike) -> Array:
        """C of the three open chains in the order of q, shape (6, 6) [kg·m²/s] (5.7, 5.10).

        Args:
            phi: Distal angles, shape (3,) [rad].
            rates: qdot, shape (6,) [rad/s].
        """
        swing = self._packed[kernels.BETA : kernels.BETA + LEGS] * np.sin(vector(phi, LEGS))
        theta_rate, phi_rate = vector(rates, 2 * LEGS).reshape(2, LEGS)
        along, across = np.diag(-swing * phi_rate), np.diag(-swing * (theta_rate + phi_rate))
        return np.block([[along, across], [np.diag(swing * theta_rate), np.zeros((LEGS, LEGS))]])

    def _forward_kinematics(self, theta: npt.ArrayLike) -> tuple[Array, Array]:
        position, residuals = np.empty(2), np.empty(LEGS)
        self._require(kernels.forward_kinematics(self._packed, vector(theta, LEGS), position, residuals), position)
        return position, residuals

    def _rates(self, position: npt.ArrayLike, velocity: npt.ArrayLike) -> tuple[Array, Array]:
        x, out = vector(position, 2), np.empty((4 * LEGS, 2))
        self._require(kernels.jacobians(self._packed, x, vector(velocity, 2), out), x)
        return out[: 2 * LEGS], out[2 * LEGS :]

    def _require(self, status: int, position: Array) -> None:
        """Turns a kernel's status other than OK into the error that says why."""
        if status != kernels.OK:
            require_ok(status, position, self.bases, self.link_length)
