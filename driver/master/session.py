"""A master's time with its drives: how it begins, how drives are walked, how it ends."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Final

from torquerig.driver.bus.interface import Bus
from torquerig.driver.errors import (
    BusError,
    DriveError,
    DriveFault,
    EnablingRefused,
    NoAnswer,
    SecondMaster,
    TorqueRigError,
)
from torquerig.driver.master.axis import DISABLED_STATES, Axis, state_words
from torquerig.driver.master.configuration import (
    Setting,
    check_identity,
    configure,
    disarm_heartbeats,
    process_data_of,
    settings_of,
    verify_watchdogs,
)
from torquerig.driver.master.exchange import CyclicExchange
from torquerig.driver.master.faults import Fault, clear_old_faults, describe_faults, disable, read_fault
from torquerig.driver.master.group_exchange import GroupExchange
from torquerig.driver.master.identity import Identity, read_identity
from torquerig.driver.master.pump import MILLISECOND_NS, GuardPoller, HeartbeatProducer, Pump, Timed, name_drives
from torquerig.driver.master.room import spacing_alone_ns, transfer_spacing_ns
from torquerig.driver.master.scale import AxisSettings, axis_scale
from torquerig.driver.master.sdo_jobs import BRIEF, Job, Patience, SdoService
from torquerig.driver.master.settings import GroupSettings
from torquerig.driver.master.watch import TroubleKind, Watch, tell
from torquerig.driver.wire import nmt
from torquerig.driver.wire.cia402 import DriveState, decode_state
from torquerig.driver.wire.dictionary import load_dictionary
from torquerig.driver.wire.nmt import NmtCommand, NmtState

_ECHO_NS: Final = 10 * MILLISECOND_NS
_DISABLING_NS: Final = 100 * MILLISECOND_NS
_WALKED_AWAY: Final = frozenset({DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE, DriveState.QUICK_STOP_ACTIVE})


class DriveSession:
    """Everything that a group of axes stands on.

    Attributes:
        axes: The drives.
        settings: What holds for all of them.
        pump: Serves the bus.
        service: Reaches the drives' objects.
        watch: Listens for emergencies, heartbeats and other masters.
        exchange: The cycle.
        identities: Who the drives are, by node-id, once they were configured.
    """

    def __init__(self, bus: Bus, axes: Sequence[AxisSettings], settings: GroupSettings) -> None:
        """Prepare; nothing is sent before `open`.

        Raises:
            ValueError: Two axes have one node-id, or one has the master's; or there is no axis.
            EdsError, ProfileError: A drive's description cannot be used.
        """
        node_ids = [axis.node_id for axis in axes]
        if not node_ids or len({*node_ids, settings.master_id}) != len(node_ids) + 1:
            raise ValueError(
                f"axes need node-ids of their own, not {node_ids} beside the master's {settings.master_id}"
            )
        dictionaries = {path: load_dictionary(path, node_ids[0]) for path in {axis.eds_path for axis in axes}}
        self.axes = tuple(Axis(axis, dictionaries[axis.eds_path]) for axis in axes)
        self.settings = settings
        self.pump = Pump(bus)
        self.service = SdoService(self.pump)
        self.watch = Watch(self.pump, self.axes, settings.master_id)
        kind = GroupExchange if settings.group_rpdo else CyclicExchange
        self.exchange = kind(self.pump, self.axes, self.watch, settings.period_ns, settings.watchdog_periods)
        self.identities: dict[int, Identity] = {}
        self._producers: list[Timed] = []
        self._commands = False
        self._plans: dict[int, tuple[Setting, ...]] = {
            axis.node_id: settings_of(
                axis.objects,
                axis.settings.profile,
                settings,
                [other for other in node_ids if other != axis.node_id],
                slot,
            )
            for slot, axis in enumerate(self.axes)
        }

    def open(self) -> None:
        """Listen for other masters, configure all drives, start the cycle and NMT.

        Raises:
            SecondMaster, NoAnswer, ConfigurationMismatch, EnablingRefused, ProfileError, BusError: Why it cannot be.
        """
        settings = self.settings
        self.pump.serve(self.pump.now_ns() + settings.listening_ms * MILLISECOND_NS)
        self.refuse_second_master()
        self._commands = True
        self.pump.learn_echo(nmt.encode_heartbeat(settings.master_id, NmtState.BOOT_UP), _ECHO_NS)
        self._produce(HeartbeatProducer(self.pump, settings.master_id, settings.master_heartbeat_ns))
        self._command_nmt(NmtCommand.PRE_OPERATIONAL)
        self.service.patience = Patience(spacing_ns=spacing_alone_ns(settings.bit_rate))
        self.service.run({axis.node_id: self._prepare(axis) for axis in self.axes})
        guarded = tuple(axis.node_id for axis in self.axes if axis.settings.profile.watchdogs.guarding)
        if guarded:
            self._produce(GuardPoller(self.pump, guarded, settings.guard_ms * MILLISECOND_NS))
        self.service.patience = Patience(spacing_ns=self._spacing_ns())
        self.exchange.start(self.pump.now_ns() + settings.period_ns)
        self._command_nmt(NmtCommand.START)
        self.watch.expect_operational()
        if not self.serve_until(lambda: all(axis.state is not None for axis in self.axes)):
            mute = [axis.node_id for axis in self.axes if axis.state is None]
            raise NoAnswer(f"no process data from {name_drives(mute)} within {settings.settling_ms / 1000:g} s")

    def close(self) -> None:
        """End at zero torque, all drives disabled, and see that it is so.

        Raises:
            BusError: The bus is gone; the drives are left to their watchdogs, and the message says so.
            NoAnswer, DriveError: A drive does not confirm that it is disabled.
        """
        if not self._commands:
            return
        try:
            self.stop()
            try:
                self._confirm_disabled()
            finally:
                self._command_nmt(NmtCommand.PRE_OPERATIONAL)
        except BusError as error:
            raise BusError(
                f"{error}; so nobody could see the drives disabled, and their watchdogs have to stop them"
                f" {self.settings.rpdo_deadline_ms} ms after the last command"
            ) from error
        finally:
            self.exchange.stop()
            while self._producers:
                self.pump.remove_timed(self._producers.pop())

    def refuse_second_master(self) -> None:
        """Raise SecondMaster when another master was heard."""
        if self.watch.foreign is not None:
            raise SecondMaster(f"another master speaks on the bus: {self.watch.foreign}")

    def refuse_absent(self) -> None:
        """Raise EnablingRefused when a drive has left NMT operational since it was started."""
        if left := self.watch.left:
            told = "; ".join(f"drive {node_id}: {words}" for node_id, words in left.items())
            why = "a node stood still, was reset, or the bus has no room for heartbeats"
            raise EnablingRefused(f"{name_drives(sorted(left))} left NMT operational after the start ({told}): {why}")

    def serve_until(self, done: Callable[[], bool], timeout_ns: int | None = None) -> bool:
        """Let the cycle go on with zero torque until something is done; False when the time is over first."""
        patience_ns = self.settings.settling_ms * MILLISECOND_NS if timeout_ns is None else timeout_ns
        return self.pump.serve(self.pump.now_ns() + patience_ns, done)

    def refresh(self) -> None:
        """Let so much time pass that every statusword and position is a new one."""
        self.pump.serve(self.pump.now_ns() + self.settings.period_ns + self.settings.status_ns)

    def verify_watchdogs(self) -> None:
        """See that every watchdog of every drive is armed.

        Raises:
            EnablingRefused: One is not.
        """
        self.service.run(
            {axis.node_id: verify_watchdogs(axis.objects, self._plans[axis.node_id]) for axis in self.axes}
        )

    def clear_old_faults(self) -> list[str]:
        """Reset the communication faults that an earlier master left, and say which; see `faults.clear_old_faults`."""
        return clear_old_faults(self.service, {axis.node_id: _heard(axis) for axis in self.axes})

    def walk(self, axes: Sequence[Axis], modes: Mapping[int, int]) -> None:
        """Bring drives to 'operation enabled', all in the same cycle: none goes there before all are switched on.

        Args:
            axes: The drives.
            modes: The mode of operation that each must then show, by node-id.

        Raises:
            DriveFault: One fell into fault.
            EnablingRefused: One stays where it is, left NMT operational, or shows another mode of operation.
            SecondMaster: Another master was heard meanwhile.
        """
        self.watch.armed = False
        self.refuse_absent()
        self.refresh()  # the last statuswords may be older than a fault's reset
        for goal in (DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED):
            for axis in axes:
                axis.aim(goal)
            self.serve_until(partial(self._have_settled, axes, goal))
            self.refuse_second_master()
            self.refuse_absent()
            self._check_walked(axes, goal)
        self.watch.troubles.clear()
        self.watch.armed = True
        displays = self.service.run({axis.node_id: axis.objects.read_number(0x6061) for axis in axes})
        for node_id, shown in displays.items():
            if shown != modes[node_id]:
                raise EnablingRefused(
                    f"drive {node_id} shows mode of operation {shown} (6061), where {modes[node_id]} is needed"
                )
        if self.watch.troubles:
            raise self.explain()
        self.exchange.feed_watchdogs()

    def cut(self) -> None:
        """Send zero torque and 'disable voltage' to all drives, now."""
        self.watch.armed = False
        for axis in self.axes:
            axis.aim(DriveState.SWITCH_ON_DISABLED)
        if self.exchange.running:
            self.exchange.send_zero()

    def stop(self) -> None:
        """Cut the torque and wait, for a moment, until the drives say that they are disabled."""
        self.cut()
        if self.exchange.running:
            self.serve_until(lambda: all(axis.is_disabled for axis in self.axes), _DISABLING_NS)

    def explain(self) -> TorqueRigError:
        """The error that tells what stopped the group; the drives are asked, whose cycle goes on meanwhile."""
        troubles, self.watch.troubles = self.watch.troubles, []
        if any(trouble.kind is TroubleKind.MASTER for trouble in troubles):
            return SecondMaster(f"another master speaks on the bus: {self.watch.foreign}")
        if troubles[0].kind is TroubleKind.SILENT:
            return NoAnswer(tell(troubles))
        try:
            faults = self._read_faults()
        except NoAnswer as silence:
            return DriveFault(f"{tell(troubles)}; {silence}")
        if any(not fault.is_sibling_stop for fault in faults):
            return DriveFault(describe_faults(faults))
        faulty = {fault.node_id for fault in faults}
        causes = tell([trouble for trouble in troubles if trouble.node_id not in faulty])
        return DriveFault("; ".join(filter(None, [causes, describe_faults(faults)])))

    def _produce(self, producer: Timed) -> None:
        self._producers.append(producer)
        self.pump.add_timed(producer)

    def _command_nmt(self, command: NmtCommand) -> None:
        for axis in self.axes:
            self.pump.send(nmt.encode_command(command, axis.node_id))

    def _spacing_ns(self) -> int:
        """Time between SDO transfers beside the cycle [ns]."""
        settings, count = self.settings, len(self.axes)
        drives = [
            process_data_of(axis.objects, axis.settings.profile, settings, slot, count)
            for slot, axis in enumerate(self.axes)
        ]
        return transfer_spacing_ns(drives[: settings.most_on_a_bus], settings.period_ns, settings.bit_rate)

    def _prepare(self, axis: Axis) -> Job[None]:
        self.identities[axis.node_id] = yield from read_identity()
        yield from check_identity(axis.objects)
        yield from configure(axis.objects, self._plans[axis.node_id])
        rated_object = axis.settings.profile.torque.rated_object
        rated = None if rated_object is None else (yield from axis.objects.read_number(*rated_object))
        axis.scale = axis_scale(axis.settings, rated)

    def _read_faults(self) -> list[Fault]:
        jobs = {axis.node_id: read_fault(axis.node_id, _heard(axis)) for axis in self.axes}
        return [fault for fault in self.service.run(jobs, BRIEF).values() if fault is not None]

    def _have_settled(self, axes: Sequence[Axis], goal: DriveState) -> bool:
        reached = all(axis.state is goal for axis in axes)
        return reached or bool(self.watch.left) or any(axis.state in _WALKED_AWAY for axis in axes)

    def _check_walked(self, axes: Sequence[Axis], goal: DriveState) -> None:
        stuck = [axis for axis in axes if axis.state is not goal]
        if not stuck:
            return
        if faults := self._read_faults():
            raise DriveFault(describe_faults(faults))
        where = ", ".join(f"drive {axis.node_id} stays in {axis.state_words}" for axis in stuck)
        raise EnablingRefused(f"{where}, and does not come to '{goal.words}' within {self.settings.settling_ms} ms")

    def _confirm_disabled(self) -> None:
        statuswords = self.service.run({axis.node_id: disable() for axis in self.axes}, BRIEF)
        for node_id, statusword in statuswords.items():
            state = decode_state(statusword)
            if state not in DISABLED_STATES:
                raise DriveError(f"drive {node_id} was told to disable, but is in {state_words(state)}")
        watching = [axis.objects for axis in self.axes if axis.settings.profile.watchdogs.heartbeat]
        self.service.run({objects.node_id: disarm_heartbeats(objects) for objects in watching}, BRIEF)


def _heard(axis: Axis) -> int:
    """The code of the last emergency of a drive, 0 when there was none."""
    return axis.emergency.code if axis.emergency is not None else 0
