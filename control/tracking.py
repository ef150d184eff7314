"""How well a run tracked: pure functions of its log, over the motion's samples only."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from torquerig.control.log import LoopLog

MILLIMETRES_PER_METRE = 1000.0


@dataclass(frozen=True, slots=True)
class Percentiles:
    """A distribution in three numbers, in the unit of what it was taken of."""

    p50: float
    p99: float
    max: float


def motion_rows(log: LoopLog) -> NDArray[np.bool_]:
    """Which rows count: those of the motion that were run to their command, not skipped; shape (log.rows,)."""
    rows = slice(log.rows)
    return log.in_motion[rows] & ~np.isnan(log.tau[rows, 0])


def rms_norm(errors: NDArray[np.float64]) -> float:
    """sqrt(sum |err|² / n), the thesis' RMSE (6.5), with the norm of each row.

    Args:
        errors: One error a row, shape (n, m).

    Returns:
        The root mean square of the rows' norms in the errors' unit; NaN when there is none.
    """
    if len(errors) == 0:
        return math.nan
    return math.sqrt(float(np.sum(errors**2)) / len(errors))


def rms(values: NDArray[np.float64]) -> float:
    """Root mean square over everything that is a number, in the values' unit; NaN when nothing is."""
    known = values[np.isfinite(values)]
    return math.sqrt(float(np.mean(known**2))) if known.size else math.nan


def position_rmse_mm(log: LoopLog) -> float:
    """Position RMSE [mm]: the measured position against the reference, in the plane."""
    rows = motion_rows(log)
    return MILLIMETRES_PER_METRE * rms_norm(
        log.desired_position[: log.rows][rows] - log.position[: log.rows][rows],
    )


def velocity_rmse(log: LoopLog) -> float:
    """Velocity RMSE [m/s]: the estimated velocity against the reference, in the plane."""
    rows = motion_rows(log)
    return rms_norm(log.desired_velocity[: log.rows][rows] - log.velocity[: log.rows][rows])


def peak_torque(log: LoopLog) -> float:
    """Greatest torque of any motor during the motion, as the drives report it [N·m at the motor]; NaN without any."""
    tau = log.tau_actual[: log.rows][motion_rows(log)]
    return float(np.max(np.abs(tau))) if len(tau) else math.nan


def rms_torque(log: LoopLog) -> float:
    """Root mean square of the torques that the drives report, in the motion, over all motors [N·m at the motor]."""
    return rms(log.tau_actual[: log.rows][motion_rows(log)])


def late_cycles(log: LoopLog) -> int:
    """Cycles that came too late and were skipped."""
    return int(np.count_nonzero(log.skipped[: log.rows]))


def overruns(log: LoopLog) -> int:
    """Cycles that did not finish inside their own period: skipped, or their command left after the next was due."""
    return int(np.count_nonzero(overrun_rows(log)))


def overrun_rows(log: LoopLog) -> NDArray[np.bool_]:
    """Which rows are overruns; shape (log.rows,)."""
    rows = slice(log.rows)
    late: NDArray[np.bool_] = log.skipped[rows] | (log.command_ns[rows] > log.period_ns)
    return late


def incomplete_samples(log: LoopLog) -> int:
    """Cycles that ran on a sample which lacked an axis."""
    rows = slice(log.rows)
    return int(np.count_nonzero(~log.complete[rows] & ~log.skipped[rows]))


def clipped_cycles(log: LoopLog) -> int:
    """Cycles in which a torque was cut to its limit."""
    return int(np.count_nonzero(log.clipped[: log.rows]))


def work_us(log: LoopLog) -> Percentiles:
    """The cycles' own work [µs], waiting not counted; NaN when no cycle ran."""
    return _microseconds(log, log.work_ns)


def law_us(log: LoopLog) -> Percentiles:
    """The law's share of the cycles' work [µs]: estimator, kinematics, limits and law; NaN when no cycle ran."""
    return _microseconds(log, log.law_ns)


def _microseconds(log: LoopLog, ns: NDArray[np.int64] | NDArray[np.float64]) -> Percentiles:
    """How a time of the cycles that were run is distributed [µs]."""
    times = ns[: log.rows][~log.skipped[: log.rows]] / 1000.0
    times = times[~np.isnan(times)]  # a limit may have ended the last cycle before its law
    if len(times) == 0:
        return Percentiles(math.nan, math.nan, math.nan)
    p50, p99 = np.percentile(times, (50, 99))
    return Percentiles(float(p50), float(p99), float(np.max(times)))
