"""Buses: how frames leave this process, and what time it is there. The only modules that know python-can.

A URL chooses (`open_bus`); the rest of torquerig knows `Bus` and `Clock` alone.
"""

from torquerig.driver.bus.clock import RealClock
from torquerig.driver.bus.interface import Bus, Clock, Tap
from torquerig.driver.bus.lockstep import LockstepBus, SimulatedWire
from torquerig.driver.bus.python_can import PythonCanBus
from torquerig.driver.bus.unix import UnixBus
from torquerig.driver.bus.url import open_bus

__all__ = ["Bus", "Clock", "LockstepBus", "PythonCanBus", "RealClock", "SimulatedWire", "Tap", "UnixBus", "open_bus"]
