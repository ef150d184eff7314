"""A simulated drive: the CANopen node and the torque drive behind it, turning one motor of a machine."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final, NamedTuple

from torquerig.device_sim.canopen.node import CanopenNode
from torquerig.device_sim.canopen.rpdo import Rpdo
from torquerig.device_sim.canopen.tpdo import REFUSED, Tpdo, TpdoPlan
from torquerig.device_sim.drive import objects, steady_memory
from torquerig.device_sim.drive.fault_injection import Injection
from torquerig.device_sim.drive.parameters import DriveParameters
from torquerig.device_sim.drive.torque_drive import LentParts, TorqueDrive
from torquerig.device_sim.machine import Machine
from torquerig.driver.wire.cia402 import DriveState
from torquerig.driver.wire.dictionary import DRIVE_EDS, load_dictionary
from torquerig.driver.wire.frame import Frame

_KNOWN: Final = (objects.CONTROLWORD, objects.RAW_TARGET, objects.TARGET_TORQUE)
"""What an RPDO may carry in a steady cycle, in the order in which `steady_memory.RPDO` says where."""

_SOURCES: Final[Mapping[tuple[int, int], int]] = {
    (objects.POSITION, 0): steady_memory.POSITION,
    (objects.POSITION_INTERNAL, 0): steady_memory.EDGES,
    (objects.VELOCITY, 0): steady_memory.VELOCITY,
    (objects.RAW_ACTUAL, 0): steady_memory.RAW_TORQUE,
    (objects.TORQUE_ACTUAL, 0): steady_memory.TORQUE,
    (objects.CURRENT_ACTUAL, 0): steady_memory.TORQUE,
    objects.DEVICE_TEMPERATURE: steady_memory.ASKED,
    objects.MOTOR_TEMPERATURE: steady_memory.ASKED,
    (objects.DC_LINK_VOLTAGE, 0): steady_memory.ASKED,
    (objects.RAW_TARGET, 0): REFUSED,
    (objects.TARGET_TORQUE, 0): REFUSED,
    objects.MISSED_SYNCS: REFUSED,
    (objects.SYNC_SAMPLE_TIME, 0): REFUSED,
}
"""What a TPDO's numbers are in a steady cycle, where they change."""


class LentDrive(NamedTuple):
    """What a steady cycle goes on with.

    Attributes:
        parts: `steady_memory.DRIVE`.
        pending: Targets that wait for their effect.
        rpdos: What it hears, and
        heard: how that is read.
        tpdos: What it says, and
        said: how that is made.
        other_event_ns: When something happens next without a frame that a steady cycle does not do [ns].
        aside_ns: When something does that can be done beside it [ns].
    """

    parts: LentParts
    pending: tuple[tuple[int, float], ...]
    rpdos: tuple[Rpdo, ...]
    heard: tuple[tuple[int, ...], ...]
    tpdos: tuple[Tpdo, ...]
    said: tuple[TpdoPlan, ...]
    other_event_ns: int
    aside_ns: int


class SimulatedDrive(CanopenNode):
    """One drive on the bus.

    Attributes:
        axis: Which motor of the machine it turns.
        machine: The machine.
        behind: The torque drive behind the node.
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
        self.machine = machine
        super().__init__(
            node_id,
            load_dictionary(eds, node_id),
            lambda node: self._build(node, machine, truth),
            timing=truth.timing,
            volatile=objects.VOLATILE,
            power_on_ns=power_on_ns,
        )
        self.store.personalise(node_id, *objects.SERIAL_NUMBER)
        self._places = {self.store.slot(index): place for place, index in enumerate(_KNOWN)}
        self._sources = {self.store.slot(*address): source for address, source in _SOURCES.items()}

    def _build(self, node: CanopenNode, machine: Machine, parameters: DriveParameters) -> TorqueDrive:
        self.behind = TorqueDrive(node, machine, self.axis, parameters)
        return self.behind

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

    def lend(self) -> LentDrive | None:
        """What a steady cycle goes on with; None if the drive is not steady."""
        parts, pdos, reaction_ns = self.behind.lend(), self.pdos.plain, self.store.reaction_ns
        if parts is None or pdos is None or reaction_ns <= 0 or self.shares_identifiers or not self.sync.is_plain:
            return None
        rpdos, tpdos = pdos
        heard = tuple([plan for rpdo in rpdos if (plan := rpdo.plan(self._places)) is not None])
        said = tuple([made for tpdo in tpdos if (made := tpdo.plan(self._sources)) is not None])
        pending = self.behind.command.pending
        if len(heard) < len(rpdos) or len(said) < len(tpdos) or len(pending) > steady_memory.WAITING:
            return None
        node = reaction_ns, self.sync.count, self.timers.now_ns, len(pending)
        return LentDrive((*parts, node), pending, rpdos, heard, tpdos, said, self.other_event_ns, self.aside_ns)

    @property
    def other_event_ns(self) -> int:
        """When something happens next without a frame that is neither of a steady cycle nor beside it [ns]."""
        own = self.behind.command.effect, self.behind.watchdogs.sync_loss, *self.pdos.deadlines
        return self.timers.next_but((*own, self.error_control.producer.timer, self.behind.protection.look))

    @property
    def aside_ns(self) -> int:
        """When its next heartbeat goes out, or its protection looks next [ns]."""
        return min(self.error_control.producer.timer.due_ns, self.behind.protection.look.due_ns)

    def expects(self, frame: Frame) -> bool:
        """Whether a frame is nothing to it, or a heartbeat that is no news."""
        listener, consumer = self.listeners.get(frame.can_id), self.error_control.consumer
        return listener is None or (listener == consumer.receive and consumer.is_no_news(frame))

    @property
    def state(self) -> DriveState:
        """The state of CiA 402."""
        return self.behind.power.state

    @property
    def torque_demand(self) -> float:
        """What the current loop is told now [counts]."""
        return self.behind.path.demand
