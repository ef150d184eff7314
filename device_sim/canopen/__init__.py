"""CANopen slaves (CiA 301), sans I/O: a node is one object dictionary and the services around it."""

from torquerig.device_sim.canopen.application import Application, CommunicationEvent
from torquerig.device_sim.canopen.core import NodeTiming
from torquerig.device_sim.canopen.node import CanopenNode

__all__ = ["Application", "CanopenNode", "CommunicationEvent", "NodeTiming"]
