"""A simulated drive: the CANopen node and the torque drive behind it, turning one motor of a machine."""

from pathlib import Path

from torquerig.device_sim.canopen.node import CanopenNode
from torquerig.device_sim.drive import objects
from torquerig.device_sim.drive.fault_injection import Injection
from torquerig.device_sim.drive.parameters import DriveParameters
from torquerig.device_sim.drive.torque_drive import TorqueDrive
from torquerig.device_sim.machine import Machine
from torquerig.driver.wire.cia402 import DriveState
from torquerig.driver.wire.dictionary import DRIVE_EDS, load_dictionary


class SimulatedDrive(CanopenNode):
    """One drive on the bus.

    Attributes:
        axis: Which motor of the machine it turns.
    """

    def __init__(
        self,
        node_id: int,
        axis: int,
        machine: Machine,
        parameters: DriveParameters | None = None,
        *,
        eds: Path = DRIVE_EDS,
        power_on_ns: int = 0,
    ) -> None:
        """Build the drive; it is switched on at its first event.

        Args:
            node_id: CANopen node-id, 1 to 127.
            axis: Which motor of the machine it turns.
            machine: What the motor turns.
            parameters: The truth about the drive; None for the thesis' rig.
            eds: Its object dictionary.
            power_on_ns: When it is switched on [ns].

        Raises:
            EdsError: The EDS cannot be read.
            ValueError: The node-id is out of range, or the machine has no such axis.
        """
        if not 0 <= axis < machine.axes:
            raise ValueError(f"a machine with {machine.axes} axes has no axis {axis}")
        truth = parameters or DriveParameters()
        self.axis = axis
        super().__init__(
            node_id,
            load_dictionary(eds, node_id),
            lambda node: self._build(node, machine, truth),
            timing=truth.timing,
            volatile=objects.VOLATILE,
            power_on_ns=power_on_ns,
        )
        self.store.personalise(node_id, *objects.SERIAL_NUMBER)

    def _build(self, node: CanopenNode, machine: Machine, parameters: DriveParameters) -> TorqueDrive:
        self._drive = TorqueDrive(node, machine, self.axis, parameters)
        return self._drive

    def inject(self, fault: Injection, at_ns: int) -> None:
        """Make a fault happen, as a write of its number to 2F00 does.

        Args:
            fault: Which.
            at_ns: When [ns].
        """
        self.advance(at_ns)
        self.timers.now_ns = at_ns
        self.store.write(objects.FAULT_INJECTION, 0, fault.to_bytes(4, "little"))
        if self.pdos.eventful:
            self.pdos.check(at_ns)

    @property
    def state(self) -> DriveState:
        """The state of CiA 402."""
        return self._drive.power.state

    @property
    def torque_demand(self) -> float:
        """What the current loop is told now [counts]."""
        return self._drive.path.demand
