"""Simulated torque drives (CiA 402) behind CANopen nodes, each turning one motor of a machine."""

from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.drive.fault_injection import Injection
from torquerig.device_sim.drive.parameters import DriveParameters

__all__ = ["DriveParameters", "Injection", "SimulatedDrive"]
