"""The torque scale of one axis: both directions' lines, what saturated, and what speaks against the result."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import isnan
from typing import Final, NamedTuple

import numpy as np

from torquerig.calibration.procedure import Doubt
from torquerig.calibration.torque_fit import LEAST_LEVELS, DirectionFit, Interval, LevelReading, average, fit_direction

POSITIVE: Final = "positive"
NEGATIVE: Final = "negative"

DEAD: Final = 0.1
"""A transducer that shows less than this share of what the levels ask for does not feel them; our choice."""
FLAT: Final = 0.25
"""Levels at the top that rise by less than this share of what they ask for are clipped; our choice."""
GIVES_LESS: Final = 0.02
"""A drive whose actual torque is short of its target by this share is at its limit; our choice: far above rounding."""
CLOSE: Final = 2e-3
"""Readings within this share of a flat top belong to it; our choice."""
BENT: Final = 0.01
"""A parabola of this share of the largest torque is no straight line; our choice: twice a slope's wanted accuracy."""
WIDE: Final = 0.005
"""Half an interval of this share is too wide: slopes are wanted within 0.5 %."""
STRANGE: Final = 0.25
"""A slope that differs by this share from the configured one, or from the other direction's, is to be looked at; the
thesis' two differ by 6 %."""
MUCH_PLAY: Final = 0.3
"""Hysteresis of this share of the largest torque; the thesis' 0.02 N·m of stiction makes a tenth."""
MANY: Final = 0.2
"""A share of outliers that single mishaps do not explain."""
_CERTAIN: Final = 5.0  # standard deviations


class Cause(Enum):
    """Why a level is thought to be saturated; its value is the end of a sentence."""

    OVERLOADED = "the transducer says that it is overloaded"
    LIMITED = "the drive says that it gives less: it is at its limit"
    CLIPPED = "the readings have stopped growing: something clips them"


class Saturation(NamedTuple):
    """A level that reached less than it asked for.

    Attributes:
        reading: The level.
        cause: Why it is thought so.
    """

    reading: LevelReading
    cause: Cause


@dataclass(frozen=True, slots=True)
class AxisTorque:
    """What one axis' levels say.

    Attributes:
        axis: Its number, from 1.
        readings: All levels, in the order in which they were held.
        positive: The line of positive counts; None without one.
        negative: The line of negative counts; None without one.
        average: Average of both slopes, as the thesis takes it; None unless there are both.
        saturated: Levels that no line was fitted to.
        notes: What a person should know though it speaks against nothing.
        suspicions: What may be wrong.
        failures: Why it must not be used.
    """

    axis: int
    readings: tuple[LevelReading, ...]
    positive: DirectionFit | None
    negative: DirectionFit | None
    average: Interval | None
    saturated: tuple[Saturation, ...]
    notes: tuple[str, ...]
    suspicions: tuple[Doubt, ...]
    failures: tuple[Doubt, ...]

    @property
    def fits(self) -> tuple[tuple[str, DirectionFit | None], ...]:
        """Both lines with their names."""
        return (POSITIVE, self.positive), (NEGATIVE, self.negative)


def analyse(axis: int, readings: Sequence[LevelReading], *, nominal: float) -> AxisTorque:
    """Fit and judge one axis.

    Args:
        axis: Its number, from 1.
        readings: Its levels, in the order in which they were held.
        nominal: What is configured [counts/(N·m)].

    Returns:
        The lines, and what speaks against them.
    """
    if dead := _dead(axis, readings, nominal):
        return AxisTorque(axis, tuple(readings), None, None, None, (), (), (), (dead,))
    saturated = _saturated(readings, nominal)
    left_out = {id(each.reading) for each in saturated}
    sound = [reading for reading in readings if id(reading) not in left_out]
    positive = fit_direction([reading for reading in sound if reading.level > 0])
    negative = fit_direction([reading for reading in sound if reading.level < 0])
    mean = average(positive.counts_per_nm, negative.counts_per_nm) if positive and negative else None
    notes = tuple(_notes(axis, positive, negative))
    scale = AxisTorque(axis, tuple(readings), positive, negative, mean, tuple(saturated), notes, (), ())
    failures = tuple(_failures(scale))
    suspicions = () if failures else tuple(_suspicions(scale, nominal))
    return replace(scale, suspicions=(*_saturation_doubts(scale), *suspicions), failures=failures)


def _dead(axis: int, readings: Sequence[LevelReading], nominal: float) -> Doubt | None:
    """A transducer that does not feel what the motor does."""
    if not readings:
        return None
    torques = [reading.torque for reading in readings]
    levels = [reading.level for reading in readings]
    shown, asked = max(torques) - min(torques), (max(levels) - min(levels)) / nominal
    if shown >= DEAD * asked or asked == 0.0:
        return None
    if shown == 0.0 and all(reading.spread == 0.0 for reading in readings if reading.samples > 1):
        return Doubt(
            f"axis {axis}: the transducer is dead: it shows {torques[0]:.5g} N·m at every level, without any noise",
            "Switch the transducer off and on, and check its bridge and amplifier.",
        )
    return Doubt(
        f"axis {axis}: the transducer does not feel the levels: it varies by {shown:.2g} N·m where they ask for"
        f" {asked:.2g} N·m",
        f"See that the transducer sits on the shaft of axis {axis}, that the rotor is locked, and that it has power.",
    )


