"""Soft limits that stop the machine before its mechanics do, and the check of a whole reference before it moves."""

import math
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from torquerig.control.errors import LimitExceeded
from torquerig.control.law import Desired, State
from torquerig.control.limit_check import within
from torquerig.control.reference import ReferenceTable
from torquerig.mechanism import Manipulator
from torquerig.mechanism.kernels import PACKED


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds on what the machine may be in and what may be asked of it.

    Every check is written so that NaN violates it.

    Attributes:
        x: Least and greatest x of the end-effector [m].
        y: Least and greatest y of the end-effector [m].
        conditioning: Least sigma_min(S)/sigma_max(S): how much weaker the weakest direction may be than the strongest.
        joint_speed: Greatest joint rate [rad/s].
        position_error: Greatest distance between desired and measured position [m].
        torque: Greatest torque that is commanded; more is cut to it [N·m at the motor].
        torque_stop: Greatest torque that a law may ask for; more stops the machine [N·m at the motor].
        singularity_distance: Least straight-line distance of the end-effector to a singular pose [m].
        bounds: All of them as kernels take them, in the layout of `limit_check`.
    """

    x: tuple[float, float]
    y: tuple[float, float]
    conditioning: float
    joint_speed: float
    position_error: float
    torque: float
    torque_stop: float
    singularity_distance: float = 0.0
    bounds: NDArray[np.float64] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Lay the bounds out for `within`, and have it compiled now, not in the first cycle."""
        place = (*self.x, *self.y, self.conditioning, self.singularity_distance)
        rest = (self.joint_speed, self.position_error, self.torque, self.torque_stop)
        object.__setattr__(self, "bounds", np.array((*place, *rest), dtype=np.float64))
        within(np.zeros(PACKED), self.bounds, *[math.nan] * 7)

    def check_state(self, model: Manipulator, state: State, desired: Desired) -> None:
        """Hold the measured state against the limits.

        Args:
            model: The manipulator as the controller knows it.
            state: The manipulator as measured.
            desired: What the reference asks for now.

        Raises:
            LimitExceeded: If it is outside the workspace, badly conditioned, near a singular pose, too fast or too far
                from the reference.
            ReachError: If a leg cannot get there.
        """
        x, y = state.position.tolist()
        x_d, y_d = desired.position.tolist()
        if not within(model.constants, self.bounds, x, y, x_d, y_d, *state.qd.tolist()):
            self.refuse(model, state, desired)

    def refuse(self, model: Manipulator, state: State, desired: Desired) -> NoReturn:
        """Say which limit is violated first.

        Args:
            model: The manipulator as the controller knows it.
            state: The manipulator as measured; outside the limits.
            desired: What the reference asks for now.

        Raises:
            LimitExceeded, ReachError: As `check_state`.
        """
        self._check_place(model, state.position)
        self._check_rates(state.qd)
        error = math.dist(desired.position.tolist(), state.position.tolist())
        raise LimitExceeded("position error", "end-effector", error, self.position_error, "m")

    def clip(self, tau: NDArray[np.float64], command: NDArray[np.float64]) -> int:
        """Cut motor torques to the torque limit.

        Args:
            tau: What the law asks for, shape (3,) [N·m at the motor].
            command: Filled with what may be commanded, shape (3,) [N·m at the motor].

        Returns:
            How many axes were cut.

        Raises:
            LimitExceeded: If a torque is beyond `torque_stop` or not a number.
        """
        clipped = 0
        for i, value in enumerate(tau.tolist()):
            size = abs(value)
            if not size <= self.torque_stop:
                raise LimitExceeded("torque", f"joint {i + 1}", value, self.torque_stop, "N·m")
            if size > self.torque:
                clipped += 1
                command[i] = math.copysign(self.torque, value)
            else:
                command[i] = value
        return clipped

    def check_reference(self, model: Manipulator, table: ReferenceTable) -> None:
        """Hold a whole reference table against the limits, before anything moves.

        Args:
            model: The manipulator as the controller knows it.
            table: The table.

        Raises:
            LimitExceeded: If a row leaves the workspace, is too badly conditioned, too near a singular pose or too
                fast for a joint.
            ReachError: If a leg cannot get there.
        """
        for position, qd in zip(table.position, table.qd, strict=True):
            x, y = position.tolist()
            if not within(model.constants, self.bounds, x, y, x, y, *qd.tolist()):
                self._check_place(model, position)
                self._check_rates(qd)

    def _check_place(self, model: Manipulator, position: NDArray[np.float64]) -> None:
        """Hold a position, shape (2,) [m], against the workspace and the singularities in it."""
        for axis, value, (low, high) in zip("xy", position.tolist(), (self.x, self.y), strict=True):
            if not low <= value <= high:
                raise LimitExceeded("workspace", axis, value, low if value < low else high, "m")
        ratio = model.conditioning(position)
        if not ratio >= self.conditioning:
            raise LimitExceeded("conditioning", "S", ratio, self.conditioning, "")
        distance = model.singularity_distance(position)
        if not distance >= self.singularity_distance:
            raise LimitExceeded("singularity distance", "end-effector", distance, self.singularity_distance, "m")

    def _check_rates(self, qd: NDArray[np.float64]) -> None:
        """Hold joint rates, shape (3,) [rad/s], against the joint speed."""
        for i, rate in enumerate(qd.tolist()):
            if not abs(rate) <= self.joint_speed:
                raise LimitExceeded("joint speed", f"joint {i + 1}", rate, self.joint_speed, "rad/s")
