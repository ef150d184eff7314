"""Drive profiles: how a make of CiA 402 drives differs from the others, one small TOML file each.

A profile says which objects carry the torque and in what unit, what is to be written first, how the PDOs are mapped
and which watchdogs there are. What belongs to one axis of one machine (node-id, sign, gear) is in `AxisSettings`.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple, Self

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    PositiveFloat,
    PositiveInt,
    StrictBool,
    StrictInt,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic.dataclasses import dataclass

from torquerig.driver.errors import ProfileError
from torquerig.driver.wire import pdo

DATA: Final = Path(__file__).parent.parent / "data"
PROFILES: Final = DATA / "profiles"
DEFAULT_PROFILE: Final = "torquerig"

_STRICT: Final = ConfigDict(extra="forbid")


class ObjectAddress(NamedTuple):
    """Where an object is.

    Attributes:
        entry: Its index ("index" is what every tuple has).
        subindex: Its sub-index.
    """

    entry: int
    subindex: int = 0

    def __str__(self) -> str:
        return f"{self.entry:04X}:{self.subindex:X}"


CONTROLWORD: Final = ObjectAddress(0x6040, 0)
STATUSWORD: Final = ObjectAddress(0x6041, 0)
POSITION: Final = ObjectAddress(0x6064, 0)


def parse_address(text: object) -> ObjectAddress:
    """The address in "2071", "2071:0" or "0x60C2:1": index and sub-index in hexadecimal.

    Raises:
        ValueError: The text is no address.
    """
    if isinstance(text, ObjectAddress):
        return text
    entry, _, subindex = str(text).partition(":")
    try:
        address = ObjectAddress(int(entry, 16), int(subindex or "0", 16))
    except ValueError:
        raise ValueError(f"{text!r} is no object: write index:sub-index in hexadecimal, such as 60C2:1") from None
    if not (0 < address.entry <= 0xFFFF and 0 <= address.subindex <= 0xFF):
        raise ValueError(f"{text!r} is no object: the index has 16 bits and the sub-index 8")
    return address


Address = Annotated[ObjectAddress, BeforeValidator(parse_address)]


@dataclass(frozen=True, slots=True, config=_STRICT)
class TorqueReference:
    """What a count of the target torque means.

    Attributes:
        reference: "counts": the drive's own raw counts; else per mille of its rated torque, or of its rated current.
        target: Object written every cycle.
        actual: Object read every cycle, in the same unit.
        counts_per_nm: For "counts": counts a newton metre, where the axis' settings do not say it.
        rated_object: For per mille: where the drive holds what 1000 stands for.
        rated_unit: For per mille: a count of `rated_object` [N·m], or [A] for the rated current.
        rated_value: What is to be written there first, for drives that leave it 0; None: the drive's own value counts.
    """

    reference: Literal["counts", "rated torque", "rated current"]
    target: Address
    actual: Address
    counts_per_nm: PositiveFloat | None = None
    rated_object: Address | None = None
    rated_unit: PositiveFloat | None = None
    rated_value: PositiveInt | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.reference == "counts" and self.counts_per_nm is None:
            raise ValueError("the reference 'counts' needs counts_per_nm")
        if self.reference != "counts" and (self.rated_object is None or self.rated_unit is None):
            raise ValueError(f"per mille of the {self.reference} need rated_object and rated_unit")
        return self


@dataclass(frozen=True, slots=True, config=_STRICT)
class FirstWrite:
    """An object to write before all others, and why."""

    object: Address
    value: StrictInt
    why: str


@dataclass(frozen=True, slots=True, config=_STRICT)
class PdoMapping:
    """One PDO: its number, the objects in it, and for a TPDO its transmission type."""

    number: Annotated[StrictInt, Field(ge=1, le=4)]
    objects: Annotated[tuple[Address, ...], Field(min_length=1, max_length=pdo.MAX_MAPPED)]
    transmission: Annotated[StrictInt, Field(ge=0, le=255)] = pdo.SYNC_EVERY


@dataclass(frozen=True, slots=True, config=_STRICT)
class Watchdogs:
    """What stops the drive when its master or its siblings fall silent; each is armed and read back before enabling.

    Attributes:
        rpdo_timer: The event timer of the cyclic RPDO (1400:5) is a deadline.
        heartbeat: The drive consumes heartbeats (1016).
        emergency: The drive consumes its siblings' EMCYs (1028).
        guarding: The drive is guarded (100C, 100D) because it has no heartbeat.
        sync_loss: The object of 8 bits that holds how many periods without SYNC stop the drive.
        objects: Further objects with the value that arms them.
    """

    rpdo_timer: StrictBool = False
    heartbeat: StrictBool = False
    emergency: StrictBool = False
    guarding: StrictBool = False
    sync_loss: Address | None = None
    objects: tuple[FirstWrite, ...] = ()

    @model_validator(mode="after")
    def _any(self) -> Self:
        if self.heartbeat and self.guarding:
            raise ValueError("a drive has a heartbeat or is guarded, never both (CiA 301, 7.2.8)")
        if not (self.rpdo_timer or self.heartbeat or self.guarding):
            raise ValueError("a drive that nothing stops when its master dies is not driven: name a watchdog")
        return self


@dataclass(frozen=True, slots=True, config=_STRICT)
class DriveProfile:
    """A make of drives.

    Attributes:
        name: The make, for people.
        eds: The electronic data sheet; a relative path counts from the file's folder, then from the shipped ones'.
        mode: Mode of operation for the cycle: 10 is cyclic synchronous torque, 4 profile torque.
        torque: What a count of torque means.
        counts_per_revolution: Counts of 6064 a motor revolution, where the axis' settings do not say it.
        velocity_unit: Unit of 606C.
        period_exponent: Smallest power of ten [s] that 60C2:2 takes: -3 for whole milliseconds.
        rpdo: The cyclic RPDO; it holds the controlword and the target torque.
        tpdos: All TPDOs; the first is the cyclic one and holds statusword, position and actual torque. The others are
            off where the cycle has no room for them.
        watchdogs: What stops the drive when others fall silent.
        first: What to write before all else.
        torque_slope: Value of 6087 for mode 4, whose slope must not shape the torque; None leaves it alone.
        quick_stop: Value of 605A; None for a drive without a choice.
        halt: Value of 605D; None for a drive without a choice.
        dummy_mapping: Whether data types can be mapped as fillers, so that drives can share one RPDO.
        homed_bit: Bit of the statusword that says the position was homed; None: the drive does not tell.
        homing_method: Value of 6098 for "the current position is home": 37, or 35 in older drives.
        refusals: Object whose sub-indices count what the drive did not take from the bus; None: it does not count.
    """

    name: str
    torque: TorqueReference
    rpdo: PdoMapping
    tpdos: Annotated[tuple[PdoMapping, ...], Field(min_length=1)]
    watchdogs: Watchdogs
    eds: Path | None = None
    mode: Literal[4, 10] = 10
    counts_per_revolution: PositiveInt | None = None
    velocity_unit: Literal["counts/s", "rpm", "unknown"] = "unknown"
    period_exponent: Annotated[StrictInt, Field(ge=-6, le=-3)] = -3
    first: tuple[FirstWrite, ...] = ()
    torque_slope: PositiveInt | None = None
    quick_stop: Annotated[StrictInt, Field(ge=0, le=8)] | None = None
    halt: Annotated[StrictInt, Field(ge=1, le=4)] | None = None
    dummy_mapping: StrictBool = False
    homed_bit: Annotated[StrictInt, Field(ge=0, le=15)] | None = None
    homing_method: Literal[35, 37] = 37
    refusals: Address | None = None

    def interpolation_period(self, period_ns: int) -> tuple[int, int]:
        """A period as 60C2 holds it: value (sub-index 1) and power of ten [s] (sub-index 2).

        Raises:
            ProfileError: The period [ns] is not 1 to 255 of the steps that these drives take.
        """
        for exponent in range(-3, self.period_exponent - 1, -1):
            value, rest = divmod(period_ns, 10 ** (9 + exponent))
            if not rest and 1 <= value <= 0xFF:
                return value, exponent
        raise ProfileError(
            f"a period of {period_ns / 1e6:g} ms is not 1 to 255 steps of 1e{self.period_exponent} s, as {self.name}"
            " drives take it (60C2)"
        )

    @model_validator(mode="after")
    def _cycle_is_mapped(self) -> Self:
        for key, have, need in (
            ("rpdo", self.rpdo, (CONTROLWORD, self.torque.target)),
            ("tpdos.0", self.tpdos[0], (STATUSWORD, POSITION, self.torque.actual)),
        ):
            for address in need:
                if address not in have.objects:
                    raise ValueError(f"{key} does not map {address}, which the cycle needs")
        return self


def load_profile(name: str | Path = DEFAULT_PROFILE, *, eds: Path | None = None) -> DriveProfile:
    """The profile of a shipped name ("torquerig", "nanotec" ...) or of a TOML file.

    Args:
        name: A shipped profile's name, or the path of a file.
        eds: The drives' EDS, for profiles that name none, or instead of theirs.

    Raises:
        ProfileError: There is no such profile, or the file holds an unknown, missing or impossible key; file and key
            are named.
    """
    path = _find(name)
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ProfileError(f"the profile {path} cannot be read: {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ProfileError(f"the profile {path} is no TOML: {error}") from error
    try:
        profile = _READER.validate_python(_as_tuples(table))
    except ValidationError as error:
        raise ProfileError(f"the profile {path}: {_first_complaint(error)}") from error
    return replace(profile, eds=_locate(profile.eds, path.parent) if eds is None else eds)


def shipped_profiles() -> tuple[str, ...]:
    """The names of the profiles that come with torquerig."""
    return tuple(sorted(path.stem for path in PROFILES.glob("*.toml")))


def _find(name: str | Path) -> Path:
    path = Path(name)
    if path.suffix == ".toml":
        return path
    shipped = PROFILES / f"{name}.toml"
    if not shipped.is_file():
        known = ", ".join(shipped_profiles())
        raise ProfileError(f"there is no drive profile {str(name)!r}: choose {known}, or name a file ending in .toml")
    return shipped


def _locate(eds: Path | None, folder: Path) -> Path | None:
    if eds is None or eds.is_absolute():
        return eds
    return next((base / eds for base in (folder, DATA) if (base / eds).is_file()), folder / eds)


def _as_tuples(value: Any) -> Any:  # noqa: ANN401 - whatever TOML can hold
    if isinstance(value, Mapping):
        return {key: _as_tuples(each) for key, each in value.items()}
    return tuple(map(_as_tuples, value)) if isinstance(value, list) else value


def _first_complaint(error: ValidationError) -> str:
    complaint = error.errors(include_url=False)[0]
    key = ".".join(map(str, complaint["loc"])) or "the file"
    if complaint["type"] == "unexpected_keyword_argument":
        return f"{key} is no key of a profile"
    if complaint["type"] in {"missing", "missing_argument"}:
        return f"{key} is missing"
    return f"{key}: {complaint['msg'].removeprefix('Value error, ')}"


_READER: Final = TypeAdapter(DriveProfile)
