"""What drives did not take from the bus, as far as their make counts it (`DriveProfile.refusals`)."""

from collections.abc import Mapping
from dataclasses import dataclass

from torquerig.driver.errors import DriveError, NoAnswer
from torquerig.driver.master.objects import DriveObjects
from torquerig.driver.master.profile import DriveProfile
from torquerig.driver.master.sdo_jobs import BRIEF, Job, SdoService
from torquerig.driver.wire.sdo import SdoAbort


@dataclass(frozen=True, slots=True)
class RefusalCounters:
    """Where a drive's counters are.

    Attributes:
        objects: Its objects.
        profile: Its make.
    """

    objects: DriveObjects
    profile: DriveProfile


def read_refusals(service: SdoService, drives: Mapping[int, RefusalCounters]) -> dict[int, dict[str, int] | None]:
    """The counters of drives by the names that their EDS gives, all drives asked at once.

    Args:
        service: Reaches the drives.
        drives: The drives by node-id.

    Returns:
        The counters by node-id; None for a drive that has none, is of another make than its profile says, or is silent.

    Raises:
        BusError: The bus is gone.
    """
    return service.run({node_id: _read(drive) for node_id, drive in drives.items()}, BRIEF)


def _read(drive: RefusalCounters) -> Job[dict[str, int] | None]:
    where, objects = drive.profile.refusals, drive.objects
    if where is None:
        return None
    try:
        for subindex, expected in objects.identity.items():
            if (yield from objects.read_number(0x1018, subindex)) != expected:
                return None
        counts: dict[str, int] = {}
        for subindex in objects.subindices(where.entry):
            counts[objects.name(where.entry, subindex)] = yield from objects.read_number(where.entry, subindex)
    except (SdoAbort, NoAnswer, DriveError):
        return None
    return counts
