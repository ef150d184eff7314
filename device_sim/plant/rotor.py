"""Bare rotors: motors that turn nothing but themselves, each on its own."""

from dataclasses import dataclass
from math import isfinite
from typing import Final

import numpy as np
import numpy.typing as npt

from torquerig.device_sim.plant import spin

Array = npt.NDArray[np.float64]

STEP: Final = 1e-4  # longest integration step [s]


@dataclass(frozen=True, slots=True)
class RotorParameters:
    """A rotor and its current loop, all on the motor's side.

    Attributes:
        inertia: [kg·m²].
        viscous: [N·m·s/rad].
        coulomb: While it turns, against its motion [N·m].
        breakaway: The most that friction holds at rest, never below `coulomb` [N·m].
        lag: Time constant of the current loop; 0: torque is demand [s].

    Raises:
        ValueError: A value is out of range.
    """

    inertia: float
    viscous: float = 0.0
    coulomb: float = 0.0
    breakaway: float = 0.0
    lag: float = 1e-4

    def __post_init__(self) -> None:
        least = {"viscous": 0.0, "coulomb": 0.0, "breakaway": self.coulomb, "lag": 0.0}
        for name, bound in least.items():
            value = getattr(self, name)
            if not (isfinite(value) and value >= bound):
                raise ValueError(f"{name} is {value}: must be finite and not below {bound}")
        if not (isfinite(self.inertia) and self.inertia > 0.0):
            raise ValueError(f"inertia is {self.inertia} kg·m²: must be finite and above 0")


class BareRotor:
    """Equal rotors at rest at angle 0, torques and demands zero; satisfies `Machine`.

    Attributes:
        axes: Number of rotors.
    """

    def __init__(self, parameters: RotorParameters, *, axes: int = 1, start_ns: int = 0) -> None:
        """The rotors at rest.

        Args:
            parameters: The same for all.
            axes: How many.
            start_ns: Their first instant [ns].
        """
        if axes < 1:
            raise ValueError(f"axes is {axes}: must be at least 1")
        self.axes = axes
        self._parameters = np.array(
            [parameters.inertia, parameters.viscous, parameters.coulomb, parameters.breakaway, parameters.lag, STEP]
        )
        self._states = np.zeros((axes, spin.STATE))
        self._states[:, spin.SIGN] = 0.0 if parameters.breakaway > 0.0 else 1.0
        self._now_ns = start_ns
        spin.spin_all(self._parameters, self._states, 0.0)  # compiled here and now, not at the first deadline

    @property
    def now_ns(self) -> int:
        """The instant up to which the rotors have been advanced [ns]."""
        return self._now_ns

    @property
    def position(self) -> Array:
        """The shafts' true angles at `now_ns`, shape (axes,) [rad]."""
        return self._states[:, spin.ANGLE].copy()

    @property
    def velocity(self) -> Array:
        """The shafts' true velocities at `now_ns`, shape (axes,) [rad/s]."""
        return self._states[:, spin.RATE].copy()

    def set_torque_demand(self, axis: int, torque: float, at_ns: int) -> None:
        """From `at_ns` on one motor heads for this torque [N·m].

        Raises:
            ValueError: The torque is not finite, the axis does not exist, or the time has passed.
        """
        if not isfinite(torque):
            raise ValueError(f"torque of axis {axis} is {torque} N·m: must be finite")
        self._advance(axis, at_ns)
        self._states[axis, spin.DEMAND] = torque
        if self._parameters[spin.LAG] == 0.0:
            self._states[axis, spin.TORQUE] = torque

    def motor_angle(self, axis: int, at_ns: int) -> float:
        """Angle of a shaft, not wrapped [rad]."""
        self._advance(axis, at_ns)
        return self._states.item(axis, spin.ANGLE)

    def motor_velocity(self, axis: int, at_ns: int) -> float:
        """Velocity of a shaft [rad/s]; exactly 0 while friction holds it."""
        self._advance(axis, at_ns)
        return self._states.item(axis, spin.RATE)

    def motor_torque(self, axis: int, at_ns: int) -> float:
        """Torque of a motor after its current loop's lag [N·m]."""
        self._advance(axis, at_ns)
        return self._states.item(axis, spin.TORQUE)

    def _advance(self, axis: int, at_ns: int) -> None:
        """Carry all rotors to `at_ns`, when one of them is asked about."""
        if not 0 <= axis < self.axes:
            raise ValueError(f"axis is {axis}: the machine has axes 0 to {self.axes - 1}")
        if at_ns < self._now_ns:
            raise ValueError(f"time {at_ns} ns has passed: the machine stands at {self._now_ns} ns")
        if at_ns > self._now_ns:
            spin.spin_all(self._parameters, self._states, (at_ns - self._now_ns) * 1e-9)
            self._now_ns = at_ns
