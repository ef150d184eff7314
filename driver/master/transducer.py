"""A torque transducer beside the drives: a measuring device of CiA 404, configured and read over the same bus.

    with AxisGroup(bus, axes) as group:
        transducer = Transducer(group.session, TransducerSettings(node_id=10))
        transducer.open()
        transducer.zero()
        ...
        readings = transducer.take()

Its process value comes after every SYNC of the group's cycle; no value for a while is noticed by whoever asks.
"""

from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

from torquerig.driver.errors import ConfigurationMismatch, EdsError, NoAnswer
from torquerig.driver.master.configuration import EVENT_TIMER, TPDO_COMMUNICATION, TPDO_MAPPING, check_identity
from torquerig.driver.master.objects import DriveObjects
from torquerig.driver.master.profile import ObjectAddress
from torquerig.driver.master.pump import MILLISECOND_NS, SECOND_NS, heartbeat_cob
from torquerig.driver.master.sdo_jobs import Job
from torquerig.driver.master.session import DriveSession
from torquerig.driver.wire import cob, emcy, nmt, pdo
from torquerig.driver.wire.emcy import Emergency
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.measuring import (
    AUTOZERO,
    DECIMAL_DIGITS,
    PHYSICAL_UNIT,
    PROCESS_VALUES,
    PROFILE,
    REAL_PROCESS_VALUE,
    STATUS,
    TRANSDUCER_EDS,
    ZERO,
    AiStatus,
    split_unit,
)
from torquerig.driver.wire.nmt import NmtCommand, NmtState
from torquerig.driver.wire.sdo import SdoAbort, describe

CHANNEL: Final = 1  # sub-index of the analogue input that is read
_NUMBER: Final = 1  # TPDO1 carries it
_KEPT: Final = 4096  # readings between two `take`s: 16 s at 250 Hz


@dataclass(frozen=True, slots=True)
class TransducerSettings:
    """A transducer and how it is mounted.

    Attributes:
        node_id: Its node-id.
        eds: Its EDS.
        sign: 1 if it shows a positive torque where the drive's positive counts make one, else -1.
        stale_ns: Without a value for so long it counts as silent [ns].

    Raises:
        ValueError: A value is out of range.
    """

    node_id: int
    eds: Path = TRANSDUCER_EDS
    sign: int = 1
    stale_ns: int = 100 * MILLISECOND_NS

    def __post_init__(self) -> None:
        cob.check_node_id(self.node_id)
        if self.sign not in {1, -1}:
            raise ValueError(f"a transducer's sign is 1 or -1, not {self.sign}")
        if self.stale_ns < 1:
            raise ValueError(f"a transducer is given some time to send, not {self.stale_ns} ns")


class Reading(NamedTuple):
    """A value that came over the wire.

    Attributes:
        at_ns: When its frame was complete [ns].
        torque: The torque [N·m], positive as the drive's positive counts.
        status: What the transducer says of it.
    """

    at_ns: int
    torque: float
    status: AiStatus


