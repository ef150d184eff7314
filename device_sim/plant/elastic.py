"""The planar manipulator as a machine whose gears give: encoders sit on the motors and do not see the wind-up."""

from dataclasses import replace
from math import isfinite, sqrt
from typing import Final

import numpy as np
import numpy.typing as npt

from torquerig.device_sim.plant import elastic_motion as motion
from torquerig.device_sim.plant.friction import Friction
from torquerig.device_sim.plant.logged import NANOSECOND, LoggedMachine, Motors
from torquerig.device_sim.plant.motion import inside
from torquerig.device_sim.plant.truth_log import TruthLog
from torquerig.mechanism import HOME, Manipulator

Array = npt.NDArray[np.float64]

LONGEST_STEP: Final = 50e-6
"""[s]; half the rigid machine's: velocity Verlet is of second order, not of fourth."""
OF_A_PERIOD: Final = 0.1
"""The longest step as a share of one over the springs' greatest angular frequency."""
STIFFEST: Final = 1e-6
"""Compliance below which a gear counts as rigid [rad/(N·m)]: what the motor's peak torque, 0.98 N·m through a gear of
25, winds it up is less than an encoder count at the joint."""
RELAXATION: Final = 3e-4
"""Damping over stiffness of a gear [s]: about 5 % of critical at 700 N·m/rad on the thesis' links. Our choice."""


class ElasticManipulatorMachine(LoggedMachine):
    """The manipulator at rest at a start position, its gears not wound up, torques zero; satisfies `Machine`.

    Dry friction is the motors' and gears' own. At the edge of the workspace the links meet a rigid inelastic stop. The
    truth's log has the links' position, velocity and theta.
    """

    def __init__(
        self,
        manipulator: Manipulator,
        friction: Friction,
        compliance: float,
        *,
        relaxation: float = RELAXATION,
        lag: float = 1e-4,
        position: tuple[float, float] = HOME,
        step_ns: int = 100_000,
        start_ns: int = 0,
        log: TruthLog | None = None,
    ) -> None:
        """The machine at rest.

        Args:
            manipulator: The true machine, viscous friction included.
            friction: Dry friction of motors and gears, on the joint side.
            compliance: Wind-up of each gear a torque [rad/(N·m) at the joint].
            relaxation: Damping over stiffness of each gear [s].
            lag: Time constant of the current loops; 0: torque is demand [s].
            position: Where the end-effector stands [m].
            step_ns: Longest integration step [ns].
            start_ns: The machine's first instant [ns].
            log: Where to keep the truth.

        Raises:
            ReachError: A leg cannot reach the position.
            ValueError: The position lies at the workspace's edge, motors have no inertia, or a number is out of range.
        """
        _require(manipulator, compliance=compliance, relaxation=relaxation, lag=lag, step_ns=step_ns)
        theta = manipulator.inverse_kinematics(position).theta
        super().__init__(start_ns, log)
        self._constants = replace(manipulator, actuator_inertia=0.0, active_viscous=0.0).packed
        self._state = np.zeros(motion.STATE)
        self._state[motion.ANGLE : motion.RATE] = theta
        self._state[motion.POSITION : motion.VELOCITY] = position
        if not inside(self._constants, (*position, 0.0, 0.0)):
            raise ValueError(f"position {position} m is too near a singular pose to stand at")
        step = min(step_ns * NANOSECOND, LONGEST_STEP, OF_A_PERIOD / _fastest(manipulator, position, compliance))
        damping = relaxation / compliance
        self._parameters = np.array(
            [
                manipulator.actuator_inertia,
                manipulator.active_viscous,
                *friction.coulomb,
                *friction.breakaway,
                *(lag, 1.0 / compliance, damping, step),
            ]
        )
        self._seen = np.zeros(motion.SEEN)
        self._begin(
            Motors(
                demand=self._state[motion.DEMAND : motion.DEMAND + 3],
                torque=self._state[motion.TORQUE : motion.TORQUE + 3],
                angle=self._state[motion.ANGLE : motion.ANGLE + 3],
                rate=self._state[motion.RATE : motion.RATE + 3],
                gear=manipulator.gear_ratio,
                is_prompt=lag == 0.0,
            )
        )

    @property
    def position(self) -> Array:
        """The end-effector's true position at `now_ns`, shape (2,) [m]."""
        return self._state[motion.POSITION : motion.VELOCITY].copy()

    @property
    def velocity(self) -> Array:
        """The end-effector's true velocity at `now_ns`, shape (2,) [m/s]."""
        return self._state[motion.VELOCITY : motion.TORQUE].copy()

    @property
    def wind_up(self) -> Array:
        """How far each gear is wound up at `now_ns`, shape (3,) [rad at the joint]."""
        return self._state[motion.ANGLE : motion.RATE] - self._seen[4:7]

    @property
    def stops(self) -> int:
        """How many times the links have run into the edge of their workspace."""
        return int(self._state[motion.STOPS])

    def _integrate(self, duration: float) -> None:
        motion.advance(self._constants, self._parameters, self._state, self._seen, duration)

    def _row(self) -> Array:
        return self._seen


def _fastest(manipulator: Manipulator, position: tuple[float, float], compliance: float) -> float:
    """The greatest angular frequency of links and motors on their springs at a position [rad/s].

    K S'S v against Mt a for the links, K against I1 for a motor: the two add up, as springs between two masses do.
    """
    links = replace(manipulator, actuator_inertia=0.0)
    S = manipulator.jacobians(position)[1]
    greatest = float(np.max(np.linalg.eigvals(np.linalg.solve(links.task_inertia(position), S.T @ S)).real))
    return sqrt((greatest + 1.0 / manipulator.actuator_inertia) / compliance)


def _require(manipulator: Manipulator, *, compliance: float, relaxation: float, lag: float, step_ns: int) -> None:
    if not manipulator.actuator_inertia > 0.0:
        raise ValueError("actuator_inertia is 0: a motor behind an elastic gear needs an inertia")
    if not (isfinite(compliance) and compliance >= STIFFEST):
        raise ValueError(f"compliance is {compliance} rad/(N·m): must be at least {STIFFEST}, below it a gear is rigid")
    for name, value in (("relaxation", relaxation), ("lag", lag)):
        if not (isfinite(value) and value >= 0.0):
            raise ValueError(f"{name} is {value} s: must be finite and not below 0")
    if step_ns <= 0:
        raise ValueError(f"step_ns is {step_ns}: must be above 0")
