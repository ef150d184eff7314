"""SIGINT and SIGTERM as one exception, raised once: what it unwinds is then left in peace to end in order."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)
_AGAIN_S: Final = 0.01  # until a dropped exception is raised again, by SIGALRM


class Stopped(KeyboardInterrupt):
    """Somebody asked the process to stop.

    It is a KeyboardInterrupt, so that no `except Exception` on its way takes it for an error.

    Attributes:
        signal: By which signal.
    """

    def __init__(self, number: int) -> None:
        """Keep the signal."""
        self.signal: Final = signal.Signals(number)
        super().__init__(f"stopped by {self.signal.name}")

    @property
    def exit_code(self) -> int:
        """What a shell expects of a process that ended by this signal: 128 + its number."""
        return 128 + self.signal


@contextmanager
def orderly_stop() -> Iterator[None]:
    """Turn the first SIGINT or SIGTERM into `Stopped`; further ones do not disturb the way out.

    Python drops an exception that is raised while an object is finalised: then it is raised again, a moment later. To
    be entered in the main thread only, as signal handlers are.

    Yields:
        Nothing.

    Raises:
        Stopped: In the code inside, when a signal comes.
    """
    before = {number: signal.getsignal(number) for number in (*_SIGNALS, signal.SIGALRM)}
    hook = sys.unraisablehook
    asked: list[int] = []

    def stop(number: int, _frame: FrameType | None) -> None:
        for each in _SIGNALS:
            signal.signal(each, signal.SIG_IGN)
        asked.append(number)
        raise Stopped(asked[0])

    def drop(dropped: "sys.UnraisableHookArgs") -> None:
        if isinstance(dropped.exc_value, Stopped):
            signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        else:
            hook(dropped)

    for number in before:
        signal.signal(number, stop)
    sys.unraisablehook = drop
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        sys.unraisablehook = hook
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Keep SIGINT and SIGTERM waiting until what is inside is done, such as the writing of a file.

    Yields:
        Nothing.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