class Transducer:
    """One transducer on the bus of a group of drives.

    Attributes:
        node_id: Its node-id.
        emergency: The last emergency heard, None when there was none or it was taken back.
        malformed: Frames of its TPDO that were too short.
    """

    def __init__(self, session: DriveSession, settings: TransducerSettings) -> None:
        """Read the EDS; nothing is sent before `open`.

        Args:
            session: What the drives' group stands on; it gives SYNC.
            settings: Which transducer.

        Raises:
            EdsError: The EDS cannot be read, or holds no process value.
            ValueError: A drive, or the master, has its node-id.
        """
        self.node_id = settings.node_id
        if self.node_id in {session.settings.master_id, *(axis.node_id for axis in session.axes)}:
            raise ValueError(f"node-id {self.node_id} is another's: a transducer needs one of its own")
        self.emergency: Emergency | None = None
        self.malformed = 0
        self._session = session
        self._settings = settings
        self._objects = DriveObjects(settings.node_id, settings.eds, kind="transducer")
        mapped = mapped_objects(self._objects, settings.eds)
        self._value = mapped[0]
        self._layout = self._objects.layout(mapped)
        self._unit = 0.0
        self._latest: Reading | None = None
        self._readings: deque[Reading] = deque(maxlen=_KEPT)
        self._trouble = ""

    def open(self) -> None:
        """See that it is a transducer of torque, let it send its value after every SYNC, and wait for the first.

        Raises:
            NoAnswer: It is silent.
            ConfigurationMismatch: It is no measuring device, measures something else, or refuses a setting.
            BusError: The bus is gone.
        """
        handlers = self._session.pump.handlers
        handlers[cob.TPDO[_NUMBER] + self.node_id] = self._hear
        handlers[cob.EMCY + self.node_id] = self._hear_emergency
        handlers[heartbeat_cob(self.node_id)] = self._hear_heartbeat
        self._command(NmtCommand.PRE_OPERATIONAL)
        self._run(self._configure())
        self._command(NmtCommand.START)
        self._session.serve_until(lambda: self._latest is not None)
        self._check_fresh()

    def close(self) -> None:
        """Let it be quiet."""
        self._command(NmtCommand.PRE_OPERATIONAL)

    def zero(self) -> None:
        """Make what it feels now its zero.

        Raises:
            ConfigurationMismatch: It has no object for that, or refuses.
            NoAnswer: It is silent.
        """
        self._run(self._write_zero())
        self._readings.clear()

    def latest(self) -> Reading:
        """The last value.

        Raises:
            NoAnswer: It is too old.
        """
        return self._check_fresh()

    def take(self) -> list[Reading]:
        """All values since the last `take`, oldest first.

        Raises:
            NoAnswer: The last one is too old.
        """
        self._check_fresh()
        readings = list(self._readings)
        self._readings.clear()
        return readings

    def _configure(self) -> Job[None]:
        objects = self._objects
        device_type = yield from objects.read_number(0x1000)
        if device_type & 0xFFFF != PROFILE:
            raise ConfigurationMismatch(
                f"node {self.node_id} is no measuring device: its device type (1000) is {device_type:#010x}, of profile"
                f" CiA {device_type & 0xFFFF} and not CiA {PROFILE}"
            )
        yield from check_identity(objects)
        self._unit = yield from self._read_unit()
        if objects.holds(0x1017):
            yield from objects.write_verified(0x1017, 0, self._session.settings.heartbeat_ms)
        yield from self._map()

    def _read_unit(self) -> Job[float]:
        """What a step of the process value is [N·m], signed."""
        objects = self._objects
        code = yield from objects.read_number(PHYSICAL_UNIT, CHANNEL)
        unit = split_unit(code)
        if not unit.is_torque:
            raise ConfigurationMismatch(
                f"transducer {self.node_id} measures no torque: its unit (6131) is {code:#010x}, where N·m is"
                " 0x00560000 with any prefix (CiA 303-2)"
            )
        exponent = unit.prefix
        if self._value[0] != REAL_PROCESS_VALUE:
            exponent -= yield from objects.read_number(DECIMAL_DIGITS, CHANNEL)
        step: float = 10.0**exponent
        return self._settings.sign * step

    def _map(self) -> Job[None]:
        """Let TPDO1 carry value and status after every SYNC, with the standard's procedure (CiA 301, 7.5.2.38)."""
        objects, parameters, mapping = self._objects, TPDO_COMMUNICATION, TPDO_MAPPING
        cob_id = cob.TPDO[_NUMBER] + self.node_id
        yield from objects.write_verified(parameters, 1, cob_id | cob.INVALID, ignore=cob.NO_RTR)
        yield from objects.write_verified(parameters, 2, pdo.SYNC_EVERY)
        for subindex in (3, EVENT_TIMER):  # inhibit time and event timer: SYNC alone asks
            if objects.holds(parameters, subindex):
                yield from objects.write_verified(parameters, subindex, 0)
        entries = self._layout.mapping
        if not (yield from self._is_mapped(entries)):  # many transducers have a mapping that cannot be written
            yield from objects.write_verified(mapping, 0, 0)
            for subindex, entry in enumerate(entries, start=1):
                yield from objects.write_verified(mapping, subindex, entry)
            yield from objects.write_verified(mapping, 0, len(entries))
        yield from objects.write_verified(parameters, 1, cob_id, ignore=cob.NO_RTR)

    def _is_mapped(self, entries: tuple[int, ...]) -> Job[bool]:
        if (yield from self._objects.read_number(TPDO_MAPPING, 0)) != len(entries):
            return False
        for subindex, entry in enumerate(entries, start=1):
            if (yield from self._objects.read_number(TPDO_MAPPING, subindex)) != entry:
                return False
        return True

    def _write_zero(self) -> Job[None]:
        try:
            yield from self._objects.write(AUTOZERO, CHANNEL, int.from_bytes(ZERO, "little"))
        except (SdoAbort, EdsError) as error:
            why = describe(error.code) if isinstance(error, SdoAbort) else str(error)
            raise ConfigurationMismatch(f"transducer {self.node_id} cannot be zeroed (6125): {why}") from error

    def _run(self, job: Job[None]) -> None:
        try:
            self._session.service.run({self.node_id: job})
        except NoAnswer as silence:
            raise NoAnswer(
                f"no answer from transducer {self.node_id}: it is not on the bus, has another node-id, or no power"
            ) from silence

    def _command(self, command: NmtCommand) -> None:
        self._session.pump.send(nmt.encode_command(command, self.node_id))

    def _check_fresh(self) -> Reading:
        latest = self._latest
        age_ns = self._settings.stale_ns + 1 if latest is None else self._session.pump.now_ns() - latest.at_ns
        if latest is None or age_ns > self._settings.stale_ns:
            reason = f": {self._trouble}" if self._trouble else ""
            raise NoAnswer(
                f"transducer {self.node_id} has sent no value for {self._settings.stale_ns / SECOND_NS:g} s{reason}"
            )
        return latest

    def _hear(self, at_ns: int, data: bytes) -> None:
        values = self._layout.unpack(data)
        if values is None:
            self.malformed += 1
            return
        status = AiStatus(values[1]) if len(values) > 1 else AiStatus(0)
        self._latest = Reading(at_ns, self._unit * values[0], status)
        self._readings.append(self._latest)

    def _hear_emergency(self, _at_ns: int, data: bytes) -> None:
        emergency = emcy.decode_payload(self.node_id, data)
        if emergency is None:
            self.malformed += 1
        else:
            self.emergency = emergency if emergency.code else None

    def _hear_heartbeat(self, _at_ns: int, data: bytes) -> None:
        heartbeat = nmt.decode_heartbeat(Frame(heartbeat_cob(self.node_id), data))
        if heartbeat is None:
            self.malformed += 1
        elif heartbeat.state is NmtState.BOOT_UP:
            self._trouble = "it has restarted"
        elif heartbeat.state is not NmtState.OPERATIONAL:
            self._trouble = f"it is in NMT state {heartbeat.state.name.lower().replace('_', '-')}"
        else:
            self._trouble = ""


def mapped_objects(objects: DriveObjects, eds: Path) -> tuple[ObjectAddress, ...]:
    """What a transducer's TPDO1 is to carry: its process value, and its status if it has one.

    Raises:
        EdsError: The EDS holds no process value.
    """
    for index in PROCESS_VALUES:
        if objects.holds(index, CHANNEL):
            status = [ObjectAddress(STATUS, CHANNEL)] if objects.holds(STATUS, CHANNEL) else []
            return ObjectAddress(index, CHANNEL), *status
    raise EdsError(f"{eds} holds no process value of a measuring device: 9130, 7130 or 6130 (CiA 404)")
