"""The power state machine of CiA 402: statusword, controlword, transitions 0 to 16, and the master's way through them.

A drive applies the controlword with `walk`; a master reads the state with `decode_state` and steers with
`controlword_towards`.
"""

from collections.abc import Collection, Mapping
from enum import Enum, IntEnum
from types import MappingProxyType
from typing import Final, NamedTuple

# statusword 6041
VOLTAGE_ENABLED: Final = 1 << 4  # the DC link is supplied; not part of the state, the drive adds it
QUICK_STOP_INACTIVE: Final = 1 << 5  # CiA 402 calls it "quick stop": 0 while one is under way
WARNING: Final = 1 << 7
REFERENCED: Final = 1 << 8  # manufacturer's: the position refers to the home fixture (homing was done)
REMOTE: Final = 1 << 9  # the controlword is obeyed
TARGET_REACHED: Final = 1 << 10
INTERNAL_LIMIT: Final = 1 << 11
TARGET_USED: Final = 1 << 12  # in CST: the drive follows the target value
HOMING_ATTAINED: Final = 1 << 12  # in homing mode
HOMING_ERROR: Final = 1 << 13  # in homing mode

# controlword 6040
HOMING_START: Final = 1 << 4  # in homing mode
FAULT_RESET: Final = 1 << 7  # acts by its rising edge
HALT: Final = 1 << 8


class DriveState(Enum):
    """States, each with its (mask, pattern) in the statusword: bits 6, 5 and 3 to 0."""

    NOT_READY = (0x4F, 0x00)
    SWITCH_ON_DISABLED = (0x4F, 0x40)
    READY_TO_SWITCH_ON = (0x6F, 0x21)
    SWITCHED_ON = (0x6F, 0x23)
    OPERATION_ENABLED = (0x6F, 0x27)
    QUICK_STOP_ACTIVE = (0x6F, 0x07)
    FAULT_REACTION_ACTIVE = (0x4F, 0x0F)
    FAULT = (0x4F, 0x08)

    @property
    def words(self) -> str:
        """The state as CiA 402 spells it, in lower case."""
        return self.name.lower().replace("_", " ")


class Command(Enum):
    """Commands, each with (mask, pattern) in the controlword and its name.

    0111 means two commands, told apart by the state alone. Bit 7 is nobody's but the fault reset's, which is its
    rising edge: a master that leaves it set can still stop the drive.
    """

    SHUTDOWN = (0x07, 0x06, "shutdown")
    SWITCH_ON = (0x0F, 0x07, "switch on")
    ENABLE_OPERATION = (0x0F, 0x0F, "enable operation")
    DISABLE_OPERATION = (0x0F, 0x07, "disable operation")
    QUICK_STOP = (0x06, 0x02, "quick stop")
    DISABLE_VOLTAGE = (0x02, 0x00, "disable voltage")
    FAULT_RESET = (0x80, 0x80, "fault reset")

    def __init__(self, mask: int, pattern: int, words: str) -> None:
        self.mask = mask
        self.pattern = pattern
        self.words = words


class Event(Enum):
    """What moves a drive without a command."""

    POWER_ON = "power on"
    INITIALISED = "initialised"
    QUICK_STOP_DONE = "quick stop done"
    FAULT_DETECTED = "fault detected"
    FAULT_REACTION_DONE = "fault reaction done"


class OperationMode(IntEnum):
    """Modes of operation, objects 6060 and 6061."""

    NONE = 0
    PROFILE_POSITION = 1
    PROFILE_VELOCITY = 3
    PROFILE_TORQUE = 4
    HOMING = 6
    CSP = 8
    CSV = 9
    CST = 10


class Transition(NamedTuple):
    """A transition: its number in CiA 402 and the state it leads to."""

    number: int
    target: DriveState


STATE_BITS: Final[Mapping[DriveState, int]] = MappingProxyType({state: state.value[1] for state in DriveState})

_S = DriveState
_C = Command

