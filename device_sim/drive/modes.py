"""Modes of operation: cyclic synchronous torque, torque profile and homing (objects 6060, 6061, 605D)."""

from collections.abc import Callable
from typing import Final

from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.device_sim.drive import objects
from torquerig.device_sim.drive.homing import Homing
from torquerig.device_sim.drive.torque_command import TorqueCommand
from torquerig.device_sim.drive.torque_path import TorquePath
from torquerig.driver.wire.cia402 import HALT, HOMING_START, TARGET_REACHED, TARGET_USED, OperationMode
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort

SUPPORTED: Final = frozenset({OperationMode.PROFILE_TORQUE, OperationMode.HOMING, OperationMode.CST})


class Modes:
    """What operation means while it is enabled.

    CST follows the target at once; torque profile ramps to it with 6087; homing gives no torque. Halt (controlword bit
    8) ramps to zero in all of them, with 6087 whatever 605D says, and its end goes back to the target.

    Attributes:
        following: Cyclic synchronous torque is in operation: a new target is for `TorqueCommand.follow`.
    """

    __slots__ = (
        "_arrived",
        "_command",
        "_controlword",
        "_homing",
        "_mode",
        "_operating",
        "_path",
        "_store",
        "following",
    )

    def __init__(
        self,
        store: ObjectStore,
        path: TorquePath,
        command: TorqueCommand,
        homing: Homing,
        *,
        arrived: Callable[[int], None],
    ) -> None:
        """Build them.

        Args:
            store: Objects of the drive.
            path: Knows the target.
            command: Brings the torque there.
            homing: What the homing mode does.
            arrived: Called with the time at which a ramp has reached its target.
        """
        self._arrived = arrived
        self._store = store
        self._path = path
        self._command = command
        self._homing = homing
        self._controlword = 0
        self._mode = OperationMode.CST
        self._operating = False
        self.following = False
        store.guard(self._guard, objects.MODE)

    def power_on(self) -> None:
        """Begin in the mode that 6060 has at power-on."""
        self._controlword = 0
        self._operating = False
        self.following = False
        self._homing.power_on()
        self._load_mode()

    def operate(self, at_ns: int, effect_ns: int) -> None:
        """Operation is enabled: go where the target is."""
        self._operating = True
        self.head_for_target(at_ns, effect_ns)

    def rest(self) -> None:
        """Operation is not enabled, or ends: somebody else rules the torque."""
        self._operating = False
        self.following = False

    def obey(self, controlword: int, at_ns: int, effect_ns: int) -> None:
        """Take over the mode's own bits of the controlword: halt (8), and homing's start (4, its rising edge).

        Homing starts only if operation was enabled before.
        """
        changed = controlword ^ self._controlword
        self._controlword = controlword
        if changed & controlword & HOMING_START and self._operating and self._mode is OperationMode.HOMING:
            self._homing.start(at_ns)
        if changed & HALT:
            self.head_for_target(at_ns, effect_ns)

    def change(self, at_ns: int, effect_ns: int) -> None:
        """6060 was written; 0 changes no mode."""
        if self._store.get(objects.MODE) not in {OperationMode.NONE, self._mode}:
            self._load_mode()
            self.head_for_target(at_ns, effect_ns)

    def head_for_target(self, at_ns: int, effect_ns: int) -> None:
        """The target, a limit, the mode or halt has changed."""
        if not self._operating:
            return
        halted = bool(self._controlword & HALT)
        self.following = self._mode is OperationMode.CST and not halted
        if halted:
            self._command.ramp(0.0, at_ns, self._arrived)
        elif self.following:
            self._command.follow(at_ns, effect_ns)
        elif self._mode is OperationMode.PROFILE_TORQUE:
            self._command.ramp(self._path.target(), at_ns, self._arrived)
        else:
            self._command.cut(at_ns)

    @property
    def status_bits(self) -> int:
        """The statusword bits whose meaning is the mode's: 10, 12 and 13."""
        if self._mode is OperationMode.HOMING:
            return self._homing.status_bits
        if self._mode is OperationMode.CST:
            return TARGET_USED if self.following else 0
        return TARGET_REACHED if self._operating and not self._command.ramping else 0

    def _load_mode(self) -> None:
        self._mode = OperationMode(self._store.get(objects.MODE))
        self._store.set(self._mode, objects.MODE_DISPLAY)

    def _guard(self, subindex: int, value: int) -> None:
        if value not in SUPPORTED and value != OperationMode.NONE:
            raise SdoAbort(AbortCode.INVALID_VALUE, objects.MODE, subindex)
