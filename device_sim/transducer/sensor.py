"""The strain gauge, its amplifier and converter behind a transducer's CANopen node (CiA 404, analogue input)."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from math import isfinite
from typing import Final

import numpy as np

from torquerig.device_sim.canopen.application import CommunicationEvent
from torquerig.device_sim.canopen.node import CanopenNode
from torquerig.device_sim.transducer import objects
from torquerig.driver.wire.emcy import Emergency
from torquerig.driver.wire.measuring import AiStatus
from torquerig.driver.wire.sdo_abort import AbortCode, SdoAbort

HARDWARE_FAULT: Final = 0x5000  # class "device hardware" of CiA 301, 7.2.7.1
_US: Final = 1_000  # [ns]
_INT32: Final = 0x7FFF_FFFF
_EARLY: Final = 0.3  # share of the range at which an amplifier clips that is broken so; our choice

ShaftTorque = Callable[[int], float]  # time [ns] -> torque [N·m]


class SensorFault(Enum):
    """What can be wrong with a transducer; its value is the configuration's word."""

    NONE = "none"
    DEAD = "dead"
    """The value stands still where it was, and the status finds nothing wrong with it."""
    SATURATED = "saturated"
    """The amplifier clips at 30 % of the range, and does not notice."""
    DISCONNECTED = "disconnected"
    """A wire of the bridge is broken: full scale, status not valid, EMCY 0x5000."""
    REVERSED = "reversed"
    """Mounted the other way round: torques have the other sign."""


@dataclass(frozen=True, slots=True)
class SensorParameters:
    """What is true of a transducer, whether or not its objects say so.

    Attributes:
        range: Torque at which it saturates [N·m].
        noise: Standard deviation of a conversion's white noise [N·m].
        offset: What it shows without torque before any zeroing [N·m].
        fault: What is wrong with it.
        seed: Of its noise.

    Raises:
        ValueError: A value is out of range.
    """

    range: float = 1.0
    noise: float = 5e-4
    offset: float = 0.0
    fault: SensorFault = SensorFault.NONE
    seed: int = 0

    def __post_init__(self) -> None:
        if not (isfinite(self.range) and self.range > 0.0):
            raise ValueError(f"range is {self.range} N·m: must be finite and above 0")
        if not (isfinite(self.noise) and self.noise >= 0.0):
            raise ValueError(f"noise is {self.noise} N·m: must be finite and not below 0")
        if not isfinite(self.offset):
            raise ValueError(f"offset is {self.offset} N·m: must be finite")


class TorqueSensor:
    """Converts what the shaft feels, free-running; satisfies application.Application.

    Between two conversions (6114) it tells the last one's value.
    """

    def __init__(self, node: CanopenNode, shaft: ShaftTorque, parameters: SensorParameters) -> None:
        """Join it to the node's objects.

        Args:
            node: The node whose application it is.
            shaft: What the shaft feels.
            parameters: The truth about it.
        """
        self._node = node
        self._shaft = shaft
        self._parameters = parameters
        self._fault = parameters.fault
        self._rng = np.random.default_rng(parameters.seed)
        self._power_on_ns = 0
        self._conversion = -1
        self._torque = 0.0  # as converted, before scale and offset [N·m]
        self._frozen: float | None = None
        self._status = AiStatus(0)
        store = node.store
        self._per_nm = 10.0 ** store.get(*objects.DECIMAL_DIGITS)
        store.source(self._field_value, *objects.FIELD_VALUE)
        store.source(self._process_value, *objects.PROCESS_VALUE)
        store.source(self._read_status, *objects.STATUS)
        store.guard(self._guard_autozero, objects.AUTOZERO[0])
        store.watch(lambda at_ns, _effect_ns: self._zero(at_ns), objects.AUTOZERO[0])

    def power_on(self, at_ns: int) -> None:
        """Begin to convert."""
        self._power_on_ns = at_ns
        self._conversion = -1
        self._frozen = None
        self.suffer(self._fault, at_ns)

    def synchronise(self, at_ns: int) -> None:
        """A SYNC: the converter runs on by itself."""

    def handle_event(self, event: CommunicationEvent, at_ns: int) -> None:
        """Something happened to the communication: nothing here can do harm."""

    def hear_emergency(self, emergency: Emergency, at_ns: int) -> None:
        """Another node told an emergency."""

    def suffer(self, fault: SensorFault, at_ns: int) -> None:
        """From now on this is wrong with it, and nothing else."""
        self._fault = fault
        self._conversion = -1
        self._frozen = None
        if fault is SensorFault.DISCONNECTED:
            self._node.emergency.report(HARDWARE_FAULT, at_ns)
        else:
            self._node.emergency.clear(HARDWARE_FAULT, at_ns)

    def _convert(self, at_ns: int) -> None:
        number = (at_ns - self._power_on_ns) // (self._node.store.get(*objects.SAMPLE_RATE) * _US)
        if number == self._conversion:
            return
        self._conversion = number
        parameters, fault = self._parameters, self._fault
        if fault is SensorFault.DISCONNECTED:
            self._torque, self._status = parameters.range, AiStatus.NOT_VALID | AiStatus.POSITIVE_OVERLOAD
            return
        if self._frozen is not None:
            return
        felt = self._shaft(at_ns)
        if fault is SensorFault.REVERSED:
            felt = -felt
        torque = felt + parameters.offset + parameters.noise * float(self._rng.standard_normal())
        bound = parameters.range * (_EARLY if fault is SensorFault.SATURATED else 1.0)
        self._torque = min(max(torque, -bound), bound)
        self._status = AiStatus(0)
        if abs(torque) > parameters.range:
            self._status = AiStatus.POSITIVE_OVERLOAD if torque > 0.0 else AiStatus.NEGATIVE_OVERLOAD
        if fault is SensorFault.DEAD:
            self._frozen = self._torque

    def _field_value(self, at_ns: int) -> int:
        self._convert(at_ns)
        return max(-_INT32 - 1, min(_INT32, round(self._torque * self._per_nm)))

    def _process_value(self, at_ns: int) -> int:
        value = self._field_value(at_ns) + self._node.store.get(*objects.OFFSET)
        return max(-_INT32 - 1, min(_INT32, value))

    def _read_status(self, at_ns: int) -> int:
        self._convert(at_ns)
        return int(self._status)

    def _guard_autozero(self, subindex: int, value: int) -> None:
        if value != objects.ZERO_SIGNATURE:
            raise SdoAbort(AbortCode.CANNOT_STORE, objects.AUTOZERO[0], subindex)
        if self._status & AiStatus.NOT_VALID:
            raise SdoAbort(AbortCode.DEVICE_STATE, objects.AUTOZERO[0], subindex)

    def _zero(self, at_ns: int) -> None:
        """Give the offset the value that makes the process value zero."""
        self._node.store.set(-self._field_value(at_ns), *objects.OFFSET)
