"""Which PDOs carry the cycle, as the drives are told.

Usually each drive has an RPDO of its own (controlword, torque) and a TPDO1 with all that a cycle needs. With the group
RPDO (`GroupSettings.group_rpdo`) one frame carries the torques of up to four drives: each maps its own slot, and
data types as fillers for the others' (CiA 301, 7.4.7.1). TPDO1 is then the position alone; statusword and actual
torque come with every tenth SYNC in TPDO2; controlwords go out in RPDO1 when they change, and with every tenth SYNC.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from torquerig.driver.errors import ProfileError
from torquerig.driver.master.objects import DriveObjects
from torquerig.driver.master.profile import CONTROLWORD, POSITION, STATUSWORD, DriveProfile
from torquerig.driver.wire import cob, pdo

GROUP_COB: Final = 0x200
"""COB-ID of the group RPDO: that of RPDO1 of no node."""
GROUP_RPDO: Final = 2
"""Which RPDO of a drive takes it."""
GROUP_MOST: Final = 4
"""Torques of 16 bits that a frame holds."""
STATUS_CYCLES: Final = 10
"""Statuswords, torques and controlwords come with every so many SYNCs beside a group RPDO."""
_LENGTH: Final = 0xFF  # of a mapping entry: bits of the object
_DUMMY: Final = pdo.mapping_entry(0x0003, 0, 16)  # INTEGER16


@dataclass(frozen=True, slots=True)
class MappedPdo:
    """A PDO as it is written to a drive.

    Attributes:
        number: Which of the drive's, 1 to 4.
        cob_id: Its COB-ID.
        transmission: Its transmission type.
        entries: The entries of its mapping object.
        watched: RPDO: its event timer is the watchdog.
    """

    number: int
    cob_id: int
    transmission: int
    entries: tuple[int, ...]
    watched: bool = False

    @property
    def size(self) -> int:
        """Bytes of its data."""
        return sum(entry & _LENGTH for entry in self.entries) // 8


@dataclass(frozen=True, slots=True)
class ProcessData:
    """All PDOs of one drive that are on.

    Attributes:
        rpdos: What it hears.
        tpdos: What it says.
    """

    rpdos: tuple[MappedPdo, ...]
    tpdos: tuple[MappedPdo, ...]


def own_process_data(objects: DriveObjects, profile: DriveProfile, rpdo_type: int, *, slow_tpdos: bool) -> ProcessData:
    """The PDOs of a drive that is spoken to by an RPDO of its own.

    Args:
        objects: The drive's objects.
        profile: Its make.
        rpdo_type: Transmission type of the cyclic RPDO.
        slow_tpdos: Whether the cycle has room for TPDOs other than the cyclic one.

    Raises:
        EdsError: A PDO maps what the EDS does not hold.
    """
    rpdo, node_id = profile.rpdo, objects.node_id
    used = profile.tpdos if slow_tpdos else profile.tpdos[:1]
    entries = objects.layout(rpdo.objects).mapping
    return ProcessData(
        (MappedPdo(rpdo.number, cob.RPDO[rpdo.number] + node_id, rpdo_type, entries, watched=True),),
        tuple(
            MappedPdo(
                each.number,
                cob.TPDO[each.number] + node_id,
                each.transmission,
                objects.layout(each.objects).mapping,
            )
            for each in used
        ),
    )


def group_process_data(
    objects: DriveObjects, profile: DriveProfile, rpdo_type: int, slot: int, slots: int
) -> ProcessData:
    """The PDOs of a drive that shares its RPDO.

    Args:
        objects: The drive's objects.
        profile: Its make.
        rpdo_type: Transmission type of the group RPDO.
        slot: Which torque of the frame is the drive's, from 0.
        slots: How many torques the frame has.

    Raises:
        ProfileError: The drive takes no fillers, has another torque object than one of 16 bits, or there are too many.
        EdsError: A PDO maps what the EDS does not hold.
    """
    node_id = objects.node_id
    (torque,) = objects.layout((profile.torque.target,)).mapping
    if slots > GROUP_MOST:
        raise ProfileError(f"a group RPDO carries {GROUP_MOST} torques, not {slots}: spread the drives over buses")
    if not profile.dummy_mapping or torque & 0xFF != _DUMMY & 0xFF:
        raise ProfileError(
            f"drive {node_id} ({profile.name}) cannot share an RPDO: it maps no fillers, or its torque has not 16 bits"
        )
    entries = tuple(torque if place == slot else _DUMMY for place in range(slots))
    controlword = objects.layout((CONTROLWORD,)).mapping
    return ProcessData(
        (
            MappedPdo(1, cob.RPDO[1] + node_id, pdo.EVENT_PROFILE, controlword),
            MappedPdo(GROUP_RPDO, GROUP_COB, rpdo_type, entries, watched=True),
        ),
        tuple(
            MappedPdo(number, cob.TPDO[number] + node_id, cycles, objects.layout(mapped).mapping)
            for number, cycles, mapped in (
                (1, 1, (POSITION,)),
                (2, STATUS_CYCLES, (STATUSWORD, profile.torque.actual)),
            )
        ),
    )


def unused(pdos: tuple[MappedPdo, ...]) -> Iterator[int]:
    """The numbers of the pre-defined four that are not among some."""
    used = {each.number for each in pdos}
    return (number for number in cob.RPDO if number not in used)
