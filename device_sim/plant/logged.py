"""A machine that is advanced when somebody asks about it, and notes in a log what it really does."""

from abc import ABC, abstractmethod
from math import isfinite
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from torquerig.device_sim.plant.truth_log import TruthLog

NANOSECOND: Final = 1e-9  # [s]


class Motors(NamedTuple):
    """Where the motors stand in a machine's state: views that the integrator changes.

    Attributes:
        demand: Demanded torques, shape (3,) [N·m at the motor].
        torque: Torques that the motors give, shape (3,) [N·m at the motor].
        angle: Angles before the gears, as at the joint, shape (3,) [rad].
        rate: Their rates, shape (3,) [rad/s].
        gear: Gear ratio.
        is_prompt: Whether torque is demand at once, without a current loop's lag.
    """

    demand: npt.NDArray[np.float64]
    torque: npt.NDArray[np.float64]
    angle: npt.NDArray[np.float64]
    rate: npt.NDArray[np.float64]
    gear: float
    is_prompt: bool


class LoggedMachine(ABC):
    """Three motors, and the instant up to which they have been advanced.

    Attributes:
        axes: Number of motors.
        log: The truth's log, if one is kept.
    """

    axes = 3

    def __init__(self, start_ns: int, log: TruthLog | None) -> None:
        """The machine at its first instant [ns]; `_begin` is to be called when its state is there."""
        self.log = log
        self._now_ns = start_ns
        self._motors: Motors

    @property
    def motors(self) -> Motors:
        """Where the motors stand in its state: what is read there is of `now_ns`."""
        return self._motors

    @property
    def now_ns(self) -> int:
        """The instant up to which the machine has been advanced [ns]."""
        return self._now_ns

    def advance(self, to_ns: int) -> None:
        """Advances to an instant that nobody asks about.

        Raises:
            ValueError: The time has passed.
        """
        self._advance(0, to_ns)

    def set_torque_demand(self, axis: int, torque: float, at_ns: int) -> None:
        """From `at_ns` on one motor heads for this torque [N·m at the motor].

        Raises:
            ValueError: The torque is not finite, the axis does not exist, or the time has passed.
        """
        if not isfinite(torque):
            raise ValueError(f"torque of axis {axis} is {torque} N·m: must be finite")
        self._advance(axis, at_ns)
        self._motors.demand[axis] = torque
        if self._motors.is_prompt:
            self._motors.torque[axis] = torque

    def motor_angle(self, axis: int, at_ns: int) -> float:
        """Angle of a motor shaft, not wrapped [rad]."""
        self._advance(axis, at_ns)
        return self._motors.gear * self._motors.angle.item(axis)

    def motor_velocity(self, axis: int, at_ns: int) -> float:
        """Velocity of a motor shaft [rad/s]; exactly 0 while friction holds it."""
        self._advance(axis, at_ns)
        return self._motors.gear * self._motors.rate.item(axis)

    def motor_torque(self, axis: int, at_ns: int) -> float:
        """Torque of a motor after its current loop's lag [N·m]."""
        self._advance(axis, at_ns)
        return self._motors.torque.item(axis)

    @abstractmethod
    def _integrate(self, duration: float) -> None:
        """Carries the state over a duration [s], which may be 0; then `_row` is of its end."""

    @abstractmethod
    def _row(self) -> npt.NDArray[np.float64]:
        """A row for the log, as `TruthLog.append` takes it."""

    def _begin(self, motors: Motors) -> None:
        """Takes the motors, compiles the integrator here and now, and notes the first row."""
        self._motors = motors
        self._integrate(0.0)
        self._note()

    def _advance(self, axis: int, to_ns: int) -> None:
        """Advances to an instant at which somebody asks about an axis."""
        if not 0 <= axis < self.axes:
            raise ValueError(f"axis is {axis}: the machine has axes 0 to {self.axes - 1}")
        if to_ns == self._now_ns:
            return
        if to_ns < self._now_ns:
            raise ValueError(f"time {to_ns} ns has passed: the machine stands at {self._now_ns} ns")
        if self.log is None:
            self._integrate_to(to_ns)
        elif self.log.grid_ns is None:
            self._integrate_to(to_ns)
            self._note()
        else:
            grid = self.log.grid_ns
            for due_ns in range((self._now_ns // grid + 1) * grid, to_ns + 1, grid):
                self._integrate_to(due_ns)
                self._note()
            self._integrate_to(to_ns)

    def _integrate_to(self, to_ns: int) -> None:
        self._integrate((to_ns - self._now_ns) * NANOSECOND)
        self._now_ns = to_ns

    def _note(self) -> None:
        if self.log is not None:
            self.log.append(self._now_ns, self._row())
