"""What a cycle's frames take of a bus, and so what fits: bits on the wire with stuffing at its worst."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

from torquerig.driver.wire.frame import MAX_DATA_LENGTH, worst_case_bits

TPDO_BYTES: Final = 8
"""Statusword, position, actual torque (drive-protocol: TPDO1)."""
SHORT_TPDO_BYTES: Final = 4
"""Position alone."""
RPDO_BYTES: Final = 4
"""Controlword, target torque."""
TORQUE_BYTES: Final = 2
"""A slot of the group RPDO."""
SLOW_TPDO_BYTES: Final = 8
SLOW_TPDO_CYCLES: Final = 10
"""TPDO2 comes with every tenth SYNC, while a cycle has room for it."""
ROOMY_HZ: Final = 500.0
"""At higher rates the driver switches TPDO2 off."""
HIGHEST_LOAD: Final = 0.8
"""Of cyclic frames; the rest is for heartbeats, SDO and EMCY: our choice."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Drives, and how they are spoken to.

    Attributes:
        drives: How many, on all buses together.
        rate_hz: Cycles a second [Hz].
        bit_rate: Of each bus [bit/s].
        buses: The drives are spread over so many.
        tpdo_bytes: Of each drive's TPDO1.
        rpdo_bytes: Of each drive's RPDO1; unused with a group RPDO.
        group_rpdo: One RPDO carries the torques of up to four drives.
        heartbeat_s: Time between the heartbeats of each node [s].
    """

    drives: int = 3
    rate_hz: float = 250.0
    bit_rate: int = 1_000_000
    buses: int = 1
    tpdo_bytes: int = TPDO_BYTES
    rpdo_bytes: int = RPDO_BYTES
    group_rpdo: bool = False
    heartbeat_s: float = 0.05

    def __post_init__(self) -> None:
        if not 1 <= self.buses <= self.drives <= 127 * self.buses:
            raise ValueError(f"{self.drives} drives on {self.buses} buses: a bus has 1 to 127")
        if self.rate_hz <= 0 or self.bit_rate <= 0 or self.heartbeat_s <= 0:
            raise ValueError("rates and times are positive")
        for name in ("tpdo_bytes", "rpdo_bytes"):
            if not 0 <= getattr(self, name) <= MAX_DATA_LENGTH:
                raise ValueError(f"{name} = {getattr(self, name)} cannot be: a PDO has 0 to {MAX_DATA_LENGTH} bytes")

    @property
    def drives_on_fullest(self) -> int:
        """Drives on the bus that has most."""
        return -(-self.drives // self.buses)


class Row(NamedTuple):
    """Frames of one kind on the fullest bus.

    Attributes:
        name: What they are.
        data_bytes: Data of each [byte].
        bits: Each on the wire, at worst.
        per_second: How many [1/s].
        cyclic: Whether they come in every cycle.
    """

    name: str
    data_bytes: int
    bits: int
    per_second: float
    cyclic: bool


@dataclass(frozen=True, slots=True)
class Budget:
    """What a plan takes of its fullest bus.

    Attributes:
        plan: The plan.
        rows: The frames, kind by kind.
    """

    plan: Plan
    rows: tuple[Row, ...]

    @property
    def cycle_bits(self) -> float:
        """Bits of a cycle's own frames."""
        return sum(row.bits * row.per_second for row in self.rows if row.cyclic) / self.plan.rate_hz

    @property
    def cyclic_load(self) -> float:
        """Share of the bus that the cycles' own frames take."""
        return self.cycle_bits * self.plan.rate_hz / self.plan.bit_rate

    @property
    def load(self) -> float:
        """Share of the bus that all frames take."""
        return sum(row.bits * row.per_second for row in self.rows) / self.plan.bit_rate

    @property
    def fastest_hz(self) -> float:
        """The rate at which the cycles' own frames load the bus to `HIGHEST_LOAD` [Hz]."""
        return HIGHEST_LOAD * self.plan.bit_rate / self.cycle_bits

    @property
    def limit_hz(self) -> float:
        """The rate at which they fill it wholly [Hz]."""
        return self.plan.bit_rate / self.cycle_bits

    @property
    def tpdo_ns(self) -> float:
        """From SYNC's begin to the last TPDO's end, if nothing else is on the bus [ns]."""
        return self._duration_ns("SYNC", "TPDO1")

    @property
    def rpdo_ns(self) -> float:
        """How long the RPDOs take [ns]."""
        return self._duration_ns("RPDO1", "group RPDO")

    @property
    def fits(self) -> bool:
        """Whether the cycles leave room for the rest."""
        return self.cyclic_load <= HIGHEST_LOAD

    def _duration_ns(self, *names: str) -> float:
        bits = sum(row.bits * row.per_second for row in self.rows if row.name in names) / self.plan.rate_hz
        return 1e9 * bits / self.plan.bit_rate


def budget(plan: Plan) -> Budget:
    """What a plan takes.

    Args:
        plan: The plan.
    """
    return Budget(plan, tuple(_rows(plan)))


def group_frames(drives: int) -> list[int]:
    """The lengths of the group RPDOs that carry the torques of so many drives [byte]."""
    held = MAX_DATA_LENGTH // TORQUE_BYTES
    full, rest = divmod(drives, held)
    return [MAX_DATA_LENGTH] * full + ([rest * TORQUE_BYTES] if rest else [])


def _rows(plan: Plan) -> Iterator[Row]:
    drives, rate = plan.drives_on_fullest, plan.rate_hz
    yield _row("SYNC", 0, rate, cyclic=True)
    yield _row("TPDO1", plan.tpdo_bytes, rate * drives, cyclic=True)
    if plan.group_rpdo:
        lengths = group_frames(drives)
        for length in sorted(set(lengths), reverse=True):
            yield _row("group RPDO", length, rate * lengths.count(length), cyclic=True)
    else:
        yield _row("RPDO1", plan.rpdo_bytes, rate * drives, cyclic=True)
    if rate <= ROOMY_HZ:
        yield _row("TPDO2", SLOW_TPDO_BYTES, rate / SLOW_TPDO_CYCLES * drives, cyclic=False)
    yield _row("heartbeats", 1, (drives + 1) / plan.heartbeat_s, cyclic=False)


def _row(name: str, length: int, per_second: float, *, cyclic: bool) -> Row:
    return Row(name, length, worst_case_bits(length), per_second, cyclic)
