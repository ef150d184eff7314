"""`Place`: where a command can find CAN links of its own, and how its first process is started there."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, Protocol

HERE: Final = Path(__file__).resolve().parent

# the interpreter itself, not a virtual environment's link to it, and nothing of the user's: the start is quick
INTERPRETER: Final = (str(Path(sys.executable).resolve()), "-EsSB")


class NoVcanError(Exception):
    """There is no such place here; the message is one line and says what to install."""


class Place(Protocol):
    """A kernel with vcan, and the road into it."""

    @property
    def modules(self) -> Sequence[str] | None:
        """Kernel modules that a freshly booted kernel has to load; None where the kernel is the host's."""

    def prepare(self, folder: Path) -> Mapping[str, str]:
        """Makes in the folder what the start needs; returns additional environment variables of the start."""

    def command_line(self, folder: Path) -> Sequence[str]:
        """Returns the command that runs the guest's first process on the folder."""

    def why_not_started(self, console: str) -> str:
        """Returns in one line why the first process was never reached, judged by what the start has printed."""


def first_process(folder: Path) -> tuple[str, ...]:
    """Returns the command line of the guest's first process."""
    return (*INTERPRETER, str(HERE / "guest.py"), str(folder))


def last_line(text: str) -> str:
    """Returns the last line that says anything."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "nothing was printed"
