"""What the simulated drives turn: the protocol between a drive and the plant."""

from typing import Protocol


class Machine(Protocol):
    """Motors and what hangs on them, advanced lazily to the times it is asked for.

    Times are absolute [ns] and only move forward: an earlier one than the last is a ValueError. Axes count from 0.
    """

    axes: int

    def set_torque_demand(self, axis: int, torque: float, at_ns: int) -> None:
        """From `at_ns` on the current loop of one motor heads for this torque [N·m at the motor]."""
        ...

    def motor_angle(self, axis: int, at_ns: int) -> float:
        """The motor shaft's angle, not wrapped [rad]."""
        ...

    def motor_velocity(self, axis: int, at_ns: int) -> float:
        """The motor shaft's velocity [rad/s]."""
        ...

    def motor_torque(self, axis: int, at_ns: int) -> float:
        """The torque the motor gives, after the current loop's lag [N·m]."""
        ...
