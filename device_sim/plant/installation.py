"""A machine that is wired and coupled otherwise than its drives believe: the mistakes of an installation."""

from dataclasses import dataclass
from math import inf, isfinite
from typing import Final

from torquerig.device_sim.machine import Machine

NANOSECOND: Final = 1e-9  # [s]
ROTOR_INERTIA: Final = 0.098e-4  # [kg·m²] Sanyo Denki P50B05010D (thesis, Table A.1)
_FOREVER: Final = 1 << 62

Triple = tuple[float, float, float]
Legs = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Installation:
    """How three drives are connected to three legs; axes and legs count from 0.

    Attributes:
        motors: Which leg's motor the drive of each axis feeds.
        encoders: Which leg's encoder the drive of each axis reads.
        torque_sign: -1 where two motor leads of an axis are exchanged.
        encoder_sign: -1 where an encoder's A and B of an axis are exchanged.
        gear_factor: The gear that is fitted at each leg, as a multiple of the machine's own.
        coupling: Torque beyond which each leg's coupling slips [N·m at the motor].

    Raises:
        ValueError: Two axes share a motor or an encoder, a sign is none, or a factor or torque is not positive.
    """

    motors: Legs = (0, 1, 2)
    encoders: Legs = (0, 1, 2)
    torque_sign: Triple = (1.0, 1.0, 1.0)
    encoder_sign: Triple = (1.0, 1.0, 1.0)
    gear_factor: Triple = (1.0, 1.0, 1.0)
    coupling: Triple = (inf, inf, inf)

    def __post_init__(self) -> None:
        for legs in (self.motors, self.encoders):
            if sorted(legs) != [0, 1, 2]:
                raise ValueError(f"legs {legs}: each of 0, 1 and 2 must be there once")
        if not {*self.torque_sign, *self.encoder_sign} <= {-1.0, 1.0}:
            raise ValueError(f"signs {self.torque_sign} and {self.encoder_sign} must be -1 or 1")
        if not all(isfinite(factor) and factor > 0 for factor in self.gear_factor):
            raise ValueError(f"gear_factor {self.gear_factor} must be positive")
        if not all(torque > 0 for torque in self.coupling):
            raise ValueError(f"coupling {self.coupling} must be positive")

    def shows(self, torque: float) -> bool:
        """Whether it differs from a right one while no motor gives more than a torque [N·m at the motor]."""
        right = Installation(coupling=self.coupling)
        return self != right or min(self.coupling) < torque


class InstalledMachine:
    """A machine behind its installation; satisfies `Machine`.

    A coupling that slips passes on its torque, as a dry clutch does; what the motor has beyond it spins the rotor.

    Attributes:
        axes: Number of drives that it can be turned by.
    """

    axes = 3

    def __init__(self, machine: Machine, installation: Installation, *, start_ns: int = 0) -> None:
        """Connect it.

        Args:
            machine: The machine itself, its axes in the order of the legs.
            installation: How it is connected.
            start_ns: The machine's first instant [ns].
        """
        self._machine = machine
        self._wiring = installation
        self._now_ns = start_ns
        self._demand = [0.0, 0.0, 0.0]
        self._slip = [0.0, 0.0, 0.0]
        self._slip_rate = [0.0, 0.0, 0.0]

    def set_torque_demand(self, axis: int, torque: float, at_ns: int) -> None:
        """From `at_ns` on the motor that the axis' drive feeds heads for this torque [N·m at the motor]."""
        self._advance(at_ns)
        leg = self._wiring.motors[axis]
        self._demand[leg] = self._wiring.torque_sign[axis] * torque
        self._pass_on(leg, at_ns)

    def motor_angle(self, axis: int, at_ns: int) -> float:
        """What the axis' encoder shows of its shaft, not wrapped [rad]."""
        self._advance(at_ns)
        leg = self._wiring.encoders[axis]
        angle = self._wiring.gear_factor[leg] * self._machine.motor_angle(leg, at_ns) + self._slip[leg]
        return self._wiring.encoder_sign[axis] * angle

    def motor_velocity(self, axis: int, at_ns: int) -> float:
        """What the axis' encoder shows of its shaft's velocity [rad/s]."""
        self._advance(at_ns)
        leg = self._wiring.encoders[axis]
        rate = self._wiring.gear_factor[leg] * self._machine.motor_velocity(leg, at_ns) + self._slip_rate[leg]
        return self._wiring.encoder_sign[axis] * rate

    def motor_torque(self, axis: int, at_ns: int) -> float:
        """The torque that the drive of the axis gives, as its current says [N·m at the motor]."""
        self._advance(at_ns)
        leg = self._wiring.motors[axis]
        given = self._demand[leg]
        if not self._slips(leg):
            given = self._machine.motor_torque(leg, at_ns) / self._wiring.gear_factor[leg]
        return self._wiring.torque_sign[axis] * given

    def _slips(self, leg: int) -> bool:
        return self._slip_rate[leg] != 0.0 or abs(self._demand[leg]) > self._wiring.coupling[leg]

    def _drag(self, leg: int) -> float:
        """What a slipping coupling passes on [N·m at the motor]."""
        direction = self._slip_rate[leg] or self._demand[leg]
        limit = self._wiring.coupling[leg]
        return limit if direction > 0.0 else -limit

    def _pass_on(self, leg: int, at_ns: int) -> None:
        torque = self._drag(leg) if self._slips(leg) else self._demand[leg]
        self._machine.set_torque_demand(leg, torque * self._wiring.gear_factor[leg], at_ns)

    def _advance(self, to_ns: int) -> None:
        """Let slipping rotors spin, and stop, each at its own instant."""
        while (stop := min((self._stop_ns(leg), leg) for leg in range(3)))[0] <= to_ns:
            at_ns, leg = stop
            self._spin(at_ns)
            self._slip_rate[leg] = 0.0
            self._pass_on(leg, at_ns)
        self._spin(to_ns)

    def _stop_ns(self, leg: int) -> int:
        """When a slipping rotor will have come to rest [ns]."""
        rate = self._slip_rate[leg]
        if rate == 0.0:
            return _FOREVER
        acceleration = self._acceleration(leg)
        if rate * acceleration >= 0.0:
            return _FOREVER
        return self._now_ns + round(-rate / acceleration / NANOSECOND)

    def _acceleration(self, leg: int) -> float:
        return (self._demand[leg] - self._drag(leg)) / ROTOR_INERTIA

    def _spin(self, to_ns: int) -> None:
        dt = (to_ns - self._now_ns) * NANOSECOND
        for leg in range(3):
            if dt > 0.0 and self._slips(leg):
                acceleration = self._acceleration(leg)
                self._slip[leg] += dt * (self._slip_rate[leg] + dt * acceleration / 2)
                self._slip_rate[leg] += dt * acceleration
        self._now_ns = max(self._now_ns, to_ns)
