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
from torquerig.driver.master.process_data import (
    ProcessData,
    group_process_data,
    own_process_data,
    unused,
)
from torquerig.driver.master.profile import DriveProfile
from torquerig.driver.master.sdo_jobs import Job
from torquerig.driver.master.settings import LIFE_TIME_FACTOR, GroupSettings
from torquerig.driver.wire import cob

RPDO_COMMUNICATION: Final = 0x1400
RPDO_MAPPING: Final = 0x1600
TPDO_COMMUNICATION: Final = 0x1800
TPDO_MAPPING: Final = 0x1A00
EVENT_TIMER: Final = 5  # its sub-index in the communication parameters


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
    objects: DriveObjects, profile: DriveProfile, group: GroupSettings, siblings: Sequence[int], slot: int = 0
) -> tuple[Setting, ...]:
    """All settings of one drive, in the order in which they are written.

    Args:
        objects: The drive's objects.
        profile: Its make.
        group: What holds for all.
        siblings: Node-ids of the other drives of the group.
        slot: The drive's place in the group.

    Raises:
        ProfileError: The drive cannot keep the period, or share an RPDO.
        EdsError: A PDO maps what the EDS does not hold.
    """
    data = process_data_of(objects, profile, group, slot, len(siblings) + 1)
    return (
        *(Setting(*each.object, each.value) for each in profile.first),
        *_rated(profile),
        *_sync(objects, group),
        *_supervision(objects, profile, group, siblings),
        *_operation(objects, profile, group),
        *_rpdos(objects, profile, group, data),
        *_tpdos(objects, data),
    )


def process_data_of(
    objects: DriveObjects, profile: DriveProfile, group: GroupSettings, slot: int, slots: int
) -> ProcessData:
    """The PDOs of one drive.

    Args:
        objects: The drive's objects.
        profile: Its make.
        group: What holds for all.
        slot: The drive's place in the group.
        slots: How many drives there are.

    Raises:
        ProfileError, EdsError: As in `settings_of`.
    """
    if group.group_rpdo:
        return group_process_data(objects, profile, group.rpdo_type, slot, slots)
    return own_process_data(objects, profile, group.rpdo_type, slow_tpdos=group.has_room)


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
        yield Setting(0x100D, 0, LIFE_TIME_FACTOR, watchdog=True)
    if watchdogs.emergency:
        for subindex in sorted({*objects.subindices(0x1028), *siblings}):  # the node-id (CiA 301, object 1028)
            wanted = cob.EMCY + subindex if subindex in siblings else cob.INVALID
            yield Setting(0x1028, subindex, wanted, watchdog=True)
    if objects.holds(0x1029, 1):
        yield Setting(0x1029, 1, 0)  # a communication error leaves NMT operational
    if objects.holds(0x6007):
        yield Setting(0x6007, 0, 1, watchdog=True)  # lost communication is a fault
    if watchdogs.sync_loss is not None:
        yield Setting(*watchdogs.sync_loss, min(group.watchdog_periods, 0xFF), watchdog=True)
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


def _rpdos(objects: DriveObjects, profile: DriveProfile, group: GroupSettings, data: ProcessData) -> Iterator[Setting]:
    for each in data.rpdos:
        parameters = RPDO_COMMUNICATION + each.number - 1
        yield Setting(parameters, 1, each.cob_id | cob.INVALID)
        yield Setting(parameters, 2, each.transmission)
        if not each.watched:
            yield Setting(parameters, EVENT_TIMER, 0)
        elif profile.watchdogs.rpdo_timer:
            yield Setting(parameters, EVENT_TIMER, group.rpdo_deadline_ms, watchdog=True)
        yield from _mapping(RPDO_MAPPING + each.number - 1, each.entries)
        yield Setting(parameters, 1, each.cob_id, watchdog=True)
    for number in unused(data.rpdos):
        if objects.holds(RPDO_COMMUNICATION + number - 1, 1):
            yield Setting(RPDO_COMMUNICATION + number - 1, 1, cob.RPDO[number] + objects.node_id | cob.INVALID)


def _tpdos(objects: DriveObjects, data: ProcessData) -> Iterator[Setting]:
    for each in data.tpdos:
        parameters = TPDO_COMMUNICATION + each.number - 1
        yield Setting(parameters, 1, each.cob_id | cob.INVALID, ignore=cob.NO_RTR)
        yield Setting(parameters, 2, each.transmission)
        for subindex in (3, EVENT_TIMER):  # inhibit time and event timer: SYNC alone asks
            if objects.holds(parameters, subindex):
                yield Setting(parameters, subindex, 0)
        yield from _mapping(TPDO_MAPPING + each.number - 1, each.entries)
        yield Setting(parameters, 1, each.cob_id, ignore=cob.NO_RTR)
    for number in unused(data.tpdos):
        if objects.holds(TPDO_COMMUNICATION + number - 1, 1):
            invalid = cob.TPDO[number] + objects.node_id | cob.INVALID
            yield Setting(TPDO_COMMUNICATION + number - 1, 1, invalid, ignore=cob.NO_RTR)


def _mapping(index: int, entries: Sequence[int]) -> Iterator[Setting]:
    yield Setting(index, 0, 0)
    for subindex, entry in enumerate(entries, start=1):
        yield Setting(index, subindex, entry)
    yield Setting(index, 0, len(entries))
