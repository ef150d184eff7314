"""What a run comes to: the numbers of its summary, and the object that --json prints."""

import math
from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, Self

from torquerig.control.law import Published
from torquerig.control.log import LoopLog
from torquerig.control.tracking import (
    Percentiles,
    overruns,
    peak_torque,
    position_rmse_mm,
    rms_torque,
    velocity_rmse,
    work_us,
)
from torquerig.json_numbers import finite
from torquerig.timing import Timing, timing_of


@dataclass(frozen=True, slots=True)
class UsedGains:
    """The gains of the law in a run.

    Attributes:
        motion: The test motion that they are for; in another motion they are borrowed.
        kp: On the position error, in the law's unit.
        kv: On the velocity error, in the law's unit.
    """

    motion: int
    kp: float
    kv: float


@dataclass(frozen=True, slots=True)
class Conditions:
    """What was run.

    Attributes:
        law: Name of the law.
        motion: Number or name of the motion; of a trajectory the file's.
        gains: The law's gains.
        plant: Name of the simulated plant; None where it is not known.
        bus: The bus URL.
        rate_hz: Cycles a second.
        thesis_ms: The law's running time on the thesis' computer [ms]; None for a law that the thesis does not have.
        departures: In what the run departs from the thesis' experiment of its law and motion; none where it is that.
    """

    law: str
    motion: int | str
    gains: UsedGains
    plant: str | None
    bus: str
    rate_hz: float
    thesis_ms: float | None = None
    departures: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Summary:
    """The outcome of a run. Errors and torques are over the motion's samples only.

    Attributes:
        law: Name of the law.
        motion: Number or name of the motion; of a trajectory the file's.
        gains: The law's gains.
        plant: Name of the simulated plant; None where it is not known.
        bus: The bus URL.
        rate_hz: Cycles a second.
        cycles: Cycles of the loop, approach and holds included.
        overruns: Cycles that were skipped or whose command left after the next was due.
        position_rmse_mm: From measured angles [mm].
        velocity_rmse_m_s: From the estimated velocity [m/s].
        true_position_rmse_mm: From the simulator's own state [mm]; None on a real-time bus.
        peak_torque_nm: Greatest torque of a motor, as the drives report it: after their saturation [N·m].
        rms_torque_nm: Root mean square of the motors' torques, likewise [N·m].
        bus_load: Share of the loop's time in which the bus was busy, bit stuffing at its worst; of several the most.
        cycle_us: Wall time of a cycle's own work [us], waiting not counted.
        thesis: The thesis' result for this law and motion; None where it has none.
        timing: How the cycles' times are distributed; None in records that do not hold it yet.
        bus_loads: Of several buses, the load of each by its name in bus.log; None of one.
        thesis_ms: As in `Conditions`, and so the departures; not in records that do not hold them yet.
        departures: In what the run departs from the thesis' experiment.
    """

    law: str
    motion: int | str
    gains: UsedGains
    plant: str | None
    bus: str
    rate_hz: float
    cycles: int
    overruns: int
    position_rmse_mm: float
    velocity_rmse_m_s: float
    true_position_rmse_mm: float | None
    peak_torque_nm: float
    rms_torque_nm: float
    bus_load: float
    cycle_us: Percentiles
    thesis: Published | None
    timing: Timing | None = None
    bus_loads: Mapping[str, float] | None = None
    thesis_ms: float | None = None
    departures: tuple[str, ...] = ()

    @property
    def law_us(self) -> float:
        """Median time of estimator, kinematics, limits and law in a cycle [µs]; NaN where it is not known."""
        return math.nan if self.timing is None else self.timing.law_us.p50

    @classmethod
    def from_json(cls, facts: Mapping[str, Any]) -> Self:
        """The summary that `as_json` turned into this object.

        Args:
            facts: The object.

        Returns:
            The summary; a number that was none is NaN again.

        Raises:
            KeyError: Something is missing.
        """
        known = [field for field in fields(cls) if field.default is MISSING]
        values = {field.name: _restored(facts[field.name], field.type) for field in known}
        thesis = facts["thesis"] and Published(**facts["thesis"], source="thesis, as the record has it")
        timing = facts.get("timing")
        later = {
            "timing": timing and Timing.from_json(timing),
            "bus_loads": facts.get("bus_loads"),
            "thesis_ms": facts.get("thesis_ms"),
            "departures": tuple(facts.get("departures", ())),
        }
        return cls(**{**values, "thesis": thesis, **later})

    def as_json(self) -> dict[str, Any]:
        """The summary as JSON holds it: a number that is none (no sample of the motion was run) becomes null."""
        facts = asdict(self) | {"law_us": self.law_us}
        facts["thesis"] = self.thesis and {
            "position_rmse_mm": self.thesis.position_rmse_mm,
            "velocity_rmse_m_s": self.thesis.velocity_rmse_m_s,
        }
        if self.bus_loads is None:
            del facts["bus_loads"]
        return {key: finite(value) for key, value in facts.items()}


def summarise(
    conditions: Conditions,
    log: LoopLog,
    *,
    bus_loads: Mapping[str, float],
    true_position_rmse_mm: float | None = None,
    thesis: Published | None = None,
) -> Summary:
    """Put a run's numbers together.

    Args:
        conditions: What was run.
        log: The loop's log.
        bus_loads: Share of time in which each bus was busy, by its name.
        true_position_rmse_mm: Position error by the simulator's own state [mm].
        thesis: The thesis' result for this law and motion.

    Returns:
        The summary.
    """
    return Summary(
        law=conditions.law,
        motion=conditions.motion,
        gains=conditions.gains,
        plant=conditions.plant,
        bus=conditions.bus,
        rate_hz=conditions.rate_hz,
        cycles=log.rows,
        overruns=overruns(log),
        position_rmse_mm=position_rmse_mm(log),
        velocity_rmse_m_s=velocity_rmse(log),
        true_position_rmse_mm=true_position_rmse_mm,
        peak_torque_nm=peak_torque(log),
        rms_torque_nm=rms_torque(log),
        bus_load=max(bus_loads.values()),
        cycle_us=work_us(log),
        thesis=thesis,
        timing=timing_of(log),
        bus_loads=bus_loads if len(bus_loads) > 1 else None,
        thesis_ms=conditions.thesis_ms,
        departures=conditions.departures,
    )


def motion_name(motion: int | str) -> int | str:
    """What a summary calls a motion: its number or name; a trajectory by its file's name without the folders."""
    return motion if isinstance(motion, int) else Path(motion).name


def motion_in_words(motion: int | str) -> str:
    """A motion in words: "motion 1", "circle", "square.csv"."""
    return f"motion {motion}" if isinstance(motion, int) else Path(motion).name


def _restored(value: Any, kind: Any) -> Any:  # noqa: ANN401  (whatever a field holds)
    """A value of a field: NaN where a number must be and none is, an object where JSON has a table."""
    if isinstance(value, Mapping) and isinstance(kind, type) and is_dataclass(kind):
        return kind(**{field.name: _restored(value[field.name], field.type) for field in fields(kind)})
    return math.nan if value is None and kind is float else value
