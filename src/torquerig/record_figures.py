"""The figures of a record, one number each with its name, words and unit: what is shown of one and compared of many."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from torquerig.control.log import LoopLog
from torquerig.control.tracking import clipped_cycles, incomplete_samples, motion_rows
from torquerig.device_sim.plant import TruthRows
from torquerig.record import SIM
from torquerig.records import RecordedRun
from torquerig.summary import Summary


class Figure(NamedTuple):
    """One number of a record.

    Attributes:
        name: Its name in JSON.
        words: What it is, with its unit, for a person.
        value: The number; NaN where there is none.
        digits: Digits behind the point, for a person.
    """

    name: str
    words: str
    value: float
    digits: int = 4


def figures_of(record: RecordedRun) -> list[Figure]:
    """Every figure of a record: of a run from its cycles, of simulated drives from their truth.

    Args:
        record: The record.

    Returns:
        The figures; none of a run that ended before its loop.
    """
    if record.kind == SIM:
        return list(_of_truth(record.truth)) if record.truth is not None and len(record.truth.at_ns) else []
    if record.log is None or record.summary is None or not record.log.rows:
        return []
    return [*_of_summary(record.summary), *_of_log(record.log)]


def ratio(value: float, to: float) -> float:
    """One figure over another; NaN where there is none or it would be over zero."""
    return value / to if to else math.nan


def differing(records: Sequence[RecordedRun]) -> dict[str, list[Any]]:
    """The settings in which records differ.

    Args:
        records: The records.

    Returns:
        Each record's value by dotted key; None where a record has no such key.
    """
    settings = [dict(_leaves(record.configuration)) for record in records]
    keys = dict.fromkeys(key for each in settings for key in each)
    values = {key: [each.get(key) for each in settings] for key in keys}
    return {key: of_each for key, of_each in values.items() if any(value != of_each[0] for value in of_each)}


def _of_summary(summary: Summary) -> Iterator[Figure]:
    """The figures that the summary has."""
    true_mm = summary.true_position_rmse_mm
    yield Figure("position_rmse_mm", "position RMSE [mm]", summary.position_rmse_mm)
    yield Figure("true_position_rmse_mm", "true position RMSE [mm]", math.nan if true_mm is None else true_mm)
    yield Figure("velocity_rmse_m_s", "velocity RMSE [m/s]", summary.velocity_rmse_m_s)
    yield Figure("peak_torque_nm", "peak torque [N·m]", summary.peak_torque_nm)
    yield Figure("rms_torque_nm", "rms torque [N·m]", summary.rms_torque_nm)
    yield Figure("cycles", "cycles", summary.cycles, 0)
    yield Figure("late_cycles", "late cycles", summary.overruns, 0)
    yield Figure("bus_load", "bus load [1]", summary.bus_load)
    yield Figure("work_us", "work a cycle, median [µs]", summary.cycle_us.p50, 0)
    yield Figure("law_us", "of it the law, median [µs]", summary.law_us, 0)
    thesis_ms = math.nan if summary.thesis_ms is None else summary.thesis_ms
    yield Figure("thesis_ms", "the law in the thesis [ms]", thesis_ms, 2)


def _of_log(log: LoopLog) -> Iterator[Figure]:
    """The figures that the summary has not."""
    counted = motion_rows(log)
    errors = np.linalg.norm(log.desired_position[: log.rows] - log.position[: log.rows], axis=1)[counted]
    yield Figure("greatest_position_error_mm", "greatest position error [mm]", 1e3 * _greatest(errors))
    yield Figure("motion_samples", "samples of the motion", int(np.count_nonzero(counted)), 0)
    yield Figure("clipped_cycles", "cycles cut to the torque limit", clipped_cycles(log), 0)
    yield Figure("incomplete_samples", "samples that lacked a drive", incomplete_samples(log), 0)


def _of_truth(truth: TruthRows) -> Iterator[Figure]:
    """What a simulated machine really did."""
    low, high = 1e3 * truth.position.min(axis=0), 1e3 * truth.position.max(axis=0)
    yield Figure("duration_s", "duration [s]", (truth.at_ns[-1] - truth.at_ns[0]) / 1e9, 3)
    yield Figure("rows", "rows", len(truth.at_ns), 0)
    for axis, least, most in zip("xy", low.tolist(), high.tolist(), strict=True):
        yield Figure(f"{axis}_least_mm", f"least {axis} [mm]", least, 3)
        yield Figure(f"{axis}_greatest_mm", f"greatest {axis} [mm]", most, 3)
    yield Figure("top_speed_m_s", "top speed [m/s]", _greatest(np.linalg.norm(truth.velocity, axis=1)))
    yield Figure("peak_torque_nm", "peak torque [N·m]", _greatest(np.abs(truth.motor_torque)))
    yield Figure("rms_torque_nm", "rms torque [N·m]", float(np.sqrt(np.mean(truth.motor_torque**2))))


def _greatest(values: Any) -> float:  # noqa: ANN401  (an array of any shape)
    """The greatest of values; NaN when there is none."""
    return float(np.max(values)) if np.size(values) else math.nan


def _leaves(tables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every value of nested tables with its dotted key."""
    for key, value in tables.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
