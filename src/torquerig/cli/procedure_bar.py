"""The progress bar of a procedure: a short write when something changed, and none that has to wait."""

import os
import select
import sys
from types import TracebackType
from typing import Final, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn

STEPS: Final = 40
_CLEAR: Final = "\r\x1b[2K"


class ProcedureBar:
    """How far a procedure is, on standard error while that is a terminal; nothing otherwise.

    It is a `torquerig.calibration.procedure.Watcher`. All states of the bar are drawn before the procedure begins,
    because drawing one takes longer than a cycle may be late.
    """

    def __init__(self, *, quiet: bool) -> None:
        """Find out whether anybody watches, and draw.

        Args:
            quiet: Show nothing, terminal or not.
        """
        console = Console(stderr=True)
        self._shown = console.is_terminal and not quiet
        self._descriptor = sys.stderr.fileno() if self._shown else -1
        self._frames = [_draw(console, step) for step in range(STEPS + 1)] if self._shown else []
        self._last: tuple[int, str] | None = None

    def __enter__(self) -> Self:
        """Begin with an empty line."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Take the bar away, whatever happened."""
        if self._shown:
            os.write(self._descriptor, _CLEAR.encode())

    def advance(self, fraction: float, words: str) -> None:
        """Show how much is done, and what is being done now."""
        state = int(STEPS * min(max(fraction, 0.0), 1.0)), words
        if not self._shown or state == self._last:
            return
        _, writable, _ = select.select((), (self._descriptor,), (), 0)
        if writable:
            self._last = state
            os.write(self._descriptor, f"{self._frames[state[0]]} {words}".encode())


def _draw(console: Console, step: int) -> str:
    """The bar in one state."""
    bar = Progress(BarColumn(STEPS), TaskProgressColumn(), console=console)
    bar.add_task("", total=STEPS, completed=step)
    with console.capture() as capture:
        console.print(bar.get_renderable(), end="")
    return _CLEAR + capture.get().strip("\n ")