TRANSITIONS: Final[Mapping[tuple[DriveState, Command], Transition]] = MappingProxyType(
    {
        (_S.SWITCH_ON_DISABLED, _C.SHUTDOWN): Transition(2, _S.READY_TO_SWITCH_ON),
        (_S.READY_TO_SWITCH_ON, _C.SWITCH_ON): Transition(3, _S.SWITCHED_ON),
        # enable operation does 3, and in the state it then finds itself in, 4
        (_S.READY_TO_SWITCH_ON, _C.ENABLE_OPERATION): Transition(3, _S.SWITCHED_ON),
        (_S.SWITCHED_ON, _C.ENABLE_OPERATION): Transition(4, _S.OPERATION_ENABLED),
        (_S.OPERATION_ENABLED, _C.DISABLE_OPERATION): Transition(5, _S.SWITCHED_ON),
        (_S.SWITCHED_ON, _C.SHUTDOWN): Transition(6, _S.READY_TO_SWITCH_ON),
        (_S.READY_TO_SWITCH_ON, _C.DISABLE_VOLTAGE): Transition(7, _S.SWITCH_ON_DISABLED),
        (_S.READY_TO_SWITCH_ON, _C.QUICK_STOP): Transition(7, _S.SWITCH_ON_DISABLED),
        (_S.OPERATION_ENABLED, _C.SHUTDOWN): Transition(8, _S.READY_TO_SWITCH_ON),
        (_S.OPERATION_ENABLED, _C.DISABLE_VOLTAGE): Transition(9, _S.SWITCH_ON_DISABLED),
        (_S.SWITCHED_ON, _C.DISABLE_VOLTAGE): Transition(10, _S.SWITCH_ON_DISABLED),
        (_S.SWITCHED_ON, _C.QUICK_STOP): Transition(10, _S.SWITCH_ON_DISABLED),
        (_S.OPERATION_ENABLED, _C.QUICK_STOP): Transition(11, _S.QUICK_STOP_ACTIVE),
        (_S.QUICK_STOP_ACTIVE, _C.DISABLE_VOLTAGE): Transition(12, _S.SWITCH_ON_DISABLED),
        (_S.FAULT, _C.FAULT_RESET): Transition(15, _S.SWITCH_ON_DISABLED),
        (_S.QUICK_STOP_ACTIVE, _C.ENABLE_OPERATION): Transition(16, _S.OPERATION_ENABLED),
    }
)

# None: before power-on there is no state
AUTOMATIC_TRANSITIONS: Final[Mapping[tuple[DriveState | None, Event], Transition]] = MappingProxyType(
    {
        (None, Event.POWER_ON): Transition(0, _S.NOT_READY),
        (_S.NOT_READY, Event.INITIALISED): Transition(1, _S.SWITCH_ON_DISABLED),
        (_S.QUICK_STOP_ACTIVE, Event.QUICK_STOP_DONE): Transition(12, _S.SWITCH_ON_DISABLED),
        (_S.NOT_READY, Event.FAULT_DETECTED): Transition(13, _S.FAULT_REACTION_ACTIVE),
        (_S.SWITCH_ON_DISABLED, Event.FAULT_DETECTED): Transition(13, _S.FAULT_REACTION_ACTIVE),
        (_S.READY_TO_SWITCH_ON, Event.FAULT_DETECTED): Transition(13, _S.FAULT_REACTION_ACTIVE),
        (_S.SWITCHED_ON, Event.FAULT_DETECTED): Transition(13, _S.FAULT_REACTION_ACTIVE),
        (_S.OPERATION_ENABLED, Event.FAULT_DETECTED): Transition(13, _S.FAULT_REACTION_ACTIVE),
        (_S.QUICK_STOP_ACTIVE, Event.FAULT_DETECTED): Transition(13, _S.FAULT_REACTION_ACTIVE),
        (_S.FAULT_REACTION_ACTIVE, Event.FAULT_REACTION_DONE): Transition(14, _S.FAULT),
    }
)

