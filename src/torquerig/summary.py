"""What a run comes to: the numbers of its summary, and the object that --json prints."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from torquerig.control.law import Published
from torquerig.control.log import LoopLog
from torquerig.control.tracking import (
    Percentiles,
    motion_rows,
    overruns,
    position_rmse_mm,
    velocity_rmse,
    work_us,
)


@dataclass(frozen=True, slots=True)
class Conditions:
    """What was run.

    Attributes:
        law: Name of the law.
        motion: Number of the motion.
        plant: Name of the simulated plant; None where it is not known.
        bus: The bus URL.
        rate_hz: Cycles a second.
    """

    law: str
    motion: int
    plant: str | None
    bus: str
    rate_hz: float


@dataclass(frozen=True, slots=True)
class Summary:
    """The outcome of a run. Errors and torques are over the motion's samples only.

    Attributes:
        law: Name of the law.
        motion: Number of the motion.
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
        bus_load: Share of the loop's time in which the bus was busy, bit stuffing at its worst.
        cycle_us: Wall time of a cycle's own work [us], waiting not counted.
        thesis: The thesis' result for this law and motion; None where it has none.
    """

    law: str
    motion: int
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

    def as_json(self) -> dict[str, Any]:
        """The summary as JSON holds it: a number that is none (no sample of the motion was run) becomes null."""
        facts = asdict(self)
        facts["thesis"] = self.thesis and {
            "position_rmse_mm": self.thesis.position_rmse_mm,
            "velocity_rmse_m_s": self.thesis.velocity_rmse_m_s,
        }
        return {key: _finite(value) for key, value in facts.items()}


def summarise(
    conditions: Conditions,
    log: LoopLog,
    *,
    bus_load: float,
    true_position_rmse_mm: float | None = None,
    thesis: Published | None = None,
) -> Summary:
    """Put a run's numbers together.

    Args:
        conditions: What was run.
        log: The loop's log.
        bus_load: Share of time in which the bus was busy.
        true_position_rmse_mm: Position error by the simulator's own state [mm].
        thesis: The thesis' result for this law and motion.

    Returns:
        The summary.
    """
    torques = log.tau_actual[: log.rows][motion_rows(log)]
    return Summary(
        law=conditions.law,
        motion=conditions.motion,
        plant=conditions.plant,
        bus=conditions.bus,
        rate_hz=conditions.rate_hz,
        cycles=log.rows,
        overruns=overruns(log),
        position_rmse_mm=position_rmse_mm(log),
        velocity_rmse_m_s=velocity_rmse(log),
        true_position_rmse_mm=true_position_rmse_mm,
        peak_torque_nm=float(np.max(np.abs(torques), initial=0.0)) if len(torques) else math.nan,
        rms_torque_nm=float(np.sqrt(np.mean(torques**2))) if len(torques) else math.nan,
        bus_load=bus_load,
        cycle_us=work_us(log),
        thesis=thesis,
    )


def _finite(value: object) -> object:
    """A value with each NaN in it turned into None."""
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value
