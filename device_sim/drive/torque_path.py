"""From counts to torque and back: limits, saturation, and the amplifier's true gain (objects 607x, 60Ex, 207x)."""

from collections.abc import Callable
from typing import Final

from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.device_sim.drive import objects
from torquerig.device_sim.drive.parameters import DriveParameters
from torquerig.device_sim.machine import Machine

_INT16: Final = 32767
_MILLI: Final = 1e-3


class TorquePath:
    """The last stage before the motor.

    Inside, a torque is a number of counts as the firmware sees them; a per mille of rated torque (6076) is worth
    nominal_gain x 6076 / 10^6 of them. What the counts do is the amplifier's gain, another one in each direction.

    Attributes:
        demand: What the current loop is told, after all limits [counts].
        limited: A limit (6072, 60E0, 60E1) or the saturation changed the last command.
    """

    __slots__ = (
        "_axis",
        "_counts_per_permille",
        "_high",
        "_limit_changed",
        "_low",
        "_machine",
        "_offset",
        "_parameters",
        "_raw",
        "_source",
        "_store",
        "_target",
        "_torque",
        "_torque_changed",
        "_values",
        "demand",
        "limited",
    )

    def __init__(
        self,
        machine: Machine,
        axis: int,
        store: ObjectStore,
        parameters: DriveParameters,
        *,
        limit_changed: Callable[[], None],
        torque_changed: Callable[[float, int], None],
    ) -> None:
        """Build it.

        Args:
            machine: What the motor turns.
            axis: Which motor of it.
            store: Objects of the drive.
            parameters: The truth about the drive.
            limit_changed: Called when `limited` has changed.
            torque_changed: Called after every command with the torque [N·m] and its time [ns].
        """
        self._machine = machine
        self._axis = axis
        self._store = store
        self._values = store.values
        self._parameters = parameters
        self._limit_changed = limit_changed
        self._torque_changed = torque_changed
        self._source = store.slot(objects.TORQUE_SOURCE)
        self._raw = store.slot(objects.RAW_TARGET)
        self._target = store.slot(objects.TARGET_TORQUE)
        self._offset = store.slot(objects.TORQUE_OFFSET)
        self._counts_per_permille = 1.0
        self._low = self._high = 0.0
        self._torque = 0.0
        self.demand = 0.0
        self.limited = False
        self._join_objects(store)

    def _join_objects(self, store: ObjectStore) -> None:
        store.source(self.raw_actual, objects.RAW_ACTUAL)
        store.source(self.permille_actual, objects.TORQUE_ACTUAL)
        store.source(self.permille_actual, objects.CURRENT_ACTUAL)  # torque is proportional to current
        store.source(lambda _at_ns: _int16(self.demand / self._counts_per_permille), objects.TORQUE_DEMAND)
        store.watch(
            lambda _at_ns, _effect_ns: self._load_scale(),
            objects.RATED_TORQUE,
            objects.MAX_TORQUE,
            objects.POSITIVE_LIMIT,
            objects.NEGATIVE_LIMIT,
        )

    def power_on(self, at_ns: int) -> None:
        """Begin without torque."""
        self._load_scale()
        self.demand = 0.0
        self.limited = False
        self._torque = 0.0
        self._machine.set_torque_demand(self._axis, 0.0, at_ns)

    def target(self) -> float:
        """What the objects ask for: 2071, or 6071 if 2070 says so, and the offset 60B2 [counts]."""
        values = self._values
        offset = values[self._offset]
        if values[self._source]:
            raw = values[self._raw]
            return raw + offset * self._counts_per_permille if offset else float(raw)
        return (values[self._target] + offset) * self._counts_per_permille

    def clamp(self, counts: float) -> float:
        """The command within the limits 6072, 60E0 and 60E1, and what the current loop can give [counts]."""
        return min(max(counts, self._low), self._high)

    @property
    def slope(self) -> float:
        """Torque slope 6087 [counts/s]."""
        return self._store.get(objects.TORQUE_SLOPE) * self._counts_per_permille

    def apply(self, counts: float, at_ns: int) -> None:
        """Command the current loop.

        Args:
            counts: The command [counts].
            at_ns: From when on [ns].
        """
        parameters = self._parameters
        demand = counts
        if demand > self._high:
            demand = self._high
        elif demand < self._low:
            demand = self._low
        torque = demand / (parameters.gain_positive if demand >= 0.0 else parameters.gain_negative)
        self.demand = demand
        if torque != self._torque:
            self._torque = torque
            self._machine.set_torque_demand(self._axis, torque, at_ns)
        limited = demand != counts
        if limited is not self.limited:
            self.limited = limited
            self._limit_changed()
        self._torque_changed(torque, at_ns)

    def lend(self) -> tuple[float, ...]:
        """What a steady cycle goes on with (`steady_memory.PATH`)."""
        values, parameters = self._values, self._parameters
        targets = values[self._raw], values[self._target], values[self._offset], not values[self._source]
        gains = parameters.gain_positive, parameters.gain_negative, self._counts_per_permille
        return (*targets, *gains, self._low, self._high, self.limited, self.demand, self._torque)

    def take_back(self, raw: int, permille: int, demand: float, torque: float) -> None:
        """Go on from where a steady cycle ended."""
        self._values[self._raw], self._values[self._target] = raw, permille
        self.demand, self._torque = demand, torque

    def raw_actual(self, at_ns: int) -> int:
        """Object 2077: the motor's torque as the drive measures it [counts]."""
        return _int16(self._actual(at_ns))

    def permille_actual(self, at_ns: int) -> int:
        """Objects 6077 and 6078 [per mille of rated]."""
        return _int16(self._actual(at_ns) / self._counts_per_permille)

    def _actual(self, at_ns: int) -> float:
        torque = self._machine.motor_torque(self._axis, at_ns)
        return torque * self._parameters.gain(torque)

    def _load_scale(self) -> None:
        get = self._store.get
        self._counts_per_permille = get(objects.RATED_TORQUE) * _MILLI * _MILLI * self._parameters.nominal_gain
        maximum = get(objects.MAX_TORQUE)
        peak = self._parameters.peak_torque
        high = min(maximum, get(objects.POSITIVE_LIMIT)) * self._counts_per_permille
        low = min(maximum, get(objects.NEGATIVE_LIMIT)) * self._counts_per_permille
        self._high = min(high, peak * self._parameters.gain_positive)
        self._low = -min(low, peak * self._parameters.gain_negative)


def _int16(value: float) -> int:
    counts = round(value)
    return counts if -_INT16 - 1 <= counts <= _INT16 else _INT16 if counts > 0 else -_INT16 - 1