# what a master commands in a state (row) to come nearer to its goal (table); a state that is absent is only waited for,
# with the voltage disabled. A fault is reset by the goal "switch on disabled" alone: nothing enables over a fault.
_PATHS: Final[Mapping[DriveState, Mapping[DriveState, Command]]] = MappingProxyType(
    {
        _S.SWITCH_ON_DISABLED: {_S.FAULT: _C.FAULT_RESET},
        _S.READY_TO_SWITCH_ON: {
            _S.SWITCH_ON_DISABLED: _C.SHUTDOWN,
            _S.READY_TO_SWITCH_ON: _C.SHUTDOWN,
            _S.SWITCHED_ON: _C.SHUTDOWN,
            _S.OPERATION_ENABLED: _C.SHUTDOWN,
        },
        _S.SWITCHED_ON: {
            _S.SWITCH_ON_DISABLED: _C.SHUTDOWN,
            _S.READY_TO_SWITCH_ON: _C.SWITCH_ON,
            _S.SWITCHED_ON: _C.SWITCH_ON,
            _S.OPERATION_ENABLED: _C.DISABLE_OPERATION,
        },
        _S.OPERATION_ENABLED: {
            _S.SWITCH_ON_DISABLED: _C.SHUTDOWN,
            _S.READY_TO_SWITCH_ON: _C.SWITCH_ON,
            _S.SWITCHED_ON: _C.ENABLE_OPERATION,
            _S.OPERATION_ENABLED: _C.ENABLE_OPERATION,
        },
        _S.QUICK_STOP_ACTIVE: {_S.OPERATION_ENABLED: _C.QUICK_STOP, _S.QUICK_STOP_ACTIVE: _C.QUICK_STOP},
    }
)


def decode_state(statusword: int) -> DriveState | None:
    """The state in a statusword, or None when its bits make up no state."""
    for state in DriveState:
        mask, pattern = state.value
        if statusword & mask == pattern:
            return state
    return None


def walk(state: DriveState, controlword: int, previous: int, *, barred: Collection[int] = ()) -> tuple[Transition, ...]:
    """The transitions that a controlword makes, in order; two when it enables from 'ready to switch on', mostly none.

    Args:
        state: Where the drive stands.
        controlword: What it is told now.
        previous: What it was told before; the fault reset is a rising edge.
        barred: Numbers of transitions whose conditions do not hold now: 15 while the cause of the fault is there, 16
            unless quick stop leaves the drive in its state (605A = 5 to 8).
    """
    if state is DriveState.FAULT:
        reset = TRANSITIONS[state, Command.FAULT_RESET]
        return (reset,) if controlword & ~previous & FAULT_RESET and reset.number not in barred else ()
    made: list[Transition] = []
    while (step := _step(state, controlword)) is not None and step.number not in barred:
        made.append(step)
        state = step.target
    return tuple(made)


def controlword_towards(state: DriveState, goal: DriveState) -> int:
    """The controlword that brings a drive one step nearer to the goal, or holds it there.

    From 'fault' only the goal 'switch on disabled' leads out: it gives the fault reset, whose edge needs a controlword
    without bit 7 before. Towards any other goal a faulted drive gets 'disable voltage'.

    Args:
        state: Where the drive stands.
        goal: Any state that a command can reach.

    Raises:
        ValueError: The goal is a state that no command leads to.
    """
    path = _PATHS.get(goal)
    if path is None:
        raise ValueError(f"no command leads a drive to '{goal.words}'")
    return path.get(state, Command.DISABLE_VOLTAGE).pattern


def supports(supported_modes: int, mode: OperationMode) -> bool:
    """Whether object 6502 announces the mode: bit n - 1 stands for mode n."""
    return mode > 0 and bool(supported_modes >> (mode - 1) & 1)


def _step(state: DriveState, controlword: int) -> Transition | None:
    for command in Command:
        if command is not Command.FAULT_RESET and controlword & command.mask == command.pattern:
            transition = TRANSITIONS.get((state, command))
            if transition is not None:
                return transition
    return None
