"""The CiA 402 torque drive behind a CANopen node: joins encoder, torque path, modes, states and watchdogs."""

from typing import Final

from torquerig.device_sim.canopen.application import CommunicationEvent
from torquerig.device_sim.canopen.node import CanopenNode
from torquerig.device_sim.drive import objects
from torquerig.device_sim.drive.encoder import Encoder
from torquerig.device_sim.drive.homing import Homing
from torquerig.device_sim.drive.modes import Modes
from torquerig.device_sim.drive.parameters import DriveParameters
from torquerig.device_sim.drive.protection import Protection
from torquerig.device_sim.drive.state_machine import PowerStateMachine
from torquerig.device_sim.drive.torque_command import TorqueCommand
from torquerig.device_sim.drive.torque_path import TorquePath
from torquerig.device_sim.drive.watchdog import Watchdogs
from torquerig.device_sim.machine import Machine
from torquerig.driver.wire.cia402 import INTERNAL_LIMIT, REFERENCED, REMOTE, STATE_BITS, VOLTAGE_ENABLED, DriveState
from torquerig.driver.wire.emcy import Emergency, EmergencyCode

_US: Final = 1_000  # [ns]
LATENCY_MAXIMUM: Final = 0xFFFF  # of object 2100:4 [us]

# faults after which the torque cannot be controlled on its way to zero: 605E is not asked
_UNCONTROLLED: Final = frozenset({EmergencyCode.OVERCURRENT, EmergencyCode.ENCODER})

LentParts = tuple[tuple[float, ...], ...]
"""What a steady cycle knows of a drive, without its node: `steady_memory.CLOCK` and the parts that follow it."""


