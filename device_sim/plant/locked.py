"""Locked rotors on the calibration bench: their motors cannot turn, and what friction lets through is measured."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite

from torquerig.device_sim.machine import Machine
from torquerig.device_sim.plant.motor import remaining_share
from torquerig.device_sim.plant.truth_log import TruthLog


@dataclass(frozen=True, slots=True)
class LockParameters:
    """A locked rotor and its current loop.

    Attributes:
        friction: The most that dry friction between the winding and the transducer holds [N·m at the motor].
        lag: Time constant of the current loop; 0: torque is demand [s].

    Raises:
        ValueError: A value is out of range.
    """

    friction: float = 0.0
    lag: float = 1e-4

    def __post_init__(self) -> None:
        for name in ("friction", "lag"):
            value = getattr(self, name)
            if not (isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is {value}: must be finite and not below 0")


class _Lock:
    """One locked rotor: the motor's torque, and the shaft's behind friction's play."""

    __slots__ = ("_demand", "_now_ns", "_parameters", "shaft", "torque")

    def __init__(self, parameters: LockParameters, start_ns: int) -> None:
        self.torque = 0.0
        self.shaft = 0.0
        self._demand = 0.0
        self._now_ns = start_ns
        self._parameters = parameters

    def advance(self, at_ns: int) -> None:
        """Let the current loop go on; its torque heads one way between two demands, so that the ends are enough."""
        if at_ns < self._now_ns:
            raise ValueError(f"time {at_ns} ns has passed: the lock stands at {self._now_ns} ns")
        if at_ns > self._now_ns:
            lag = self._parameters.lag
            share = remaining_share((at_ns - self._now_ns) * 1e-9, lag) if lag else 0.0
            self._move(self._demand + share * (self.torque - self._demand))
            self._now_ns = at_ns

    def demand(self, torque: float, at_ns: int) -> None:
        """Head for another torque."""
        self.advance(at_ns)
        self._demand = torque
        if self._parameters.lag == 0.0:
            self._move(torque)

    def _move(self, torque: float) -> None:
        friction = self._parameters.friction
        self.torque = torque
        self.shaft = min(max(self.shaft, torque - friction), torque + friction)


class LockedRotors:
    """A machine some of whose rotors are locked; satisfies `Machine`. The others turn as before.

    The transducer feels a motor's torque less what friction holds. Friction is Coulomb's at a lock that gives a little:
    it holds against the change of torque, up to `friction`, so the shaft's torque follows the motor's with a play of
    twice that. On the way up it is short of the motor's torque by the friction, on the way down it exceeds it by as
    much: the intercepts of the thesis' Figure 5.5, and hysteresis.

    Attributes:
        axes: As many as the machine has.
        locked: Which ones are locked, from 0.
        log: Rows of a manipulator's truth: none, for there is none.
    """

    def __init__(
        self, machine: Machine, locked: Iterable[int], parameters: LockParameters, *, start_ns: int = 0
    ) -> None:
        """Lock rotors that have no torque.

        Args:
            machine: What the motors turn else.
            locked: Which ones are locked, from 0.
            parameters: Of each lock.
            start_ns: Their first instant [ns].

        Raises:
            ValueError: The machine has no such axis.
        """
        self.axes = machine.axes
        self.locked = tuple(locked)
        self.log: TruthLog | None = None
        if not all(0 <= axis < machine.axes for axis in self.locked):
            raise ValueError(f"axes {self.locked}: the machine has axes 0 to {machine.axes - 1}")
        self._machine = machine
        self._locks = {axis: _Lock(parameters, start_ns) for axis in self.locked}
        self._angles = {axis: machine.motor_angle(axis, start_ns) for axis in self.locked}

    def set_torque_demand(self, axis: int, torque: float, at_ns: int) -> None:
        """From `at_ns` on one motor heads for this torque [N·m].

        Raises:
            ValueError: The torque is not finite, the axis does not exist, or the time has passed.
        """
        if axis not in self._locks:
            self._machine.set_torque_demand(axis, torque, at_ns)
        elif not isfinite(torque):
            raise ValueError(f"torque of axis {axis} is {torque} N·m: must be finite")
        else:
            self._locks[axis].demand(torque, at_ns)

    def motor_angle(self, axis: int, at_ns: int) -> float:
        """Angle of a shaft, not wrapped [rad]; of a locked one always the same."""
        angle = self._angles.get(axis)
        return self._machine.motor_angle(axis, at_ns) if angle is None else angle

    def motor_velocity(self, axis: int, at_ns: int) -> float:
        """Velocity of a shaft [rad/s]; of a locked one 0."""
        return 0.0 if axis in self._locks else self._machine.motor_velocity(axis, at_ns)

    def motor_torque(self, axis: int, at_ns: int) -> float:
        """Torque of a motor after its current loop's lag [N·m]."""
        lock = self._locks.get(axis)
        if lock is None:
            return self._machine.motor_torque(axis, at_ns)
        lock.advance(at_ns)
        return lock.torque

    def shaft_torque(self, at_ns: int) -> float:
        """What a transducer feels that is on the one locked shaft with torque: the sum over all of them [N·m]."""
        for lock in self._locks.values():
            lock.advance(at_ns)
        return sum(lock.shaft for lock in self._locks.values())
