"""Where the levels of a torque calibration come from: held on the bench, or written down before."""

import csv
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from math import isfinite
from typing import Final, NamedTuple

from torquerig.calibration.conductor import SECOND_NS, Conductor
from torquerig.calibration.errors import NoReading
from torquerig.calibration.torque_fit import LevelReading
from torquerig.calibration.torque_sensors import Averaged, SensorMaker, TorqueSensor, rounding
from torquerig.driver.errors import TorqueRigError

_LIMIT: Final = 32767  # of a 16-bit target torque


class Step(NamedTuple):
    """A level of a schedule.

    Attributes:
        level: What is commanded [counts].
        rising: Whether the torque grows towards it.
        measured: False for a level that is only passed through.
    """

    level: int
    rising: bool
    measured: bool = True


@dataclass(frozen=True, slots=True)
class Schedule:
    """Levels up and down in both directions.

    Attributes:
        low: The lowest level of a direction [counts]; the thesis' is 3500 (Figure 5.5).
        high: The highest [counts]; the thesis' is 8000.
        levels: How many, low and high included.
        overshoot: How far beyond `high` the torque goes between the way up and the way down, as a share of it: friction
            has to let go of the way up before the first level of the way down.
        ramp: How fast levels change [counts/s]; our choice: from zero to the thesis' 8000 in 0.4 s.

    Raises:
        ValueError: A value is out of range.
    """

    low: int = 3500
    high: int = 8000
    levels: int = 10
    overshoot: float = 0.15
    ramp: float = 20_000.0

    def __post_init__(self) -> None:
        if not (0 < self.low < self.high and self.levels >= 2 and self.overshoot >= 0.0 < self.ramp):
            raise ValueError(
                f"levels from {self.low} to {self.high} counts, {self.levels} of them, {self.overshoot:g} beyond:"
                " they have to rise from above 0, and be two at least"
            )
        if self.top > _LIMIT:
            raise ValueError(
                f"levels up to {self.high} counts and {100 * self.overshoot:g} % beyond are {self.top}: a target torque"
                f" holds {_LIMIT} at most"
            )

    @property
    def top(self) -> int:
        """The greatest torque that is commanded [counts]."""
        return round(self.high * (1.0 + self.overshoot))

    def ladder(self) -> list[int]:
        """The levels of a direction, rising [counts]."""
        span = self.high - self.low
        return [self.low + round(span * n / (self.levels - 1)) for n in range(self.levels)]

    def steps(self) -> list[Step]:
        """All levels in their order, both directions, each ending at zero."""
        steps = []
        for way in (1, -1):
            ladder = [way * level for level in self.ladder()]
            steps += [Step(level, rising=True) for level in ladder]
            if self.top > self.high:
                steps.append(Step(way * self.top, rising=True, measured=False))
            steps += [Step(level, rising=False) for level in reversed(ladder)]
            steps.append(Step(0, rising=False, measured=False))
        return steps


class HeldLevels:
    """Holds the levels on the bench."""

    def __init__(self, make_sensor: SensorMaker, schedule: Schedule, *, settle: float, patience: float) -> None:
        """Prepare.

        Args:
            make_sensor: Who tells the torques.
            schedule: The levels.
            settle: How long a level is held before it is read [s].
            patience: How long it is held at most while it is read [s].
        """
        self._make_sensor = make_sensor
        self._schedule = schedule
        self._settle_ns = round(settle * SECOND_NS)
        self._patience_ns = round(patience * SECOND_NS)
        self._sensor: TorqueSensor | None = None

    def open(self, conductor: Conductor) -> None:
        """Make the sensor ready."""
        conductor.say("preparing the sensor")
        self._sensor = self._make_sensor(conductor)
        self._sensor.open()

    def levels(self, conductor: Conductor, axis: int) -> list[LevelReading]:
        """Hold all levels of the schedule on one axis, the others at zero.

        Raises:
            LimitExceeded: The rotor moves, or anything else that was agreed on.
            NoReading: A level was held for as long as it may be.
            TorqueRigError: Sensor, drive or bus.
        """
        assert self._sensor is not None  # noqa: S101  (opened before)
        self._sensor.zero(axis)
        hand = _Hand(conductor, axis, self._schedule.ramp)
        readings = []
        for step in self._schedule.steps():
            words = f"axis {axis}, level {step.level}"
            conductor.say(words)
            conductor.notebook.begin(words)
            hand.go(step.level, self._settle_ns)
            if step.measured:
                readings.append(self._read(hand, step, words))
        return readings

    def close(self) -> None:
        """Let the sensor be quiet."""
        if self._sensor is not None:
            with suppress(TorqueRigError):  # of a bus that is gone the script has told
                self._sensor.close()

    def _read(self, hand: "_Hand", step: Step, words: str) -> LevelReading:
        sensor = self._sensor
        assert sensor is not None  # noqa: S101  (opened before)
        sensor.begin(step.level)
        until_ns = hand.now_ns() + self._patience_ns
        actuals: list[int] = []
        averaged: Averaged | None = None
        while averaged is None:
            if hand.now_ns() > until_ns:
                hand.cycle(0)
                raise NoReading(
                    f"{words}: there was no reading within {self._patience_ns / SECOND_NS:g} s, and the motor gives no"
                    " torque any more: begin again, with more --patience or fewer --levels"
                )
            actuals.append(hand.cycle(step.level))
            averaged = sensor.result()
        return LevelReading(
            step.level,
            step.rising,
            averaged.torque,
            averaged.spread,
            averaged.samples,
            sum(actuals) / len(actuals),
            averaged.overloaded,
        )


