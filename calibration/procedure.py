"""What a calibration procedure is: what it announces, what it is given, and what it brings back.

A procedure is a pure fit (numbers in, numbers out, in a module of its own) and a script that moves and measures. The
script sees the machine only through a `Conductor` (calibration.conductor), which holds what was agreed with the person
at the machine; it reads no clock, no file and no configuration. docs/calibration.md tells how to write one.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol, TypeVar

from numpy.typing import NDArray

if TYPE_CHECKING:
    from torquerig.calibration.conductor import Conductor

Measured = TypeVar("Measured")

CONFIDENCE: Final = 0.95
"""Share of cases in which an `Estimate`'s interval is to hold the true value."""


class Start(Enum):
    """How the drives are handed to a procedure's script."""

    AS_FOUND = "as found"
    """Configured and disabled; what they need is the script's own affair (`group.home`, `group.enable`)."""
    ENABLED = "enabled"
    """Enabled at zero torque; their positions may refer to anything."""
    HOMED = "homed"
    """Homed where they were not, and enabled at zero torque: joint angles are those of the mechanism."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """What a person agrees to before anything moves; the conductor stops the drives at once beyond any of these.

    Attributes:
        torque: Greatest torque that is commanded [N·m at the motor].
        speed: Greatest joint rate [rad/s].
        travel: How far a joint may get from where it stood at the script's first sample [rad].
        duration: How long drives may be enabled in all [s].
    """

    torque: float
    speed: float
    travel: float
    duration: float


@dataclass(frozen=True, slots=True)
class Plan:
    """What is shown before anything moves, and all that `--dry-run` does.

    Attributes:
        title: What the procedure does, in a few words.
        before: What the person has to see to first, a sentence each ("Put the machine into the home fixture.").
        steps: What will happen, a sentence each, with its numbers.
        bounds: What will not be exceeded.
        lasts: How long the drives are expected to be enabled [s], for the progress; None: `bounds.duration`.
    """

    title: str
    before: tuple[str, ...]
    steps: tuple[str, ...]
    bounds: Bounds
    lasts: float | None = None


class Grade(Enum):
    """How far a result can be trusted; its value is the word in messages and JSON."""

    OK = "ok"
    SUSPICIOUS = "suspicious"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a result can be trusted.

    Attributes:
        grade: OK: it may be used. SUSPICIOUS: it may be right, see `reasons`. FAILED: it must not be used.
        reasons: Why, a sentence each with its numbers; may be empty when OK.
        advice: What to do, a sentence each; needed when FAILED.
    """

    grade: Grade = Grade.OK
    reasons: tuple[str, ...] = ()
    advice: tuple[str, ...] = ()

    @classmethod
    def of(cls, *, suspicions: "list[Doubt] | None" = None, failures: "list[Doubt] | None" = None) -> "Verdict":
        """FAILED if anything failed, else SUSPICIOUS if anything is suspicious, else OK; all that was found is told."""
        grade = Grade.FAILED if failures else Grade.SUSPICIOUS if suspicions else Grade.OK
        doubts = [*(failures or ()), *(suspicions or ())]
        advice = dict.fromkeys(doubt.advice for doubt in doubts if doubt.advice)
        return cls(grade, tuple(doubt.reason for doubt in doubts), tuple(advice))


class Doubt(NamedTuple):
    """Something that speaks against a result.

    Attributes:
        reason: What was found, a sentence with its numbers.
        advice: What to do about it, a sentence; empty where nothing is known.
    """

    reason: str
    advice: str = ""


class Estimate(NamedTuple):
    """A value that was measured, as the result's table shows it.

    Attributes:
        name: What it is, as "axis 1, positive".
        value: The value.
        low: Begin of its interval of confidence (`CONFIDENCE`); NaN where there is none.
        high: Its end.
        unit: The unit of all three, "1" for ratios and signs.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str


class Column(NamedTuple):
    """One number a row.

    Attributes:
        name: Its name.
        unit: Its unit, "1" for flags and ratios.
        values: Shape (rows,).
    """

    name: str
    unit: str
    values: NDArray[Any]


class Table(NamedTuple):
    """Raw data, written as NAME.parquet beside the calibration, each column with its unit.

    Attributes:
        name: The file's name without its ending: letters, digits and dashes.
        columns: The columns, all of one length.
    """

    name: str
    columns: tuple[Column, ...]


@dataclass(frozen=True, slots=True)
class Result:
    """What a procedure brings back.

    Attributes:
        verdict: Whether it can be trusted.
        estimates: The values with their intervals, in the order of the table.
        settings: What goes into calibration.toml, by dotted key of the configuration, as {"axes.1.sign": -1}; it must
            be one of `torquerig.calibrated.KEYS`. Nothing of it is written when the verdict is FAILED.
        facts: What `--json` prints of this procedure beside verdict, files and truth: what JSON can hold, no NaN.
        tables: Raw data beyond the cycles that the conductor keeps by itself.
        drawing: Whatever the procedure's figure is drawn from; the application's drawing function knows its type.
    """

    verdict: Verdict
    estimates: tuple[Estimate, ...] = ()
    settings: Mapping[str, object] = field(default_factory=dict)
    facts: Mapping[str, Any] = field(default_factory=dict)
    tables: tuple[Table, ...] = ()
    drawing: object = None


class Procedure(Protocol[Measured]):
    """A calibration procedure: an object that holds all its parameters, made by the application."""

    @property
    def name(self) -> str:
        """As the command line calls it."""
        ...

    @property
    def start(self) -> Start:
        """How the drives are to be handed over."""
        ...

    def plan(self) -> Plan:
        """What it will do, known before a bus is opened."""
        ...

    def measure(self, conductor: "Conductor") -> Measured:
        """Move and measure; what comes back is all that `evaluate` needs.

        Exceptions pass through: a limit, a drive's fault, Ctrl-C. The drives are brought to zero torque and disabled
        by whoever called this, whatever happens, and the old calibration stays as it is.

        Raises:
            LimitExceeded: A bound was met.
            TorqueRigError: A drive or the bus.
        """
        ...

    def evaluate(self, measured: Measured) -> Result:
        """Fit and judge, when the drives are disabled and the bus is closed: it may take its time."""
        ...


class Watcher(Protocol):
    """Who is told how far a procedure is."""

    def advance(self, fraction: float, words: str) -> None:
        """So much is done, 0 to 1, and this is being done now. Called between two cycles: it has to be quick."""
        ...


class Unwatched:
    """A watcher who does not care."""

    def advance(self, fraction: float, words: str) -> None:
        """Hear and forget."""
