"""A simulated torque transducer: a CANopen measuring device (CiA 404) on the shaft of a locked rotor."""

from torquerig.device_sim.transducer.sensor import SensorFault, SensorParameters
from torquerig.device_sim.transducer.transducer import SimulatedTransducer

__all__ = ["SensorFault", "SensorParameters", "SimulatedTransducer"]
