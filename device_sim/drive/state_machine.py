"""The power state machine of CiA 402 in the drive: each transition, and the torque's way to zero that it asks for."""

from collections.abc import Callable
from typing import Final, Protocol

from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.device_sim.drive import objects
from torquerig.device_sim.drive.torque_command import TorqueCommand
from torquerig.driver.wire.cia402 import AUTOMATIC_TRANSITIONS, DriveState, Event, walk
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort

_CUT: Final = 0  # in 605A, 605B, 605C and 605E: disable the drive function, the motor is free to coast
_QUICK_STOP_RAMPS: Final = (1, 2)  # 605A: ramp, then switch on disabled
_QUICK_STOP_STAYS: Final = (5, 6)  # 605A: ramp, and stay in quick stop active
_RESET: Final = 15
_RESUME: Final = 16
_ENERGISED: Final = frozenset(
    {DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT_REACTION_ACTIVE}
)

# The options that torque mode knows; the slow down ramp and the quick stop ramp are both the torque slope 6087.
# Stops on the current or the voltage limit (3, 4, 7, 8) belong to speed control.
SUPPORTED_OPTIONS: Final = {
    objects.QUICK_STOP_OPTION: frozenset({_CUT, *_QUICK_STOP_RAMPS, *_QUICK_STOP_STAYS}),
    objects.SHUTDOWN_OPTION: frozenset({_CUT, 1}),
    objects.DISABLE_OPTION: frozenset({_CUT, 1}),
    objects.HALT_OPTION: frozenset({1, 2}),
    objects.FAULT_REACTION_OPTION: frozenset({_CUT, 1, 2}),
    objects.ABORT_CONNECTION_OPTION: frozenset({0, 1, 2, 3}),
}


class StateObserver(Protocol):
    """Whoever has to do what a change of state means."""

    def state_changed(self, at_ns: int) -> None:
        """The state is another one."""
        ...

    def causes_gone(self, at_ns: int) -> bool:
        """Whether a fault may be reset."""
        ...


class PowerStateMachine:
    """Applies controlwords, and the options that say how torque ends.

    A stop by ramp ends in its state when the torque is zero; until then the state stays, and only a command that stops
    sooner is obeyed.

    Attributes:
        state: The state.
        stopping: A ramp to zero is under way that ends operation.
    """

    __slots__ = ("_command", "_controlword", "_observer", "_store", "state", "stopping")

    def __init__(self, store: ObjectStore, command: TorqueCommand, observer: StateObserver) -> None:
        self._store = store
        self._command = command
        self._observer = observer
        self._controlword = 0
        self.state = DriveState.NOT_READY
        self.stopping = False
        for index, supported in SUPPORTED_OPTIONS.items():
            store.guard(_option_guard(index, supported), index)

    @property
    def energised(self) -> bool:
        """Whether the drive may give torque now."""
        return self.state in _ENERGISED

    def power_on(self, at_ns: int) -> None:
        """Begin: transitions 0 and 1."""
        self._controlword = 0
        self.stopping = False
        self.state = AUTOMATIC_TRANSITIONS[None, Event.POWER_ON].target
        self._automatic(Event.INITIALISED, at_ns)

    def obey(self, controlword: int, at_ns: int) -> None:
        """Make the transitions that a controlword asks for."""
        barred = set[int]()
        if self.state is DriveState.FAULT and not self._observer.causes_gone(at_ns):
            barred.add(_RESET)
        if self._store.get(objects.QUICK_STOP_OPTION) not in _QUICK_STOP_STAYS:
            barred.add(_RESUME)
        previous, self._controlword = self._controlword, controlword
        for transition in walk(self.state, controlword, previous, barred=barred):
            if not self._make(transition.number, transition.target, at_ns):
                return

    def quick_stop(self, at_ns: int) -> None:
        """Transition 11: stop as 605A says; a drive that is stopping anyhow goes on."""
        if self.state is not DriveState.OPERATION_ENABLED:
            return
        option = self._store.get(objects.QUICK_STOP_OPTION)
        self.stopping = False
        if option == _CUT:
            self.disable(at_ns)
            return
        self._enter(DriveState.QUICK_STOP_ACTIVE, at_ns)
        done = self._quick_stop_done if option in _QUICK_STOP_RAMPS else None
        self._command.ramp(0.0, at_ns, done)

    def disable(self, at_ns: int) -> None:
        """Torque 0 now, and switch on disabled (transitions 9 and 12); a fault reaction ends in fault all the same."""
        self._command.cut(at_ns)
        if self.state is DriveState.FAULT_REACTION_ACTIVE:
            self._fault_reaction_done(at_ns)
        else:
            self._enter(DriveState.SWITCH_ON_DISABLED, at_ns)

    def fail(self, at_ns: int, *, at_once: bool) -> None:
        """Transition 13: the fault reaction 605E, or torque 0 at once; then transition 14."""
        if (self.state, Event.FAULT_DETECTED) not in AUTOMATIC_TRANSITIONS:
            if at_once and self.energised:
                self.disable(at_ns)
            return
        ramps = self.energised and not at_once and self._store.get(objects.FAULT_REACTION_OPTION) != _CUT
        self._automatic(Event.FAULT_DETECTED, at_ns)
        if ramps:
            self._command.ramp(0.0, at_ns, self._fault_reaction_done)
        else:
            self._command.cut(at_ns)
            self._fault_reaction_done(at_ns)

    def _make(self, number: int, target: DriveState, at_ns: int) -> bool:
        """Make one transition; False when it takes a ramp, and what follows must wait."""
        if number == 11:
            self.quick_stop(at_ns)
        elif number in {5, 8}:
            option = objects.DISABLE_OPTION if number == 5 else objects.SHUTDOWN_OPTION
            if self._store.get(option) != _CUT:
                self._ramp_down(target, at_ns)
                return False
            self._command.cut(at_ns)
            self._enter(target, at_ns)
        elif self.energised and number != _RESUME:  # 9, 12
            self.disable(at_ns)
        else:
            self._enter(target, at_ns)
        return True

    def _ramp_down(self, target: DriveState, at_ns: int) -> None:
        if not self.stopping:
            self.stopping = True
            self._observer.state_changed(at_ns)
            self._command.ramp(0.0, at_ns, lambda end_ns: self._enter(target, end_ns))

    def _quick_stop_done(self, at_ns: int) -> None:
        self._automatic(Event.QUICK_STOP_DONE, at_ns)

    def _fault_reaction_done(self, at_ns: int) -> None:
        self._automatic(Event.FAULT_REACTION_DONE, at_ns)

    def _automatic(self, event: Event, at_ns: int) -> None:
        self._enter(AUTOMATIC_TRANSITIONS[self.state, event].target, at_ns)

    def _enter(self, state: DriveState, at_ns: int) -> None:
        self.state = state
        self.stopping = False
        self._observer.state_changed(at_ns)


def _option_guard(index: int, supported: frozenset[int]) -> Callable[[int, int], None]:
    def check(subindex: int, value: int) -> None:
        if value not in supported:
            raise SdoAbort(AbortCode.INVALID_VALUE, index, subindex)

    return check
