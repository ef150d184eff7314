"""On which drives a calibration was measured, and whether those are the drives that are there.

Every run of a procedure leaves a table [provenance.NAME] in calibration.toml, with the keys that it set, whether its
drives were simulated, and who they were (object 1018), in the order of the legs. Vendor, product and serial number are
what makes a drive another one; a revision is its firmware's.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from torquerig.driver.master.group import AxisGroup
from torquerig.driver.master.identity import Identity
from torquerig.errors import ConfigurationError

SIMULATED: Final = "simulated"
DRIVES: Final = "drives"
_NOBODY: Final = 0
"""Vendor of the simulated drives: CiA gives this number to no maker."""
_WORDS: Final = {"vendor": "vendor", "product": "product", "serial": "serial number"}

Provenance = Mapping[str, Mapping[str, Any]]


class Drives(NamedTuple):
    """The drives of a rig.

    Attributes:
        are_simulated: Whether they are, in this process or elsewhere.
        identities: Who they are, by node-id, in the order of the legs.
    """

    are_simulated: bool
    identities: Mapping[int, Identity]

    def facts(self) -> dict[str, Any]:
        """As a table of provenance, or a record, holds it; what a drive does not tell is left out."""
        drives = [
            {"node": node_id, **{name: value for name, value in identity._asdict().items() if value is not None}}
            for node_id, identity in self.identities.items()
        ]
        return {SIMULATED: self.are_simulated, DRIVES: drives}


def drives_of(group: AxisGroup, *, in_lockstep: bool) -> Drives:
    """Who the drives of a group are that was entered.

    Args:
        group: The group.
        in_lockstep: Whether they are simulated in this process.
    """
    identities = {axis.node_id: group.session.identities[axis.node_id] for axis in group.axes}
    return Drives(in_lockstep or all(each.vendor == _NOBODY for each in identities.values()), identities)


def drives_told(facts: Mapping[str, Any]) -> Drives | None:
    """The drives of `Drives.facts`; None where they are not told, as in older files."""
    simulated, drives = facts.get(SIMULATED), facts.get(DRIVES)
    if not isinstance(simulated, bool) or not isinstance(drives, list):
        return None
    if not all(isinstance(each, dict) and isinstance(each.get("node"), int) for each in drives):
        return None
    identities = {each["node"]: Identity(*(each.get(name) for name in Identity._fields)) for each in drives}
    return Drives(simulated, identities)


def refuse_others(path: Path, provenance: Provenance, found: Drives | None) -> None:
    """See that what was measured on these drives may be written beside what is in a calibration.

    Args:
        path: The calibration.
        provenance: Its tables of provenance.
        found: The drives that are there; None where nobody knows, and nothing is refused.

    Raises:
        ConfigurationError: Something in it was measured on other drives.
    """
    for difference in () if found is None else _differences(provenance, found):
        raise ConfigurationError(
            f"{path} was measured on {difference}: --replace starts a new calibration and keeps this one beside it,"
            " --out names another folder"
        )


def notes_on_loaded(path: Path | None, provenance: Provenance, found: Drives, *, any_drives: bool) -> list[str]:
    """What is to be said of a calibration that is in force on these drives.

    Simulated drives take any: a rehearsal with a real rig's calibration harms nobody.

    Args:
        path: The calibration; None for none.
        provenance: Its tables of provenance.
        found: The drives that are there.
        any_drives: Whether real drives may be driven with a calibration of others (`calibration.any_drives`).

    Returns:
        Sentences.

    Raises:
        ConfigurationError: It is of other drives than these real ones.
    """
    differences = list(_differences(provenance, found))
    if path is None or not differences:
        return [] if path is None else [*_revised(path, provenance, found)]
    if not found.are_simulated and not any_drives:
        raise ConfigurationError(
            f"the calibration {path} was measured on {differences[0]}: measure these with torquerig calibrate, or set"
            " any_drives = true under [calibration]"
        )
    return [f"The calibration {path} was measured on {differences[0]}.", *_revised(path, provenance, found)]


def _differences(provenance: Provenance, found: Drives) -> Iterator[str]:
    """How the drives of a calibration differ from those that are there: "A, and here is B", run by run."""
    for name, facts in provenance.items():
        told = drives_told(facts)
        if told is None:
            continue
        when = f"({name}, {str(facts.get('date', ''))[:10]})"
        if told.are_simulated != found.are_simulated:
            yield f"{_kind(told)} drives {when}, and here are {_kind(found)} ones"
            continue
        for leg, (before, now) in enumerate(_pairs(told, found), start=1):
            if others := [field for field in _WORDS if _is_another(getattr(before, field), getattr(now, field))]:
                was, is_now = (_words(each, others) for each in (before, now))
                yield f"axis {leg} with a drive of {was} {when}, and here it is one of {is_now}"


def _revised(path: Path, provenance: Provenance, found: Drives) -> Iterator[str]:
    """Drives whose firmware is another than when they were measured; each once."""
    words = {
        leg: f"The drive of axis {leg} has revision {now.revision}; when {path} was measured it was {before.revision}."
        for facts in provenance.values()
        if (told := drives_told(facts)) is not None
        for leg, (before, now) in enumerate(_pairs(told, found), start=1)
        if before.serial == now.serial and _is_another(before.revision, now.revision)
    }
    yield from words.values()


def _pairs(told: Drives, found: Drives) -> Iterator[tuple[Identity, Identity]]:
    """Drives of the same legs; a rig has always as many."""
    return zip(told.identities.values(), found.identities.values(), strict=False)


def _is_another(before: int | None, now: int | None) -> bool:
    """Whether two numbers differ; one that is not told tells nothing."""
    return before is not None and now is not None and before != now


def _kind(drives: Drives) -> str:
    return "simulated" if drives.are_simulated else "real"


def _words(identity: Identity, fields: Sequence[str]) -> str:
    return ", ".join(f"{_WORDS[field]} {getattr(identity, field)}" for field in fields)
