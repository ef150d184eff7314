"""What is written to a drive before it may run, in order; each value is read back and compared.

The PDOs follow the standard's procedure (CiA 301, 7.5.2.36 and .38): bit 31 of the COB-ID set, number of objects 0,
the entries, their number, and bit 31 cleared. What is not used of the pre-defined four is switched off, so that the bus
carries what is counted on and no more.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from torquerig.driver.errors import ConfigurationMismatch, EnablingRefused
from torquerig.driver.master.objects import DriveObjects
from torquerig.driver.master.profile import DriveProfile, PdoMapping
from torquerig.driver.master.pump import MILLISECOND_NS
from torquerig.driver.master.sdo_jobs import Job
from torquerig.driver.wire import cob, pdo

RPDO_COMMUNICATION: Final = 0x1400
RPDO_MAPPING: Final = 0x1600
TPDO_COMMUNICATION: Final = 0x1800
TPDO_MAPPING: Final = 0x1A00
EVENT_TIMER: Final = 5  # its sub-index in the communication parameters

_LIFE_TIME_FACTOR: Final = 3
_ROOMY_NS: Final = 2 * MILLISECOND_NS


@dataclass(frozen=True, slots=True)
class GroupSettings:
    """What holds for all axes of a group.

    Attributes:
        period_ns: Cycle, from SYNC to SYNC [ns]; whole microseconds.
        rpdo_type: Transmission type of the cyclic RPDO: 255 acts on reception, 1 at the next SYNC.
        watchdog_periods: Periods without an RPDO after which a drive stops; as many SYNCs may a drive leave unanswered.
        master_id: The master's own node-id.
        heartbeat_ms: Drives send theirs this often [ms].
        heartbeat_limit_ms: Who hears no heartbeat for so long stops [ms]; the master sends its own 2.5 times as often.
        listening_ms: Silence of other masters demanded before the first frame is sent [ms].
        settling_ms: The longest that one step of starting or enabling may take [ms].
    """

    period_ns: int = 4 * MILLISECOND_NS
    rpdo_type: int = pdo.EVENT_PROFILE
    watchdog_periods: int = 3
    master_id: int = 127
    heartbeat_ms: int = 50
    heartbeat_limit_ms: int = 100
    listening_ms: int = 120
    settling_ms: int = 2000

    def __post_init__(self) -> None:
        cob.check_node_id(self.master_id)
        if self.period_ns <= 0 or self.period_ns % 1000:
            raise ValueError(f"a period is a positive number of whole microseconds, not {self.period_ns} ns")
        if not pdo.allowed_for_rpdo(self.rpdo_type):
            raise ValueError(f"an RPDO's transmission type is 0 to 240, 254 or 255, not {self.rpdo_type}")
        for name in ("watchdog_periods", "heartbeat_ms", "heartbeat_limit_ms", "listening_ms", "settling_ms"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is to be positive, not {getattr(self, name)}")

    @property
    def rpdo_deadline_ms(self) -> int:
        """Value of the RPDO's event timer: the watchdog's periods, rounded up to whole milliseconds."""
        return -(-self.watchdog_periods * self.period_ns // MILLISECOND_NS)

    @property
    def has_room(self) -> bool:
        """Whether slower TPDOs find room in a cycle: 745 bits are taken, theirs are 405 more, and 1 Mbit/s is usual."""
        return self.period_ns >= _ROOMY_NS

    @property
    def guard_ms(self) -> int:
        """Guard time (100C) of drives that are guarded: their patience is three of them."""
        return self.heartbeat_limit_ms // _LIFE_TIME_FACTOR

    @property
    def master_heartbeat_ns(self) -> int:
        """Time between the master's own heartbeats [ns]."""
        return self.heartbeat_limit_ms * MILLISECOND_NS * 2 // 5


@dataclass(frozen=True, slots=True)
class Setting:
    """One value that an object of a drive is to hold.

    Attributes:
        index: Object.
        subindex: Its sub-index.
        value: The value.
        ignore: Bits that are the drive's own when read back.
        write: False for what is only compared.
        watchdog: Read back once more before each enabling, which is refused without it.
    """

    index: int
    subindex: int
    value: int
    ignore: int = 0
    write: bool = True
    watchdog: bool = False


