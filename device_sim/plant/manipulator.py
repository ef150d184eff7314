"""The planar manipulator as a machine: three motors, their current loops, dry friction, the redundant mechanism."""

from math import isfinite
from typing import Final

import numpy as np
import numpy.typing as npt

from torquerig.device_sim.plant import integrator, layout
from torquerig.device_sim.plant.friction import Friction
from torquerig.device_sim.plant.logged import NANOSECOND, LoggedMachine, Motors
from torquerig.device_sim.plant.motion import inside
from torquerig.device_sim.plant.truth_log import TruthLog
from torquerig.mechanism import HOME, Manipulator

Array = npt.NDArray[np.float64]

LONGEST_STEP_NS: Final = 100_000


class PlanarManipulatorMachine(LoggedMachine):
    """The manipulator at rest at a start position, motor torques and demands zero; satisfies `Machine`.

    At the edge of the workspace, before any singularity, it meets a rigid inelastic stop. Making one compiles the
    integrator, or loads it from the disk cache: nothing is left to compile when time starts to count.
    """

    def __init__(
        self,
        manipulator: Manipulator,
        friction: Friction,
        *,
        lag: float = 1e-4,
        position: tuple[float, float] = HOME,
        step_ns: int = LONGEST_STEP_NS,
        start_ns: int = 0,
        log: TruthLog | None = None,
    ) -> None:
        """The machine at rest.

        Args:
            manipulator: The true machine, viscous friction included.
            friction: Dry friction of the active joints.
            lag: Time constant of the current loops; 0: torque is demand [s].
            position: Where the end-effector stands [m].
            step_ns: Longest integration step [ns].
            start_ns: The machine's first instant [ns].
            log: Where to keep the truth.

        Raises:
            ReachError: A leg cannot reach the position.
            ValueError: The position lies at the workspace's edge; or lag or step are out of range.
        """
        _require_settings(lag, step_ns)
        manipulator.inverse_kinematics(position)
        super().__init__(start_ns, log)
        self._constants = manipulator.packed
        self._parameters = np.array([*friction.coulomb, *friction.breakaway, lag, step_ns * NANOSECOND])
        self._state = np.zeros(layout.STATE)
        self._state[layout.POSITION : layout.POSITION + 2] = position
        self._state[layout.CAUTION] = 1.0
        self._seen = np.zeros(layout.SEEN)
        if not inside(self._constants, tuple(self._state[: layout.TORQUE].tolist())):
            raise ValueError(f"position {position} m is too near a singular pose to stand at")
        integrator.settle(self._constants, self._parameters, self._state)
        self._begin(
            Motors(
                demand=self._state[layout.DEMAND : layout.DEMAND + 3],
                torque=self._state[layout.TORQUE : layout.TORQUE + 3],
                angle=self._seen[layout.THETA : layout.THETA + 3],
                rate=self._seen[layout.THETA_RATE : layout.THETA_RATE + 3],
                gear=manipulator.gear_ratio,
                is_prompt=lag == 0.0,
            )
        )

    @property
    def position(self) -> Array:
        """The end-effector's true position at `now_ns`, shape (2,) [m]."""
        return self._state[layout.POSITION : layout.POSITION + 2].copy()

    @property
    def velocity(self) -> Array:
        """The end-effector's true velocity at `now_ns`, shape (2,) [m/s]."""
        return self._state[layout.VELOCITY : layout.VELOCITY + 2].copy()

    @property
    def at_rest(self) -> bool:
        """Whether friction holds all three joints."""
        return all(self.resting_joints)

    @property
    def resting_joints(self) -> tuple[bool, bool, bool]:
        """Which active joints friction holds."""
        a, b, c = (self._state[layout.SIGN : layout.SIGN + 3] == 0.0).tolist()
        return a, b, c

    @property
    def stops(self) -> int:
        """How many times it has run into the edge of its workspace."""
        return int(self._state[layout.STOPS])

    def _integrate(self, duration: float) -> None:
        integrator.advance(self._constants, self._parameters, self._state, self._seen, duration)

    def _row(self) -> Array:
        return self._seen[layout.TRUTH :]


def _require_settings(lag: float, step_ns: int) -> None:
    if not (isfinite(lag) and lag >= 0.0):
        raise ValueError(f"lag is {lag} s: must be finite and not below 0")
    if not 0 < step_ns <= LONGEST_STEP_NS:
        raise ValueError(f"step_ns is {step_ns}: must be above 0 and at most {LONGEST_STEP_NS}")
