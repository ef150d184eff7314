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
WAITED: Final = 0.5
"""Share of the period for which the driver waits for TPDOs (drive-protocol: the deadline of a cycle)."""
ANSWER_S: Final = 20e-6
"""A drive has its TPDO ready so long after SYNC (`drive.sample` of the shipped configuration) [s]."""


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
        group_rpdo: One RPDO carries the torques of up to four drives, wherever they are, and goes to every bus.
        heartbeat_s: Time between the heartbeats of each node [s].
        answer_s: From SYNC until a drive's TPDO1 is ready [s].
    """

    drives: int = 3
    rate_hz: float = 250.0
    bit_rate: int = 1_000_000
    buses: int = 1
    tpdo_bytes: int = TPDO_BYTES
    rpdo_bytes: int = RPDO_BYTES
    group_rpdo: bool = False
    heartbeat_s: float = 0.05
    answer_s: float = ANSWER_S

    def __post_init__(self) -> None:
        if not 1 <= self.buses <= self.drives <= 127 * self.buses:
            raise ValueError(f"{self.drives} drives on {self.buses} buses: a bus has 1 to 127")
        if self.rate_hz <= 0 or self.bit_rate <= 0 or self.heartbeat_s <= 0:
            raise ValueError("rates and times are positive")
        for name in ("tpdo_bytes", "rpdo_bytes"):
            if not 0 <= getattr(self, name) <= MAX_DATA_LENGTH:
                raise ValueError(f"{name} = {getattr(self, name)} cannot be: a PDO has 0 to {MAX_DATA_LENGTH} bytes")

    @property
    def spread(self) -> tuple[int, ...]:
        """Drives on each bus, the fullest first: as evenly as can be."""
        even, more = divmod(self.drives, self.buses)
        return (even + 1,) * more + (even,) * (self.buses - more)

    @property
    def drives_on_fullest(self) -> int:
        """Drives on the bus that has most."""
        return self.spread[0]


class Row(NamedTuple):
    """Frames of one kind on a bus.

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
    """What a plan takes of one of its buses.

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
    def roomy_hz(self) -> float:
        """The rate at which the cycles' own frames load the bus to `HIGHEST_LOAD` [Hz]."""
        return HIGHEST_LOAD * self.plan.bit_rate / self.cycle_bits

    @property
    def answered_hz(self) -> float:
        """The rate at which the last TPDO comes just when the driver waits no longer [Hz]."""
        return WAITED * 1e9 / self.answered_ns

    @property
    def fastest_hz(self) -> float:
        """The highest rate that leaves room for the rest, and at which every TPDO comes in time [Hz]."""
        return min(self.roomy_hz, self.answered_hz)

    @property
    def limit_hz(self) -> float:
        """The rate at which they fill it wholly [Hz]."""
        return self.plan.bit_rate / self.cycle_bits

    @property
    def tpdo_ns(self) -> float:
        """From SYNC's begin to the last TPDO's end, if nothing else is on the bus [ns]."""
        return self._duration_ns("SYNC", "TPDO1")

    @property
    def answered_ns(self) -> float:
        """The same with the drives' own time [ns]."""
        return self.tpdo_ns + 1e9 * self.plan.answer_s

    @property
    def rpdo_ns(self) -> float:
        """How long the RPDOs take [ns]."""
        return self._duration_ns("RPDO1", "group RPDO")

    @property
    def fits(self) -> bool:
        """Whether the cycles leave room for the rest, and every TPDO comes in time."""
        return self.plan.rate_hz <= self.fastest_hz

    def _duration_ns(self, *names: str) -> float:
        bits = sum(row.bits * row.per_second for row in self.rows if row.name in names) / self.plan.rate_hz
        return 1e9 * bits / self.plan.bit_rate


def budget(plan: Plan) -> Budget:
    """What a plan takes of its fullest bus.

    Args:
        plan: The plan.
    """
    return Budget(plan, tuple(_rows(plan, plan.drives_on_fullest)))


def budgets(plan: Plan) -> list[Budget]:
    """What a plan takes of each of its buses, in the order of `Plan.spread`.

    Args:
        plan: The plan.
    """
    return [Budget(plan, tuple(_rows(plan, drives))) for drives in plan.spread]


def group_frames(drives: int) -> list[int]:
    """The lengths of the group RPDOs that carry the torques of so many drives [byte]."""
    held = MAX_DATA_LENGTH // TORQUE_BYTES
    full, rest = divmod(drives, held)
    return [MAX_DATA_LENGTH] * full + ([rest * TORQUE_BYTES] if rest else [])


def _rows(plan: Plan, drives: int) -> Iterator[Row]:
    rate = plan.rate_hz
    heartbeats = plan.drives + 1  # on each of several buses too: the driver passes those of the siblings on
    yield _row("SYNC", 0, rate, cyclic=True)
    yield _row("TPDO1", plan.tpdo_bytes, rate * drives, cyclic=True)
    if plan.group_rpdo:
        lengths = group_frames(plan.drives)
        for length in sorted(set(lengths), reverse=True):
            yield _row("group RPDO", length, rate * lengths.count(length), cyclic=True)
    else:
        yield _row("RPDO1", plan.rpdo_bytes, rate * drives, cyclic=True)
    if rate <= ROOMY_HZ:
        yield _row("TPDO2", SLOW_TPDO_BYTES, rate / SLOW_TPDO_CYCLES * drives, cyclic=False)
    yield _row("heartbeats", 1, heartbeats / plan.heartbeat_s, cyclic=False)


def _row(name: str, length: int, per_second: float, *, cyclic: bool) -> Row:
    return Row(name, length, worst_case_bits(length), per_second, cyclic)