class TorqueDrive:
    """Satisfies application.Application, state_machine.StateObserver and watchdog.Reactions.

    Attributes:
        path: The torque path.
        power: The power state machine.
        command: Brings the torque to its target.
        protection: What trips it.
        watchdogs: What watches the communication.
    """

    def __init__(self, node: CanopenNode, machine: Machine, axis: int, parameters: DriveParameters) -> None:
        store, timers = node.store, node.timers
        self._node = node
        self._values = store.values
        self._controlword_slot = store.slot(objects.CONTROLWORD)
        self._statusword_slot = store.slot(objects.STATUSWORD)
        self._sample_time_slot = store.slot(objects.SYNC_SAMPLE_TIME)
        self._power_on_ns = 0
        self._last_sync_ns: int | None = None
        self._effect_ns = 0
        self._latency = 0
        self._controlword = 0
        self._state = DriveState.NOT_READY
        self._encoder = Encoder(machine, axis, store, parameters.encoder_counts)
        self.protection = Protection(
            machine, axis, store, timers, parameters=parameters, encoder=self._encoder, trip=self._trip
        )
        self.path = TorquePath(
            machine,
            axis,
            store,
            parameters,
            limit_changed=self._publish_status,
            torque_changed=self.protection.load,
        )
        self.command = TorqueCommand(
            timers, self.path, period_ns=parameters.control_period_ns, effective=self._target_effective
        )
        homing = Homing(store, self._encoder, parameters.homing_speed)
        self._modes = Modes(store, self.path, self.command, homing, arrived=lambda _at_ns: self._publish_status())
        self.power = PowerStateMachine(store, self.command, self)
        self.watchdogs = Watchdogs(node, self)
        self._watch_objects()

    def _watch_objects(self) -> None:
        store = self._node.store
        store.source(lambda _at_ns: self._latency, *objects.COMMAND_LATENCY)
        store.watch(self._controlword_written, objects.CONTROLWORD)
        store.watch(self._mode_written, objects.MODE)
        store.watch(lambda *_: self._publish_status(), objects.TRIP_LEVELS, objects.FAULT_INJECTION)
        store.watch(
            self._target_written,
            objects.TORQUE_SOURCE,
            objects.RAW_TARGET,
            objects.TARGET_TORQUE,
            objects.TORQUE_OFFSET,
            objects.RATED_TORQUE,
            objects.MAX_TORQUE,
            objects.POSITIVE_LIMIT,
            objects.NEGATIVE_LIMIT,
        )

    def power_on(self, at_ns: int) -> None:
        """Begin at rest, with the encoder at zero."""
        self._power_on_ns = at_ns
        self._last_sync_ns = None
        self._effect_ns = at_ns
        self._latency = 0
        self._controlword = 0
        self.watchdogs.stop()
        self._encoder.power_on(at_ns)
        self.protection.power_on(at_ns)
        self.path.power_on(at_ns)
        self._modes.power_on()
        self.power.power_on(at_ns)

    def synchronise(self, at_ns: int) -> None:
        """A SYNC: the instant of the samples."""
        self._values[self._sample_time_slot] = (at_ns - self._power_on_ns) // _US
        self.watchdogs.synchronise(at_ns, self._last_sync_ns)
        self._last_sync_ns = at_ns
        self.protection.check_speed(at_ns)

    def handle_event(self, event: CommunicationEvent, at_ns: int) -> None:
        """Communication failed somewhere."""
        self.watchdogs.handle_event(event, at_ns)

    def hear_emergency(self, emergency: Emergency, at_ns: int) -> None:
        """A sibling told an emergency."""
        self.watchdogs.hear_emergency(emergency, at_ns)

    @property
    def energised(self) -> bool:
        """Whether the drive may give torque now."""
        return self.power.energised

    def fail(self, code: int, at_ns: int) -> None:
        """Torque 0 now, EMCY, fault."""
        self._fail(code, at_ns, at_once=True)

    def disable(self, at_ns: int) -> None:
        """Torque 0 now, switch on disabled."""
        self.power.disable(at_ns)

    def quick_stop(self, at_ns: int) -> None:
        """Quick stop as 605A says."""
        self.power.quick_stop(at_ns)

    def causes_gone(self, at_ns: int) -> bool:
        """Whether a fault may be reset; what happened to the communication is an event, and over."""
        return self.protection.causes_gone(at_ns)

    def lend(self) -> LentParts | None:
        """What a steady cycle goes on with; None if the drive is not steady.

        A steady drive follows its target in operation enabled, and nothing is on the way that would be told.
        """
        if not self._modes.following or self._last_sync_ns is None:
            return None
        encoder, protection = self._encoder.lend(), self.protection.lend()
        if encoder is None or protection is None:
            return None
        clock = self._power_on_ns, self._last_sync_ns, self._values[self._sample_time_slot], self._latency
        return (*clock, self._controlword), encoder, self.path.lend(), protection, self.watchdogs.lend()

    def take_back(self, last_sync_ns: int, sample_time: int, latency: int) -> None:
        """Go on from where a steady cycle ended."""
        self._last_sync_ns, self._latency = last_sync_ns, latency
        self._values[self._sample_time_slot] = sample_time

    def state_changed(self, at_ns: int) -> None:
        """Do what the new state means to watchdogs, modes and objects."""
        before, state = self._state, self.power.state
        self._state = state
        if self.power.stopping or state is not DriveState.OPERATION_ENABLED:
            self._modes.rest()
        if before is DriveState.FAULT and state is not before:
            self._node.store.set(EmergencyCode.NO_ERROR, objects.ERROR_CODE)
            self._node.emergency.clear_all(at_ns)
        if before is not state and DriveState.OPERATION_ENABLED in {before, state}:
            if state is DriveState.OPERATION_ENABLED:
                self.watchdogs.start(at_ns)
                self._modes.operate(at_ns, max(at_ns, self._effect_ns))
            else:
                self.watchdogs.stop()
        self._publish_status()

    def _controlword_written(self, at_ns: int, effect_ns: int) -> None:
        controlword = self._values[self._controlword_slot]
        if controlword == self._controlword and self._modes.following:
            return  # of every cycle: nothing in it is news to a drive that follows its target
        self._controlword = controlword
        self._effect_ns = effect_ns
        self._modes.obey(controlword, at_ns, effect_ns)  # first, so that what is halted is not started
        self.power.obey(controlword, at_ns)
        self._publish_status()

    def _target_written(self, at_ns: int, effect_ns: int) -> None:
        if self._modes.following:
            self.command.follow(at_ns, effect_ns)
        else:
            self._modes.head_for_target(at_ns, effect_ns)
            self._publish_status()

    def _mode_written(self, at_ns: int, effect_ns: int) -> None:
        self._modes.change(at_ns, effect_ns)
        self._publish_status()

    def _target_effective(self, at_ns: int) -> None:
        if self._last_sync_ns is not None:
            self._latency = min((at_ns - self._last_sync_ns) // _US, LATENCY_MAXIMUM)

    def _trip(self, code: EmergencyCode, at_ns: int) -> None:
        self._fail(code, at_ns, at_once=code in _UNCONTROLLED)

    def _fail(self, code: int, at_ns: int, *, at_once: bool) -> None:
        self._node.store.set(code, objects.ERROR_CODE)
        self.power.fail(at_ns, at_once=at_once)
        self._node.emergency.report(code, at_ns)

    def _publish_status(self) -> None:
        status = STATE_BITS[self.power.state] | REMOTE | self._modes.status_bits
        if self.protection.voltage_good:
            status |= VOLTAGE_ENABLED
        if self._encoder.referenced:
            status |= REFERENCED
        if self.path.limited:
            status |= INTERNAL_LIMIT
        self._values[self._statusword_slot] = status
