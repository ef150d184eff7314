"""A progress bar that costs the control loop nothing: every state of it is drawn before the loop starts.

rich's own live display redraws in a thread, and a second busy thread delays a cycle by 5 ms and more.
"""

import os
import select
import sys
from types import TracebackType
from typing import Final, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

STEPS: Final = 40
_CLEAR: Final = "\r\x1b[2K"


class ProgressBar:
    """What a run is doing, on standard error while that is a terminal; nothing otherwise.

    It is a `torquerig.experiment.Watcher`.
    """

    def __init__(self, *, quiet: bool) -> None:
        """Find out whether anybody watches.

        Args:
            quiet: Show nothing, terminal or not.
        """
        self._console = Console(stderr=True)
        self._shown = self._console.is_terminal and not quiet
        self._descriptor = sys.stderr.fileno() if self._shown else -1
        self._frames: list[bytes] = []
        self._step = -1
        self._cycles = 1

    def __enter__(self) -> Self:
        """Begin with an empty line."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Take the bar away, whatever happened."""
        if self._shown:
            self._console.file.write(_CLEAR)
            self._console.file.flush()

    def phase(self, words: str) -> None:
        """Tell what is being done now."""
        if self._shown:
            self._console.file.write(f"{_CLEAR}{words} ...")
            self._console.file.flush()

    def prepare(self, words: str, cycles: int) -> None:
        """Draw the bar in all its states, before the loop starts.

        Args:
            words: What is being done.
            cycles: How many cycles there are in all.
        """
        self._cycles = max(cycles, 1)
        self._step = -1
        if self._shown:
            self._frames = [self._draw(words, step) for step in range(STEPS + 1)]

    def cycles_done(self, done: int) -> None:
        """Show how many cycles are done: one short write, and none when the terminal does not take it at once."""
        step = done * STEPS // self._cycles
        if not self._shown or step == self._step:
            return
        self._step = step
        _, writable, _ = select.select((), (self._descriptor,), (), 0)
        if writable:
            os.write(self._descriptor, self._frames[min(step, STEPS)])

    def _draw(self, words: str, step: int) -> bytes:
        """The bar in one state."""
        bar = Progress(TextColumn("{task.description}"), BarColumn(STEPS), TaskProgressColumn(), console=self._console)
        bar.add_task(words, total=STEPS, completed=step)
        with self._console.capture() as capture:
            self._console.print(bar.get_renderable(), end="")
        return (_CLEAR + capture.get().strip("\n")).encode()
