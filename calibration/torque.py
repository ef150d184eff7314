"""The torque procedure: how many counts make a newton metre, by a locked rotor against a transducer (thesis, 5.4.1)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import Any, Final, Literal

import numpy as np

from torquerig.calibration.conductor import Conductor
from torquerig.calibration.procedure import Bounds, Column, Doubt, Estimate, Grade, Plan, Result, Start, Table, Verdict
from torquerig.calibration.torque_fit import DirectionFit, Interval, LevelReading
from torquerig.calibration.torque_levels import HeldLevels, Schedule
from torquerig.calibration.torque_scale import NEGATIVE, POSITIVE, AxisTorque, analyse

AVERAGE: Final = "average"
PER_DIRECTION: Final = "per-direction"
Mode = Literal["average", "per-direction"]

SPEED: Final = 0.5
"""[rad/s] of the joint: a locked rotor does not turn, and a free one has this speed within a cycle; our choice."""
TRAVEL: Final = 0.02
"""[rad] of the joint: half a radian of the motor, more than a lock gives; our choice."""

_UNIT: Final = "counts/(N·m)"
_MARGIN: Final = 1.2  # by which the bounds exceed what is planned, in time
_SPARE: Final = 5.0  # [s] of it for configuring the transducer


@dataclass(frozen=True, slots=True)
class Timing:
    """How long a level takes.

    Attributes:
        settle: Held before it is read [s].
        reading: Held while it is read, at most [s].
    """

    settle: float
    reading: float


@dataclass(frozen=True, slots=True)
class TorqueProcedure:
    """Calibrates axes one after the other; satisfies `procedure.Procedure`.

    Attributes:
        axes: Which ones, from 1.
        source: Holds the levels; None where they were held and read elsewhere, and are only to be evaluated.
        schedule: The levels that are held; None when none are.
        timing: How long each takes.
        nominal: What is configured for each axis, mean of both directions, shape (n,) [counts/(N·m)].
        mode: What goes into the calibration: the average of both slopes, as in the thesis, or each direction's own.
        where: Where readings come from, in words.
    """

    axes: tuple[int, ...]
    source: HeldLevels | None
    schedule: Schedule | None
    timing: Timing
    nominal: tuple[float, ...]
    mode: Mode = AVERAGE
    where: str = "a transducer"

    @property
    def name(self) -> str:
        """As the command line calls it."""
        return "torque"

    @property
    def start(self) -> Start:
        """Positions need no meaning."""
        return Start.ENABLED

    def plan(self) -> Plan:
        """What it will do."""
        axes = _listed(self.axes)
        title = f"Torque scale of {axes}: levels on a locked rotor, by {self.where}"
        if self.schedule is None:
            read = f"Read levels and torques from {self.where}; nothing moves, and no bus is opened."
            return Plan(title, (), (read, self._fit_words()), Bounds(0.0, SPEED, TRAVEL, _SPARE))
        schedule, timing = self.schedule, self.timing
        lasts = len(self.axes) * _duration(schedule, timing)
        before = (
            f"Lock the rotor of {axes} and let it load nothing but the transducer.",
            "Nobody may hold the shaft: the motor gives up to "
            f"{schedule.top / min(self.nominal):.2f} N·m for some seconds, above its rated torque.",
        )
        steps = (
            f"Without torque, {self.where} is zeroed.",
            f"{schedule.levels} levels from {schedule.low} to {schedule.high} counts up, on to {schedule.top}, and the"
            f" same down; then negative ones. Ramps of {schedule.ramp:.0f} counts/s between them.",
            f"Each is held {timing.settle:g} s before it is read, and up to {timing.reading:g} s while it is.",
            self._fit_words(),
        )
        torque = schedule.top / min(self.nominal)
        return Plan(title, before, steps, Bounds(torque, SPEED, TRAVEL, _MARGIN * lasts + _SPARE), lasts)

    def measure(self, conductor: Conductor) -> dict[int, list[LevelReading]]:
        """Hold all levels, axis by axis; levels by axis come back."""
        assert self.source is not None  # noqa: S101  (what was held elsewhere is not measured)
        try:
            self.source.open(conductor)
            return {axis: self.source.levels(conductor, axis) for axis in self.axes}
        finally:
            self.source.close()

    def evaluate(self, measured: dict[int, list[LevelReading]]) -> Result:
        """Fit and judge."""
        scales = tuple(analyse(axis, measured[axis], nominal=self.nominal[axis - 1]) for axis in self.axes)
        return Result(
            _verdict(scales),
            tuple(estimate for scale in scales for estimate in _estimates(scale)),
            {key: value for scale in scales for key, value in self._settings(scale)},
            {"mode": self.mode, "axes": [_facts(scale) for scale in scales]},
            (_table(scales),),
            scales,
        )

    def _fit_words(self) -> str:
        what = "the average of both slopes" if self.mode == AVERAGE else "each direction's own slope"
        return f"A line is fitted to each direction; {what} is what the driver will use."

    def _settings(self, scale: AxisTorque) -> Iterator[tuple[str, object]]:
        if scale.average is None or scale.failures:
            return
        for name, fit in scale.fits:
            slope = scale.average if self.mode == AVERAGE or fit is None else fit.counts_per_nm
            yield f"axes.{scale.axis}.counts_per_nm_{name}", round(slope.value, 1)


def _listed(axes: Sequence[int]) -> str:
    names = [str(axis) for axis in axes]
    return f"axis {names[0]}" if len(names) == 1 else f"axes {', '.join(names[:-1])} and {names[-1]}"


def _duration(schedule: Schedule, timing: Timing) -> float:
    """How long one axis takes [s]."""
    steps = schedule.steps()
    held = sum(timing.settle + (timing.reading if step.measured else 0.0) for step in steps)
    return held + 4.0 * schedule.top / schedule.ramp


def _verdict(scales: Sequence[AxisTorque]) -> Verdict:
    suspicions: list[Doubt] = [doubt for scale in scales for doubt in scale.suspicions]
    failures = [doubt for scale in scales for doubt in scale.failures]
    verdict = Verdict.of(suspicions=suspicions, failures=failures)
    notes = tuple(note for scale in scales for note in scale.notes)
    return Verdict(verdict.grade, (*verdict.reasons, *notes), verdict.advice) if notes else verdict


def _estimates(scale: AxisTorque) -> Iterator[Estimate]:
    where = f"axis {scale.axis}"
    for name, fit in scale.fits:
        if fit is not None:
            yield _estimate(f"{where}, {name}", fit.counts_per_nm, _UNIT)
    if scale.average is not None:
        yield _estimate(f"{where}, average", scale.average, _UNIT)
    for name, fit in scale.fits:
        if fit is not None:
            yield _estimate(f"{where}, {name}: intercept", fit.intercept, "counts")
            if isfinite(fit.friction.value):
                yield _estimate(f"{where}, {name}: friction", fit.friction, "N·m")


def _estimate(name: str, interval: Interval, unit: str) -> Estimate:
    """The estimate; an interval without bounds is none."""
    ends = (interval.low, interval.high) if isfinite(interval.low) and isfinite(interval.high) else (nan, nan)
    return Estimate(name, interval.value, *ends, unit)


def _facts(scale: AxisTorque) -> dict[str, Any]:
    grade = Grade.FAILED if scale.failures else Grade.SUSPICIOUS if scale.suspicions else Grade.OK
    return {
        "axis": scale.axis,
        "verdict": grade.value,
        POSITIVE: scale.positive and _direction(scale.positive),
        NEGATIVE: scale.negative and _direction(scale.negative),
        "average": scale.average and _number(scale.average.value),
        "average_low": scale.average and _number(scale.average.low),
        "average_high": scale.average and _number(scale.average.high),
        "saturated": [{"level": each.reading.level, "why": each.cause.value} for each in scale.saturated],
    }


def _direction(fit: DirectionFit) -> dict[str, Any]:
    return {
        **_interval("counts_per_nm", "", fit.counts_per_nm),
        **_interval("intercept_counts", "intercept_", fit.intercept),
        **_interval("friction_nm", "friction_", fit.friction),
        "hysteresis_percent": _number(100.0 * fit.hysteresis),
        "linearity_percent": _number(100.0 * fit.linearity),
        "noise_nm": _number(fit.noise),
        "outliers": [{"level": each.level, "rising": each.rising, "torque": each.torque} for each in fit.outliers],
    }


def _interval(name: str, prefix: str, interval: Interval) -> dict[str, float | None]:
    low, high = _number(interval.low), _number(interval.high)
    return {name: _number(interval.value), f"{prefix}low": low, f"{prefix}high": high}


def _number(value: float) -> float | None:
    """The number for JSON, which has no NaN and no infinity."""
    return value if isfinite(value) else None


def _table(scales: Sequence[AxisTorque]) -> Table:
    """All levels as raw data."""
    rows = [(scale, reading) for scale in scales for reading in scale.readings]
    used = {id(reading) for scale in scales for _, fit in scale.fits if fit for reading in fit.used}
    readings = [reading for _, reading in rows]
    return Table(
        "levels",
        (
            Column("axis", "1", np.array([scale.axis for scale, _ in rows], dtype=np.int8)),
            Column("level", "counts", np.array([reading.level for reading in readings], dtype=np.int32)),
            Column("rising", "1", np.array([reading.rising for reading in readings], dtype=np.bool_)),
            Column("torque", "N·m", np.array([reading.torque for reading in readings])),
            Column("spread", "N·m", np.array([reading.spread for reading in readings])),
            Column("samples", "1", np.array([reading.samples for reading in readings], dtype=np.int32)),
            Column("actual", "counts", np.array([reading.actual for reading in readings])),
            Column("overloaded", "1", np.array([reading.overloaded for reading in readings], dtype=np.bool_)),
            Column("used", "1", np.array([id(reading) in used for reading in readings], dtype=np.bool_)),
        ),
    )
