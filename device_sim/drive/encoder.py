"""The incremental encoder on the motor, and the position that the drive makes of it (objects 6063, 6064, 606C)."""

import math
from typing import Final

from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.device_sim.drive import objects
from torquerig.device_sim.machine import Machine

_HALF: Final = 1 << 31
_MASK: Final = (1 << 32) - 1


def wrap(value: int) -> int:
    """The value as 32 bits with a sign hold it: what lies beyond wraps around."""
    return ((value + _HALF) & _MASK) - _HALF


class Encoder:
    """Counts edges that stand at fixed angles of the shaft, from zero at power-on wherever the machine stands.

    The position is the counts in the user's units (608F, 6091, 6092; as shipped 1:1) plus what homing added. The
    velocity is measured from the times of the edges, so it is finer than differences of counts.

    Attributes:
        lost: The encoder gives no edges any more: counts stand still.
        referenced: Homing has been done since power-on.
    """

    __slots__ = (
        "_axis",
        "_counts_per_radian",
        "_denominator",
        "_edge",
        "_held",
        "_machine",
        "_numerator",
        "_offset",
        "_store",
        "lost",
        "referenced",
    )

    def __init__(self, machine: Machine, axis: int, store: ObjectStore, counts_per_revolution: int) -> None:
        self._machine = machine
        self._axis = axis
        self._store = store
        self._counts_per_radian = counts_per_revolution / math.tau
        self._edge = 0
        self._offset = 0
        self._held = 0
        self._numerator = 1
        self._denominator = 1
        self.lost = False
        self.referenced = False
        store.source(self.internal_position, objects.POSITION_INTERNAL)
        store.source(self.position, objects.POSITION)
        store.source(self.velocity, objects.VELOCITY)
        units = (objects.ENCODER_RESOLUTION, objects.GEAR_RATIO, objects.FEED_CONSTANT)
        store.watch(lambda _at_ns, _effect_ns: self._load_units(), *units)

    def power_on(self, at_ns: int) -> None:
        """Count from zero, here; the position refers to nothing."""
        self.lost = False
        self.referenced = False
        self._offset = 0
        self._edge = math.floor(self._machine.motor_angle(self._axis, at_ns) * self._counts_per_radian)
        self._load_units()

    def counts(self, at_ns: int) -> int:
        """Edges since power-on, not wrapped."""
        if self.lost:
            return self._held
        return math.floor(self._machine.motor_angle(self._axis, at_ns) * self._counts_per_radian) - self._edge

    def internal_position(self, at_ns: int) -> int:
        """Object 6063 [counts]."""
        return wrap(self.counts(at_ns))

    def position(self, at_ns: int) -> int:
        """Object 6064 [user's units; as shipped counts]."""
        return wrap(self.counts(at_ns) * self._numerator // self._denominator + self._offset)

    def velocity(self, at_ns: int) -> int:
        """Object 606C [user's units/s; as shipped counts/s]."""
        if self.lost:
            return 0
        speed = self._machine.motor_velocity(self._axis, at_ns) * self._counts_per_radian
        return wrap(round(speed * self._numerator / self._denominator))

    def set_position(self, position: int, at_ns: int) -> None:
        """Let 6064 be `position` here and now (homing)."""
        self._offset = position - self.counts(at_ns) * self._numerator // self._denominator
        self.referenced = True

    def lose(self, at_ns: int) -> None:
        """Give no more edges (a broken cable)."""
        self._held = self.counts(at_ns)
        self.lost = True

    def recover(self) -> None:
        """Count again; the edges in between are found again, because the simulated shaft knows them."""
        self.lost = False

    def lend(self) -> tuple[float, int, int] | None:
        """What a steady cycle knows of it (`steady_memory.ENCODER`); None unless counts are the user's units."""
        if self.lost or self._numerator != self._denominator:
            return None
        return self._counts_per_radian, self._edge, self._offset

    def _load_units(self) -> None:
        """The factor from counts to the user's units: feed / (encoder resolution x gear ratio)."""
        get = self._store.get
        numerator = get(objects.FEED_CONSTANT, 1) * get(objects.ENCODER_RESOLUTION, 2) * get(objects.GEAR_RATIO, 2)
        denominator = get(objects.FEED_CONSTANT, 2) * get(objects.ENCODER_RESOLUTION, 1) * get(objects.GEAR_RATIO, 1)
        divisor = math.gcd(numerator, denominator)
        self._numerator, self._denominator = numerator // divisor, denominator // divisor