class _Hand:
    """Commands one axis in the drives' counts, cycle by cycle."""

    def __init__(self, conductor: Conductor, axis: int, ramp: float) -> None:
        self._conductor = conductor
        self._place = axis - 1
        self._step = ramp * conductor.period_ns / SECOND_NS
        self._level = 0.0
        self._due_ns = conductor.now_ns() + conductor.period_ns // 2

    def now_ns(self) -> int:
        """The bus clock [ns]."""
        return self._conductor.now_ns()

    def cycle(self, level: float) -> int:
        """One cycle at a level; what the drive says it gives [counts]."""
        conductor = self._conductor
        sample = conductor.sample_raw(self._due_ns)
        counts = [0] * conductor.axes
        counts[self._place] = round(level)
        conductor.command_raw(counts, conductor.now_ns())
        self._level = level
        self._due_ns = max(self._due_ns + conductor.period_ns, sample.at_ns + conductor.period_ns // 2)
        return int(sample.torques[self._place])

    def go(self, level: int, settle_ns: int) -> None:
        """Ramp to a level, and hold it until it has settled."""
        while abs(level - self._level) > self._step:
            self.cycle(self._level + (self._step if level > self._level else -self._step))
        until_ns = self._conductor.now_ns() + settle_ns
        self.cycle(level)
        while self._conductor.now_ns() < until_ns:
            self.cycle(level)


def read_levels(lines: Iterable[str], name: str) -> list[LevelReading]:
    """Levels out of comma-separated values, a level and its reading a line, in the order in which they were held.

    Empty lines, a headline and what follows a # are passed over. A level belongs to the way up unless the one before it
    was as great or greater in the same direction.

    Args:
        lines: The file's lines.
        name: The file's name, for messages.

    Returns:
        The levels.

    Raises:
        ValueError: A line is none; names file and line.
    """
    readings: list[LevelReading] = []
    for number, level, text in _rows(lines, name):
        if level == 0 or abs(level) > _LIMIT:
            raise ValueError(f"{name}:{number}: a level is a whole number of counts up to {_LIMIT}, and not 0: {level}")
        before = readings[-1].level if readings else 0
        rising = before * level <= 0 or abs(level) > abs(before)
        readings.append(LevelReading(level, rising, float(text), rounding(text), 1))
    if not readings:
        raise ValueError(f"{name}: no level is in it; a line is a level in counts and a reading in N·m, as 3500,0.142")
    return readings


def _rows(lines: Iterable[str], name: str) -> Iterator[tuple[int, int, str]]:
    """Line number, level, and reading as it is written, of each line that holds them."""
    first = True
    for number, fields in enumerate(csv.reader(line.partition("#")[0] for line in lines), start=1):
        if not any(field.strip() for field in fields):
            continue
        try:
            level, torque = (field.strip() for field in fields)
            row, is_finite = (number, int(level), torque), isfinite(float(torque))
        except ValueError:
            if first and not any(character.isdigit() for field in fields for character in field):
                first = False
                continue
            text = ",".join(fields)
            raise ValueError(
                f"{name}:{number}: {text!r} is no level in counts and reading in N·m, as 3500,0.142"
            ) from None
        if not is_finite:
            raise ValueError(f"{name}:{number}: a reading is a number of N·m, not {torque}")
        first = False
        yield row
