"""Quantities that follow a load with a first-order lag: I2t and temperatures."""

import math
from typing import Final

from torquerig.device_sim.devices import NEVER_NS

_NS_PER_S: Final = 1e9


class LaggedLoad:
    """x' = (load - x) / time constant, exactly, for a load that is constant between changes.

    Args:
        time_constant: [s]
    """

    __slots__ = ("_at_ns", "_load", "_time_constant", "_x")

    def __init__(self, time_constant: float) -> None:
        self._time_constant = time_constant
        self.reset(0)

    def reset(self, at_ns: int) -> None:
        """Begin cold and without load."""
        self._x = 0.0
        self._load = 0.0
        self._at_ns = at_ns

    def value(self, at_ns: int) -> float:
        """The quantity at a time not before the last change [share of the load's unit]."""
        elapsed = (at_ns - self._at_ns) / _NS_PER_S
        return self._load + (self._x - self._load) * math.exp(-elapsed / self._time_constant)

    def change(self, load: float, at_ns: int) -> None:
        """Let the load be another from now on."""
        self._x = self.value(at_ns)
        self._at_ns = at_ns
        self._load = load

    def lend(self) -> tuple[float, float, float, int]:
        """Its time constant, the quantity at the last change, the load since, and when that was [ns]."""
        return self._time_constant, self._x, self._load, self._at_ns

    def take_back(self, x: float, load: float, at_ns: int) -> None:
        """Go on from such a state."""
        self._x, self._load, self._at_ns = x, load, at_ns

    def set_time_constant(self, time_constant: float, at_ns: int) -> None:
        """Follow the load faster or slower from now on [s]."""
        self.change(self._load, at_ns)
        self._time_constant = time_constant

    def reaches_ns(self, level: float) -> int:
        """When the quantity rises to a level if the load stays: NEVER_NS if it never will, else not before now."""
        if self._load <= level:
            return NEVER_NS
        if self._x >= level:
            return self._at_ns
        elapsed = self._time_constant * math.log((self._load - self._x) / (self._load - level))
        return self._at_ns + math.ceil(elapsed * _NS_PER_S)
