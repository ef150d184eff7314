"""Which error ends a command with which exit code."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Any, Final

import click

from torquerig.stopping import Stopped

DONE: Final = 0
INTERNAL: Final = 1
USAGE: Final = 2
BUS: Final = 3
MACHINE: Final = 4

EXIT_CODES: Final = """\b
Exit codes:
  0    done
  1    an error of the program itself
  2    bad usage: option, configuration, file or bus URL
  3    the bus: it cannot be used, a drive does not answer, or another master speaks
  4    the machine: a drive in fault or refusing, a limit, a pose out of reach
  130  stopped by SIGINT (Ctrl-C), in order
  143  stopped by SIGTERM, in order
"""


class Failure(click.ClickException):
    """A command's end that is told in one sentence."""

    def __init__(self, sentence: str, exit_code: int) -> None:
        """Keep the sentence and the exit code."""
        super().__init__(sentence)
        self.exit_code = exit_code  # type: ignore[misc]  # click reads it from the instance, whatever its stub says

    def show(self, file: IO[Any] | None = None) -> None:
        """Print the sentence on standard error."""
        show(self, file)


def show(error: click.ClickException, file: IO[Any] | None = None) -> None:
    """Print an error as one sentence on standard error, or on the file given."""
    click.echo(f"torquerig: {error.format_message()}", file=file, err=True)


@contextmanager
def told() -> Iterator[None]:
    """Turn the errors that a person can do something about into `Failure`s; a bug stays what it is.

    Yields:
        Nothing.

    Raises:
        Failure: With the error's sentence and the exit code of its kind.
    """
    try:
        yield
    except Stopped as stop:
        raise Failure(sentence_of(stop), stop.exit_code) from stop
    except Exception as error:
        code = _exit_code(error)
        if code == INTERNAL:
            raise
        raise Failure(sentence_of(error), code) from error


def sentence_of(error: BaseException) -> str:
    """What an error says, and what went wrong on the way out, such as drives that nobody saw disabled."""
    return "; ".join([str(error), *getattr(error, "__notes__", ())])


def _exit_code(error: Exception) -> int:
    """The exit code of an error's kind. The trees are looked up only now, because --help must not wait for them."""
    from torquerig import errors as application  # noqa: PLC0415
    from torquerig import mechanism  # noqa: PLC0415
    from torquerig.calibration import errors as calibration  # noqa: PLC0415
    from torquerig.control import errors as control  # noqa: PLC0415
    from torquerig.driver import errors as driver  # noqa: PLC0415

    kinds: tuple[tuple[type[Exception], int], ...] = (
        (control.LimitExceeded, MACHINE),
        (control.ControlError, USAGE),
        (calibration.CalibrationError, MACHINE),
        (mechanism.MechanismError, MACHINE),
        (driver.BusUrlError, USAGE),
        (driver.EdsError, USAGE),
        (driver.ProfileError, USAGE),
        (driver.BusError, BUS),
        (driver.NoAnswer, BUS),
        (driver.SecondMaster, BUS),
        (driver.TorqueRigError, MACHINE),
        (application.ApplicationError, USAGE),
    )
    return next((code for kind, code in kinds if isinstance(error, kind)), INTERNAL)
