"""Which PDOs a drive has and what is in them: as the driver configures it, or as its EDS ships it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import canopen

from torquerig.driver.errors import EdsError
from torquerig.driver.master.configuration import RPDO_COMMUNICATION, RPDO_MAPPING, TPDO_COMMUNICATION, TPDO_MAPPING
from torquerig.driver.master.profile import ObjectAddress, PdoMapping
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.wire import cob
from torquerig.driver.wire.dictionary import find_variable
from torquerig.driver.wire.pdo import mapping_entry

_PDOS: Final = range(512)  # of each kind that a dictionary has room for (CiA 301, 7.5.2.35 ff.)


@dataclass(frozen=True, slots=True)
class MappedPdo:
    """A PDO that exists.

    Attributes:
        name: As "TPDO1".
        is_sent: Whether the drive sends it.
        cob_id: Its COB-ID entry, sub-index 1 of its communication parameter.
        entries: Its mapping entries: index, sub-index, length in bits.
    """

    name: str
    is_sent: bool
    cob_id: int
    entries: tuple[int, ...]


def configured_pdos(settings: AxisSettings, dictionary: canopen.ObjectDictionary) -> tuple[MappedPdo, ...]:
    """The PDOs of a drive while the driver runs it: those of its profile, on their pre-defined identifiers.

    Args:
        settings: The drive.
        dictionary: Its object dictionary.

    Raises:
        EdsError: The EDS does not hold an object that the profile maps.
    """
    profile, node_id = settings.profile, settings.node_id
    rpdo = profile.rpdo
    received = MappedPdo(
        f"RPDO{rpdo.number}", is_sent=False, cob_id=cob.RPDO[rpdo.number] + node_id, entries=_entries(rpdo, dictionary)
    )
    sent = (
        MappedPdo(
            f"TPDO{tpdo.number}",
            is_sent=True,
            cob_id=cob.TPDO[tpdo.number] + node_id,
            entries=_entries(tpdo, dictionary),
        )
        for tpdo in profile.tpdos
    )
    return (received, *sent)


def shipped_pdos(dictionary: canopen.ObjectDictionary) -> tuple[MappedPdo, ...]:
    """The PDOs of a drive after power-on, by the defaults of its EDS.

    Args:
        dictionary: Its object dictionary.

    Raises:
        EdsError: The EDS counts more mapped objects than it names.
    """
    received = _shipped(dictionary, RPDO_COMMUNICATION, RPDO_MAPPING, is_sent=False)
    return (*received, *_shipped(dictionary, TPDO_COMMUNICATION, TPDO_MAPPING, is_sent=True))


def _entries(mapping: PdoMapping, dictionary: canopen.ObjectDictionary) -> tuple[int, ...]:
    """The mapping entries of a profile's PDO."""
    entries = []
    for address in mapping.objects:
        variable = find_variable(dictionary, *address)
        if variable is None:
            raise EdsError(f"object {ObjectAddress(*address)} is to be mapped, but the EDS does not hold it")
        entries.append(mapping_entry(*address, len(variable)))
    return tuple(entries)


def _shipped(
    dictionary: canopen.ObjectDictionary, communication: int, mapping: int, *, is_sent: bool
) -> Iterator[MappedPdo]:
    """The PDOs of one kind that exist, and map something."""
    for offset in _PDOS:
        cob_id = _default(dictionary, communication + offset, 1)
        if cob_id is None or not cob.is_valid(cob_id):
            continue
        name = f"{'TPDO' if is_sent else 'RPDO'}{offset + 1}"
        entries = []
        for subindex in range(1, (_default(dictionary, mapping + offset, 0) or 0) + 1):
            entry = _default(dictionary, mapping + offset, subindex)
            if entry is None:
                place = ObjectAddress(mapping + offset, subindex)
                raise EdsError(f"the EDS does not say what {place} maps into {name}")
            entries.append(entry)
        if entries:
            yield MappedPdo(name, is_sent, cob_id, tuple(entries))


def _default(dictionary: canopen.ObjectDictionary, index: int, subindex: int) -> int | None:
    """The default of an object, if it has a whole number for one."""
    variable = find_variable(dictionary, index, subindex)
    return variable.default if variable is not None and isinstance(variable.default, int) else None
