"""How a loop kept its time: what each cycle's parts took, and which cycles were not done within their period."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from torquerig.control.log import LoopLog
from torquerig.control.tracking import overrun_rows
from torquerig.json_numbers import finite

NS_PER_US = 1e3
NS_PER_S = 1e9


@dataclass(frozen=True, slots=True)
class Distribution:
    """A time's distribution in four numbers [us]; NaN where there is none.

    Attributes:
        p50: Median.
        p99: What 99 of 100 cycles do not exceed.
        p999: What 999 of 1000 do not; of fewer cycles hardly less than the greatest.
        max: The greatest.
    """

    p50: float
    p99: float
    p999: float
    max: float

    @classmethod
    def of(cls, times_us: NDArray[np.float64]) -> Self:
        """The distribution of times, shape (n,) [us]."""
        if not times_us.size:
            return cls(math.nan, math.nan, math.nan, math.nan)
        return cls(*np.percentile(times_us, (50, 99, 99.9, 100)).tolist())

    @classmethod
    def from_json(cls, facts: Mapping[str, float | None]) -> Self:
        """The distribution of which `asdict` and `finite` made this object; KeyError where something is missing."""
        values = [facts[field.name] for field in fields(cls)]
        return cls(*(math.nan if value is None else value for value in values))


@dataclass(frozen=True, slots=True)
class Timing:
    """A run's times, over every cycle that was run, approach and holds included.

    Attributes:
        lateness_us: SYNC after its due time.
        sync_to_last_tpdo_us: Until the loop had the answers of all drives; cycles that lacked one are left out.
        law_us: Estimator, kinematics, limits and law, by the clock on the wall.
        sync_to_last_rpdo_us: Until the last torque was handed to the bus.
        tpdo_us_by_drive: From SYNC to the arrival of each drive's TPDO, in the axes' order; none where the record does
            not hold it.
        overruns_at_s: When the cycles were due that were skipped or whose torques left after their period, in seconds
            after the loop's first cycle.
    """

    lateness_us: Distribution
    sync_to_last_tpdo_us: Distribution
    law_us: Distribution
    sync_to_last_rpdo_us: Distribution
    tpdo_us_by_drive: tuple[Distribution, ...]
    overruns_at_s: tuple[float, ...]

    @classmethod
    def from_json(cls, facts: Mapping[str, Any]) -> Self:
        """The timing that `as_json` turned into this object; KeyError where something is missing."""
        return cls(
            lateness_us=Distribution.from_json(facts["lateness_us"]),
            sync_to_last_tpdo_us=Distribution.from_json(facts["sync_to_last_tpdo_us"]),
            law_us=Distribution.from_json(facts["law_us"]),
            sync_to_last_rpdo_us=Distribution.from_json(facts["sync_to_last_rpdo_us"]),
            tpdo_us_by_drive=tuple(Distribution.from_json(drive) for drive in facts["tpdo_us_by_drive"]),
            overruns_at_s=tuple(facts["overruns_at_s"]),
        )

    def as_json(self) -> dict[str, Any]:
        """The timing as JSON holds it: a number that is none becomes null."""
        return {key: finite(value) for key, value in asdict(self).items()}


@dataclass(frozen=True, slots=True, eq=False)
class CycleTimes:
    """The times themselves [us], each shape (cycles,): only of the cycles that have it.

    Attributes:
        lateness: As in `Timing`, and so the others.
        tpdo_by_drive: One a drive; none where nobody looked.
        last_tpdo: SYNC to the last TPDO.
        law: Estimator, kinematics, limits and law.
        last_rpdo: SYNC to the last RPDO.
    """

    lateness: NDArray[np.float64]
    tpdo_by_drive: tuple[NDArray[np.float64], ...]
    last_tpdo: NDArray[np.float64]
    law: NDArray[np.float64]
    last_rpdo: NDArray[np.float64]


def cycle_times(log: LoopLog) -> CycleTimes:
    """The times of a log's cycles that were run.

    Args:
        log: The log.

    Returns:
        The times; a skipped cycle has none, and one that a limit ended has no RPDO.
    """
    rows = slice(log.rows)
    run = ~log.skipped[rows]
    sampled_ns = log.sample_ns[rows] - log.lateness_ns[rows]
    commanded_ns = log.command_ns[rows] - log.lateness_ns[rows]
    answers = log.tpdo_ns[rows]
    drives = range(answers.shape[1]) if np.isfinite(answers).any() else range(0)
    return CycleTimes(
        lateness=log.lateness_ns[rows][run] / NS_PER_US,
        tpdo_by_drive=tuple(_known_us(answers[:, drive]) for drive in drives),
        last_tpdo=sampled_ns[run & log.complete[rows]] / NS_PER_US,
        law=_known_us(log.law_ns[rows]),
        last_rpdo=commanded_ns[run & ~np.isnan(log.tau[rows, 0])] / NS_PER_US,
    )


def timing_of(log: LoopLog) -> Timing:
    """How a log's loop kept its time."""
    times = cycle_times(log)
    return Timing(
        lateness_us=Distribution.of(times.lateness),
        sync_to_last_tpdo_us=Distribution.of(times.last_tpdo),
        law_us=Distribution.of(times.law),
        sync_to_last_rpdo_us=Distribution.of(times.last_rpdo),
        tpdo_us_by_drive=tuple(map(Distribution.of, times.tpdo_by_drive)),
        overruns_at_s=tuple((log.due_ns[: log.rows][overrun_rows(log)] / NS_PER_S).tolist()),
    )


def _known_us(times_ns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Those of some times that are known [us]."""
    known: NDArray[np.float64] = times_ns[~np.isnan(times_ns)] / NS_PER_US
    return known
