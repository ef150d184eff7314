"""What the application adds to a procedure: its options, how it is made of the configuration, its figure, the truth."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from torquerig.assembly import Rig, open_rig
from torquerig.buses import FrameLog
from torquerig.calibration.procedure import Procedure, Result
from torquerig.configuration import Configuration
from torquerig.driver.bus.interface import Tap
from torquerig.provenance import Drives


class Option(NamedTuple):
    """An option of one procedure only, beside those that all have (--axis, --bus, --config, --seed, ...).

    Attributes:
        name: As the command line has it, without the dashes: "repeats".
        kind: int, float, str, bool (a flag) or Path.
        default: Its value when it is not given.
        help: What it does, in a line, with the unit.
        metavar: What stands for the value in the help.
    """

    name: str
    kind: type
    default: Any
    help: str
    metavar: str | None = None


@dataclass(frozen=True, slots=True)
class Request:
    """What a person asks of a procedure.

    Attributes:
        axis: The one axis that is meant, from 1; None for all.
        options: Values of the procedure's own options by name, dashes as underscores.
    """

    axis: int | None = None
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes that are meant, from 1."""
        return (1, 2, 3) if self.axis is None else (self.axis,)


def nothing(_configuration: Configuration, _request: Request) -> Any:  # noqa: ANN401  (the procedure's own)
    """What was measured before, of a procedure that has to measure."""
    return None


def unknown(_configuration: Configuration, _request: Request) -> Mapping[str, Any]:
    """The truth of a procedure of which the simulator knows none."""
    return {}


@dataclass(frozen=True, slots=True)
class Offer:
    """A procedure as the application has it; a module of this package holds one as `OFFER`.

    Attributes:
        make: The procedure for a configuration and a request; ConfigurationError when they do not go together.
        draw: Draw a result into a PNG file: (result, title, path). Called also when the verdict is not OK.
        options: The procedure's own options.
        truth: What is true in the simulator, for `--json` and tests; asked in lockstep only.
        open_rig: Opens the bus, and what is simulated behind it.
        recorded: What was measured before and is only to be evaluated, as from a record: no bus is opened then; None
            to measure.
        drives: On which drives that was measured; None where nobody knows.
    """

    make: Callable[[Configuration, Request], Procedure[Any]]
    draw: Callable[[Result, str, Path], None]
    options: tuple[Option, ...] = ()
    truth: Callable[[Configuration, Request], Mapping[str, Any]] = unknown
    open_rig: Callable[[Configuration, Tap | FrameLog | None], AbstractContextManager[Rig]] = open_rig
    recorded: Callable[[Configuration, Request], Any] = nothing
    drives: Callable[[Configuration, Request], Drives | None] = nothing
