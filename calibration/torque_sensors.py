"""Who tells the torque of a locked rotor while a level is held: a transducer on the bus, or a person with a display."""

from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from math import isfinite, nan, sqrt
from typing import Final, Protocol

import numpy as np

from torquerig.calibration.conductor import SECOND_NS, Conductor
from torquerig.calibration.errors import NoReading
from torquerig.driver.errors import DriveError
from torquerig.driver.master.transducer import Reading, Transducer, TransducerSettings
from torquerig.driver.master.watch import describe_code
from torquerig.driver.wire.measuring import AiStatus

_GLANCE: Final = 0.02  # [s] between two looks at what was typed; our choice
_OVERLOAD: Final = AiStatus.POSITIVE_OVERLOAD | AiStatus.NEGATIVE_OVERLOAD


@dataclass(frozen=True, slots=True)
class Averaged:
    """What a level came to.

    Attributes:
        torque: Mean [N·m].
        spread: Standard deviation of single readings [N·m]; of one that was written down, that of its rounding.
        samples: How many readings.
        overloaded: Whether the sensor said that it was.
    """

    torque: float
    spread: float
    samples: int
    overloaded: bool


class TorqueSensor(Protocol):
    """Tells torques; all its methods are called between two cycles and have to be quick, but `open` and `zero`."""

    def open(self) -> None:
        """Make it ready; the drives give no torque meanwhile."""
        ...

    def zero(self, axis: int) -> None:
        """The axis (from 1) that comes next gives no torque now."""
        ...

    def begin(self, level: int) -> None:
        """A level [counts] has settled: what is read from now on belongs to it."""
        ...

    def result(self) -> Averaged | None:
        """What the level came to, once there are enough readings; None before."""
        ...

    def close(self) -> None:
        """No more readings are needed."""
        ...


SensorMaker = Callable[[Conductor], TorqueSensor]


class WireSensor:
    """A transducer on the drives' bus; satisfies `TorqueSensor`."""

    def __init__(self, conductor: Conductor, settings: TransducerSettings, samples: int) -> None:
        """Prepare.

        Args:
            conductor: Whose bus it is on.
            settings: Which transducer.
            samples: Readings to average a level over.
        """
        self._transducer = Transducer(conductor.group.session, settings)
        self._samples = samples
        self._wait = conductor.group.wait
        self._period = conductor.period_ns / SECOND_NS
        self._zero = 0.0
        self._readings: list[Reading] = []

    def open(self) -> None:
        """Configure it; see `Transducer.open`."""
        self._transducer.open()

    def zero(self, axis: int) -> None:  # noqa: ARG002  (it sits where it was put)
        """Zero it (see `Transducer.zero`), and take the mean of what it then shows for zero.

        Its own zero is that of a single conversion, with its noise.
        """
        self._require_valid(self._transducer.latest())
        self._transducer.zero()
        self._zero = 0.0
        self.begin(0)
        while (shown := self.result()) is None:
            self._wait(self._period)
        self._zero = shown.torque

    def begin(self, level: int) -> None:  # noqa: ARG002  (it is asked about nothing)
        """Forget what came before."""
        self._transducer.take()
        self._readings = []

    def result(self) -> Averaged | None:
        """The mean of so many readings.

        Raises:
            NoAnswer: It has sent none for a while.
            DriveError: It says that its value is not valid.
        """
        for reading in self._transducer.take():
            self._require_valid(reading)
            self._readings.append(reading)
        if len(self._readings) < self._samples:
            return None
        torques = np.array([reading.torque for reading in self._readings])
        spread = float(torques.std(ddof=1)) if len(torques) > 1 else nan
        overloaded = any(reading.status & _OVERLOAD for reading in self._readings)
        return Averaged(float(torques.mean()) - self._zero, spread, len(torques), overloaded)

    def close(self) -> None:
        """Let it be quiet."""
        self._transducer.close()

    def _require_valid(self, reading: Reading) -> None:
        if reading.status & AiStatus.NOT_VALID:
            emergency = self._transducer.emergency
            told = f", and it tells {describe_code(emergency.code)}" if emergency else ""
            raise DriveError(
                f"transducer {self._transducer.node_id} says that its value is not valid (6150 is"
                f" {int(reading.status):#04x}){told}: its bridge is disconnected or broken"
            )


class Typist(Protocol):
    """A person at a keyboard."""

    def ask(self, question: str) -> None:
        """Show a question; what was typed before it is no answer."""
        ...

    def answer(self) -> str | None:
        """The next line that was typed, None while there is none; it must not wait where time is real."""
        ...


class TypedSensor:
    """A person who types what a display shows; satisfies `TorqueSensor`."""

    def __init__(self, conductor: Conductor, typist: Typist, *, patience: float, sign: int = 1) -> None:
        """Prepare.

        Args:
            conductor: Whose drives give no torque while the display is zeroed.
            typist: Who is asked.
            patience: How long that may take [s].
            sign: 1 if the display is positive for positive counts, else -1.
        """
        self._conductor = conductor
        self._typist = typist
        self._patience_ns = round(patience * SECOND_NS)
        self._sign = sign
        self._level = 0

    def open(self) -> None:
        """Nothing is to be made ready."""

    def zero(self, axis: int) -> None:
        """Ask for the zero to be set, and wait until it is; the drives hold no torque.

        Raises:
            NoReading: Nobody says that it is.
        """
        until_ns = self._conductor.now_ns() + self._patience_ns
        self._typist.ask(f"Axis {axis} gives no torque now: set the display to zero, then press Enter.")
        while self._typist.answer() is None:
            if self._conductor.now_ns() > until_ns:
                raise NoReading(
                    f"axis {axis}: nobody has set the display to zero within {self._patience_ns / SECOND_NS:g} s"
                )
            self._conductor.group.wait(_GLANCE)

    def begin(self, level: int) -> None:
        """Ask for a reading."""
        self._level = level
        self._typist.ask(f"Level {level} counts: what does the display show [N·m]?")

    def result(self) -> Averaged | None:
        """What was typed, if it is a number."""
        line = self._typist.answer()
        if line is None:
            return None
        line = line.strip().replace(",", ".")
        try:
            torque = float(line)
        except ValueError:
            torque = nan
        if not isfinite(torque):
            self._typist.ask(f"{line!r} is no number of N·m, such as 0.215. Level {self._level} counts: again?")
            return None
        return Averaged(self._sign * torque, rounding(line), 1, overloaded=False)

    def close(self) -> None:
        """Nothing is to be ended."""


def rounding(text: str) -> float:
    """The standard deviation that writing a number down with so many decimals leaves [its unit].

    Args:
        text: A finite number as it was written: "0.215" is somewhere between 0.2145 and 0.2155.
    """
    exponent = Decimal(text).as_tuple().exponent
    assert isinstance(exponent, int)  # noqa: S101  (a finite number has one)
    return 10.0**exponent / sqrt(12.0)  # of a uniform distribution one step wide