def settings_of(
    objects: DriveObjects, profile: DriveProfile, group: GroupSettings, siblings: Sequence[int]
) -> tuple[Setting, ...]:
    """All settings of one drive, in the order in which they are written.

    Args:
        objects: The drive's objects.
        profile: Its make.
        group: What holds for all.
        siblings: Node-ids of the other drives of the group.

    Raises:
        ProfileError: The drive cannot keep the period.
        EdsError: A PDO maps what the EDS does not hold.
    """
    return (
        *(Setting(*each.object, each.value) for each in profile.first),
        *_rated(profile),
        *_sync(objects, group),
        *_supervision(objects, profile, group, siblings),
        *_operation(objects, profile, group),
        *_process_data(objects, profile, group),
    )


def configure(objects: DriveObjects, settings: Sequence[Setting]) -> Job[None]:
    """A job: make a drive hold its settings.

    Raises:
        ConfigurationMismatch: It refuses one, or reads back another value.
        EnablingRefused: The same, of a watchdog.
    """
    for setting in settings:
        try:
            if setting.write:
                yield from objects.write_verified(setting.index, setting.subindex, setting.value, ignore=setting.ignore)
            else:
                yield from objects.verify(setting.index, setting.subindex, setting.value, ignore=setting.ignore)
        except ConfigurationMismatch as mismatch:
            raise (_refused(mismatch) if setting.watchdog else mismatch) from mismatch


def verify_watchdogs(objects: DriveObjects, settings: Sequence[Setting]) -> Job[None]:
    """A job: see that the watchdogs are still armed.

    Raises:
        EnablingRefused: One of them is not.
    """
    for setting in settings:
        if setting.watchdog:
            try:
                yield from objects.verify(setting.index, setting.subindex, setting.value, ignore=setting.ignore)
            except ConfigurationMismatch as mismatch:
                raise _refused(mismatch) from mismatch


def check_identity(objects: DriveObjects) -> Job[None]:
    """A job: see that the drive is of the make that its EDS describes.

    Raises:
        ConfigurationMismatch: Vendor or product (1018) differ.
    """
    for subindex, expected in objects.identity.items():
        yield from objects.verify(0x1018, subindex, expected)


def disarm_heartbeats(objects: DriveObjects) -> Job[None]:
    """A job: let the drive wait for nobody's heartbeat any more, so that a master may leave without an alarm."""
    for subindex in objects.subindices(0x1016):
        yield from objects.write(0x1016, subindex, 0)


def _refused(mismatch: ConfigurationMismatch) -> EnablingRefused:
    return EnablingRefused(f"{mismatch}; without this watchdog it is not enabled")


def _rated(profile: DriveProfile) -> Iterator[Setting]:
    torque = profile.torque
    if torque.rated_object is not None and torque.rated_value is not None:
        yield Setting(*torque.rated_object, torque.rated_value)