def _saturated(readings: Sequence[LevelReading], nominal: float) -> list[Saturation]:
    """Levels that transducer or drive could not follow, in the order in which they were held."""
    found: dict[int, Saturation] = {}
    for number, reading in enumerate(readings):
        if reading.overloaded:
            found[number] = Saturation(reading, Cause.OVERLOADED)
        elif not isnan(reading.actual) and abs(reading.level - reading.actual) > GIVES_LESS * abs(reading.level):
            found[number] = Saturation(reading, Cause.LIMITED)
    for way in (1, -1):
        numbers = [n for n, reading in enumerate(readings) if reading.level * way > 0 and n not in found]
        for number in _clipped(readings, numbers, nominal):
            found[number] = Saturation(readings[number], Cause.CLIPPED)
    return [found[number] for number in sorted(found)]


def _clipped(readings: Sequence[LevelReading], numbers: Sequence[int], nominal: float) -> list[int]:
    """Which of one direction's levels lie on a flat top: one that the highest levels of the way up show."""
    rising = sorted((n for n in numbers if readings[n].rising), key=lambda n: abs(readings[n].level))
    if len(rising) < LEAST_LEVELS:
        return []
    second, first = (readings[n] for n in rising[-2:])
    if abs(first.torque - second.torque) > FLAT * abs(first.level - second.level) / nominal:
        return []
    top = max(abs(readings[n].torque) for n in numbers)
    blur = max(CLOSE * top, *(_blur(readings[n]) for n in numbers))
    return [n for n in numbers if abs(readings[n].torque) > top - blur]


def _blur(reading: LevelReading) -> float:
    """How far a mean may be from the truth by noise, with near certainty [N·m]."""
    return _CERTAIN * reading.spread / reading.samples**0.5 if reading.samples > 1 else 0.0


def _notes(axis: int, *fits: DirectionFit | None) -> Iterator[str]:
    for fit in fits:
        for reading in fit.outliers if fit else ():
            line = fit.torque(reading.level, rising=reading.rising) if fit else 0.0
            yield (
                f"axis {axis}: level {reading.level} ({'up' if reading.rising else 'down'}) is an outlier:"
                f" {reading.torque:.4f} N·m, {reading.torque - line:+.4f} N·m off the line; it was left out"
            )


def _failures(scale: AxisTorque) -> Iterator[Doubt]:
    axis = scale.axis
    for name, fit in scale.fits:
        if fit is None:
            sign = 1 if name == POSITIVE else -1
            spoilt = {id(each.reading) for each in scale.saturated}
            usable = {r.level for r in scale.readings if r.level * sign > 0 and id(r) not in spoilt}
            yield Doubt(
                f"axis {axis}, {name}: too few levels: {len(usable)} usable ones, and {LEAST_LEVELS} are needed",
                "Hold more levels (--levels), below what saturates (--high).",
            )
    signs = [fit.counts_per_nm.value > 0.0 for _, fit in scale.fits if fit]
    if signs == [False, False]:
        yield Doubt(
            f"axis {axis}: wrong sign: positive counts make a negative reading, and negative ones a positive",
            "Run `torquerig calibrate direction`: if it finds the motor right, the transducer is mounted the other way"
            " round: set bench.sign = -1, or turn it.",
        )
    elif len(set(signs)) > 1:
        yield Doubt(
            f"axis {axis}: readings fall in one direction and grow in the other: they cannot be this motor's torque",
            "Look at the raw readings; see that nothing else loads the shaft.",
        )


def _suspicions(scale: AxisTorque, nominal: float) -> Iterator[Doubt]:
    axis = scale.axis
    for name, fit in scale.fits:
        if fit is None:
            continue
        where, slope = f"axis {axis}, {name}", fit.counts_per_nm
        if fit.bend_is_real and fit.bend > BENT:
            yield Doubt(
                f"{where}: not linear: a parabola deviates from the line by {100 * fit.bend:.1f} % of full scale",
                "Stay below saturation (--high), and check the transducer's range.",
            )
        if slope.high - slope.low > 2.0 * WIDE * abs(slope.value):
            percent = 50 * (slope.high - slope.low) / abs(slope.value)
            yield Doubt(f"{where}: the slope is known to {percent:.1f} % only", "Average longer (--average).")
        if abs(slope.value - nominal) > STRANGE * nominal:
            yield Doubt(
                f"{where}: {slope.value:.0f} counts/(N·m) is far from the configured {nominal:.0f}",
                "Check the transducer's unit and scale, and gears or levers between it and the motor.",
            )
        if fit.hysteresis > MUCH_PLAY:
            yield Doubt(
                f"{where}: the way down lies {100 * fit.hysteresis:.0f} % of full scale above the way up",
                "Look for friction between motor and transducer.",
            )
        if len(fit.outliers) > MANY * (len(fit.used) + len(fit.outliers)):
            yield Doubt(f"{where}: {len(fit.outliers)} levels are outliers", "Settle longer (--settle).")
    if scale.positive and scale.negative:
        slopes = np.array([scale.positive.counts_per_nm.value, scale.negative.counts_per_nm.value])
        if float(np.ptp(slopes)) > STRANGE * float(slopes.mean()):
            yield Doubt(f"axis {axis}: the slopes of the directions differ by more than {100 * STRANGE:.0f} %")


def _saturation_doubts(scale: AxisTorque) -> Iterator[Doubt]:
    for cause in Cause:
        levels = sorted({each.reading.level for each in scale.saturated if each.cause is cause})
        if levels:
            which = f"level{'s' if len(levels) > 1 else ''} {', '.join(map(str, levels))}"
            yield Doubt(
                f"axis {scale.axis}: saturated at {which}: {cause.value}; left out",
                "Hold lower levels (--high), or take a transducer of a larger range.",
            )
