"""What the drive watches for its own and its motor's sake: current, I2t, speed, temperatures, DC link."""

import math
from collections.abc import Callable
from typing import Final

from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.device_sim.canopen.timers import Timers
from torquerig.device_sim.drive import fault_injection, objects
from torquerig.device_sim.drive.encoder import Encoder
from torquerig.device_sim.drive.fault_injection import Injection
from torquerig.device_sim.drive.load import LaggedLoad
from torquerig.device_sim.drive.parameters import DriveParameters
from torquerig.device_sim.machine import Machine
from torquerig.driver.wire.emcy import EmergencyCode

_RPM: Final = math.tau / 60.0  # [rad/s]
TRIP_LOAD: Final = 1.0  # I2t of the rated torque, flowing for ever
_WARM: Final = 1.0  # by which an injected temperature exceeds its maximum [°C]


class Protection:
    """Trips the drive at once where it can be told at once (current, I2t, injected faults), else at the next look.

    It looks at every SYNC, and every supervision period. I2t is the lagged square of the torque in units of the rated
    one; it trips at 1 (object 2100:3: 100 %), so the rated torque may flow for ever.

    Attributes:
        look: The alarm of its next look.
    """

    __slots__ = (
        "_axis",
        "_device",
        "_encoder",
        "_i2t",
        "_i2t_timer",
        "_injected",
        "_machine",
        "_motor",
        "_overcurrent",
        "_overspeed",
        "_parameters",
        "_store",
        "_trip",
        "look",
    )

    def __init__(
        self,
        machine: Machine,
        axis: int,
        store: ObjectStore,
        timers: Timers,
        *,
        parameters: DriveParameters,
        encoder: Encoder,
        trip: Callable[[EmergencyCode, int], None],
    ) -> None:
        """Build it.

        Args:
            machine: What the motor turns.
            axis: Which motor of it.
            store: Objects of the drive.
            timers: Alarms of the drive.
            parameters: The truth about the drive.
            encoder: The encoder, which can be lost.
            trip: Takes the drive into fault, at a time.
        """
        self._machine = machine
        self._axis = axis
        self._store = store
        self._parameters = parameters
        self._encoder = encoder
        self._trip = trip
        self._i2t = LaggedLoad(1.0)
        self._device = LaggedLoad(parameters.device_time_constant)
        self._motor = LaggedLoad(parameters.motor_time_constant)
        self._injected: set[Injection] = set()
        self._i2t_timer = timers.add(lambda at_ns: trip(EmergencyCode.I2T, at_ns))
        self.look = timers.add(self._look)
        self._overspeed = math.inf
        self._overcurrent = math.inf
        self._join_objects(store)

    def _join_objects(self, store: ObjectStore) -> None:
        store.source(lambda at_ns: _tenths(self._device_temperature(at_ns)), *objects.DEVICE_TEMPERATURE)
        store.source(lambda at_ns: _tenths(self._motor_temperature(at_ns)), *objects.MOTOR_TEMPERATURE)
        store.source(lambda at_ns: min(round(100.0 * self._i2t.value(at_ns)), 0xFFFF), *objects.I2T_LOAD)
        store.source(lambda _at_ns: self._dc_link(), objects.DC_LINK_VOLTAGE)
        store.watch(self._levels_written, objects.TRIP_LEVELS)
        fault_injection.install(store, self._inject)

    def power_on(self, at_ns: int) -> None:
        """Begin cold, with nothing injected."""
        self._injected.clear()
        self._load_levels()
        self._i2t.set_time_constant(self._store.get(*objects.I2T_TIME_CONSTANT) / 1000.0, at_ns)
        for load in (self._i2t, self._device, self._motor):
            load.reset(at_ns)
        self._i2t_timer.cancel()
        self.look.arm(at_ns + self._parameters.supervision_ns)

    def load(self, torque: float, at_ns: int) -> None:
        """Another torque is commanded.

        Args:
            torque: The motor's torque [N·m].
            at_ns: From when on [ns].
        """
        share = torque / self._parameters.rated_torque
        load = share * share
        self._i2t.change(load, at_ns)
        if load > TRIP_LOAD or self._i2t_timer.is_set:
            self._schedule_i2t()
        if abs(share) > self._overcurrent:
            self._trip(EmergencyCode.OVERCURRENT, at_ns)

    def lend(self) -> tuple[float, ...] | None:
        """What a steady cycle goes on with (`steady_memory.PROTECTION`); None if I2t is about to trip."""
        if self._i2t_timer.is_set:
            return None
        return self._parameters.rated_torque, self._overspeed, self._overcurrent, *self._i2t.lend()

    def take_back(self, warmth: float, load: float, at_ns: int) -> None:
        """Go on from where a steady cycle ended."""
        self._i2t.take_back(warmth, load, at_ns)

    def check_speed(self, at_ns: int) -> None:
        """Trip if the motor turns too fast."""
        speed = self._machine.motor_velocity(self._axis, at_ns)
        if speed > self._overspeed or speed < -self._overspeed:
            self._trip(EmergencyCode.OVERSPEED, at_ns)

    def look_calmly(self, at_ns: int) -> bool:
        """Look, if that trips nothing; whether it did."""
        parameters = self._parameters
        device, motor = self._device.value(at_ns), self._motor.value(at_ns)
        is_calm = (
            not self._injected
            and abs(self._machine.motor_velocity(self._axis, at_ns)) <= self._overspeed
            and parameters.ambient + parameters.device_rise * device <= parameters.device_maximum
            and parameters.ambient + parameters.motor_rise * motor <= parameters.motor_maximum
            and self.voltage_good
        )
        if is_calm:
            self.look.arm(at_ns + parameters.supervision_ns)
            heat = self._i2t.value(at_ns)
            self._device.take_back(device, heat, at_ns)
            self._motor.take_back(motor, heat, at_ns)
        return is_calm

    @property
    def voltage_good(self) -> bool:
        """Whether the DC link's voltage is within its limits."""
        return self._undervoltage_level() <= self._dc_link() <= self._parameters.dc_link_maximum

    def causes_gone(self, at_ns: int) -> bool:
        """Whether nothing is left that would trip the drive again, so that its fault may be reset."""
        parameters = self._parameters
        return (
            not self._injected
            and self.voltage_good
            and self._i2t.value(at_ns) < parameters.i2t_reset_load
            and self._device_temperature(at_ns) < parameters.device_maximum - parameters.hysteresis
            and self._motor_temperature(at_ns) < parameters.motor_maximum - parameters.hysteresis
            and abs(self._machine.motor_velocity(self._axis, at_ns)) <= self._overspeed
        )

    def _schedule_i2t(self) -> None:
        self._i2t_timer.arm(self._i2t.reaches_ns(TRIP_LOAD))

    def _look(self, at_ns: int) -> None:
        self.look.arm(at_ns + self._parameters.supervision_ns)
        heat = self._i2t.value(at_ns)  # the winding warms first, then what is around it
        self._device.change(heat, at_ns)
        self._motor.change(heat, at_ns)
        self.check_speed(at_ns)
        self._check_slow(at_ns)

    def _check_slow(self, at_ns: int) -> None:
        if self._device_temperature(at_ns) > self._parameters.device_maximum:
            self._trip(EmergencyCode.DEVICE_TEMPERATURE, at_ns)
        if self._motor_temperature(at_ns) > self._parameters.motor_maximum:
            self._trip(EmergencyCode.DRIVE_TEMPERATURE, at_ns)
        if not self.voltage_good:
            low = self._dc_link() < self._undervoltage_level()
            self._trip(EmergencyCode.DC_UNDERVOLTAGE if low else EmergencyCode.DC_OVERVOLTAGE, at_ns)

    def _inject(self, injection: Injection, at_ns: int) -> None:
        if injection is Injection.CLEAR:
            self._injected.clear()
            self._encoder.recover()
        elif injection is Injection.OVERCURRENT:
            self._trip(EmergencyCode.OVERCURRENT, at_ns)
        elif injection is Injection.ENCODER_LOSS:
            self._injected.add(injection)
            self._encoder.lose(at_ns)
            self._trip(EmergencyCode.ENCODER, at_ns)
        else:
            self._injected.add(injection)
            self._check_slow(at_ns)

    def _device_temperature(self, at_ns: int) -> float:
        """Temperature of the power stage [°C]."""
        parameters = self._parameters
        if Injection.DEVICE_TEMPERATURE in self._injected:
            return parameters.device_maximum + _WARM
        return parameters.ambient + parameters.device_rise * self._device.value(at_ns)

    def _motor_temperature(self, at_ns: int) -> float:
        """Temperature of the winding [°C]."""
        parameters = self._parameters
        if Injection.MOTOR_TEMPERATURE in self._injected:
            return parameters.motor_maximum + _WARM
        return parameters.ambient + parameters.motor_rise * self._motor.value(at_ns)

    def _dc_link(self) -> int:
        """Voltage of the DC link [mV]."""
        if Injection.UNDERVOLTAGE in self._injected:
            return 0
        if Injection.OVERVOLTAGE in self._injected:
            return self._parameters.dc_link_maximum + 1
        return self._parameters.dc_link

    def _undervoltage_level(self) -> int:
        return self._store.get(*objects.UNDERVOLTAGE_LEVEL)

    def _load_levels(self) -> None:
        get = self._store.get
        self._overcurrent = get(*objects.OVERCURRENT_LEVEL) / 1000.0
        self._overspeed = get(*objects.OVERSPEED_LEVEL) * _RPM

    def _levels_written(self, at_ns: int, _effect_ns: int) -> None:
        self._load_levels()
        self._i2t.set_time_constant(self._store.get(*objects.I2T_TIME_CONSTANT) / 1000.0, at_ns)
        self._schedule_i2t()
        self._check_slow(at_ns)


def _tenths(temperature: float) -> int:
    """As objects 2100:1 and 2100:2 tell it [0.1 °C]."""
    return max(0, min(round(10.0 * temperature), 0xFFFF))