def _sync(objects: DriveObjects, group: GroupSettings) -> Iterator[Setting]:
    if objects.holds(0x1005):
        yield Setting(0x1005, 0, cob.SYNC)
    if objects.holds(0x1019) and objects.holds(0x1006):
        yield Setting(0x1006, 0, 0)  # 1019 can be written only so
        yield Setting(0x1019, 0, 0)  # our SYNC has no counter
    if objects.holds(0x1006):
        yield Setting(0x1006, 0, group.period_ns // 1000, watchdog=True)
    if objects.holds(0x1007):
        yield Setting(0x1007, 0, 0)  # no window: an RPDO counts whenever it comes


def _supervision(
    objects: DriveObjects, profile: DriveProfile, group: GroupSettings, siblings: Sequence[int]
) -> Iterator[Setting]:
    watchdogs = profile.watchdogs
    if objects.holds(0x1014):
        yield Setting(0x1014, 0, cob.EMCY + objects.node_id, write=False)
    if watchdogs.heartbeat:
        yield Setting(0x1017, 0, group.heartbeat_ms)
        yield from _heartbeat_consumers(objects, group, siblings)
    if watchdogs.guarding:
        yield Setting(0x1017, 0, 0)  # guarding works only while there is no heartbeat
        yield Setting(0x100C, 0, group.guard_ms, watchdog=True)
        yield Setting(0x100D, 0, _LIFE_TIME_FACTOR, watchdog=True)
    if watchdogs.emergency:
        for subindex in sorted({*objects.subindices(0x1028), *siblings}):  # the node-id (CiA 301, object 1028)
            wanted = cob.EMCY + subindex if subindex in siblings else cob.INVALID
            yield Setting(0x1028, subindex, wanted, watchdog=True)
    if objects.holds(0x1029, 1):
        yield Setting(0x1029, 1, 0)  # a communication error leaves NMT operational
    if objects.holds(0x6007):
        yield Setting(0x6007, 0, 1, watchdog=True)  # lost communication is a fault
    for each in watchdogs.objects:
        yield Setting(*each.object, each.value, watchdog=True)


def _heartbeat_consumers(objects: DriveObjects, group: GroupSettings, siblings: Sequence[int]) -> Iterator[Setting]:
    """The master first, then as many siblings as there are entries; no entry may name a node twice (0604 0043)."""
    subindices = objects.subindices(0x1016)
    for subindex in subindices:
        yield Setting(0x1016, subindex, 0)
    for subindex, node_id in zip(subindices, (group.master_id, *siblings), strict=False):
        yield Setting(0x1016, subindex, node_id << 16 | group.heartbeat_limit_ms, watchdog=True)


def _operation(objects: DriveObjects, profile: DriveProfile, group: GroupSettings) -> Iterator[Setting]:
    if profile.quick_stop is not None:
        yield Setting(0x605A, 0, profile.quick_stop)
    if profile.halt is not None:
        yield Setting(0x605D, 0, profile.halt)
    if objects.holds(0x60B2):
        yield Setting(0x60B2, 0, 0)  # an offset that somebody left would act beside the target
    if objects.holds(0x60C2, 1):
        value, exponent = profile.interpolation_period(group.period_ns)
        yield Setting(0x60C2, 1, value)
        yield Setting(0x60C2, 2, exponent)
    if profile.torque_slope is not None:
        yield Setting(0x6087, 0, profile.torque_slope)
    yield Setting(0x6060, 0, profile.mode)


def _process_data(objects: DriveObjects, profile: DriveProfile, group: GroupSettings) -> Iterator[Setting]:
    node_id = objects.node_id
    used = {mapping.number: mapping for mapping in (profile.tpdos if group.has_room else profile.tpdos[:1])}
    for number in cob.RPDO:
        parameters = RPDO_COMMUNICATION + number - 1
        if number == profile.rpdo.number:
            yield Setting(parameters, 1, cob.RPDO[number] + node_id | cob.INVALID)
            yield Setting(parameters, 2, group.rpdo_type)
            if profile.watchdogs.rpdo_timer:
                yield Setting(parameters, EVENT_TIMER, group.rpdo_deadline_ms, watchdog=True)
            yield from _mapping(objects, RPDO_MAPPING + number - 1, profile.rpdo)
            yield Setting(parameters, 1, cob.RPDO[number] + node_id, watchdog=True)
        elif objects.holds(parameters, 1):
            yield Setting(parameters, 1, cob.RPDO[number] + node_id | cob.INVALID)
    for number in cob.TPDO:
        parameters = TPDO_COMMUNICATION + number - 1
        if number in used:
            yield Setting(parameters, 1, cob.TPDO[number] + node_id | cob.INVALID, ignore=cob.NO_RTR)
            yield Setting(parameters, 2, used[number].transmission)
            for subindex in (3, EVENT_TIMER):  # inhibit time and event timer: SYNC alone asks
                if objects.holds(parameters, subindex):
                    yield Setting(parameters, subindex, 0)
            yield from _mapping(objects, TPDO_MAPPING + number - 1, used[number])
            yield Setting(parameters, 1, cob.TPDO[number] + node_id, ignore=cob.NO_RTR)
        elif objects.holds(parameters, 1):
            yield Setting(parameters, 1, cob.TPDO[number] + node_id | cob.INVALID, ignore=cob.NO_RTR)


def _mapping(objects: DriveObjects, index: int, mapping: PdoMapping) -> Iterator[Setting]:
    entries = objects.layout(mapping.objects).mapping
    yield Setting(index, 0, 0)
    for subindex, entry in enumerate(entries, start=1):
        yield Setting(index, subindex, entry)
    yield Setting(index, 0, len(entries))
