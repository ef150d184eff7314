"""Real-time set-up, as far as the machine allows it: under load it decides whether cycles are on time.

Each step is best effort: done, or refused with the machine's reason, and never fatal. Python's garbage collector is
kept out by `torquerig.garbage`, and what that did is told here too.
"""

import ctypes
import gc
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from enum import Enum
from typing import Final, NamedTuple

PR_SET_TIMERSLACK: Final = 29  # linux/prctl.h
LEAST_SLACK_NS: Final = 1
USUAL_SLACK: Final = 0  # the thread's default again (prctl(2))
MCL_CURRENT: Final = 1  # bits/mman-linux.h
MCL_FUTURE: Final = 2
MCL_ONFAULT: Final = 4  # pages are locked when they are first used, not all that are mapped now


class Step(NamedTuple):
    """One step of the set-up.

    Attributes:
        name: What it is.
        done: Whether the machine did it.
        words: What holds now, or why it was refused.
    """

    name: str
    done: bool
    words: str


@dataclass(frozen=True, slots=True)
class RealTimeSetup:
    """How this thread runs; as text, what a person is told.

    Attributes:
        steps: What was asked for, in order; none for ordinary scheduling.
    """

    steps: tuple[Step, ...] = ()

    def __str__(self) -> str:
        """Say what was done, and what was refused and why."""
        done = ", ".join(step.words for step in self.steps if step.done) or "ordinary scheduling"
        refused = ", ".join(f"{step.name} ({step.words})" for step in self.steps if not step.done)
        return f"{done}; refused: {refused}" if refused else done


class Processor(Enum):
    """Which of the processors that a process may use a thread keeps to: two that talk to each other need one each."""

    FIRST = 0
    LAST = -1


@contextmanager
def real_time(priority: int, processor: Processor = Processor.LAST) -> Iterator[RealTimeSetup]:
    """Run what is inside in real time as far as that is allowed; it needs root, or capabilities or limits of its own.

    Args:
        priority: Of SCHED_FIFO, 1 to 99; 0 asks for nothing at all.
        processor: Which one to keep to.

    Yields:
        What was done, and what was refused.
    """
    if priority == 0:
        yield RealTimeSetup()
        return
    with ExitStack() as undo:
        yield RealTimeSetup(
            (
                _attempt(
                    "SCHED_FIFO (CAP_SYS_NICE or an rtprio limit allows it)",
                    f"SCHED_FIFO, priority {priority}",
                    lambda: _schedule(priority, undo),
                ),
                _attempt(
                    "memory lock (CAP_IPC_LOCK or a memlock limit allows it)", "memory locked", lambda: _lock(undo)
                ),
                _attempt("timer slack", f"timer slack {LEAST_SLACK_NS} ns", lambda: _sharpen(undo)),
                _attempt("affinity", f"kept to the {processor.name.lower()} processor", lambda: _pin(processor, undo)),
                _attempt("collector", "collector frozen", _see_frozen),
            )
        )


def _attempt(name: str, words: str, act: Callable[[], None]) -> Step:
    try:
        act()
    except OSError as error:
        return Step(name, done=False, words=error.strerror or str(error))
    return Step(name, done=True, words=words)


def _schedule(priority: int, undo: ExitStack) -> None:
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    undo.callback(os.sched_setscheduler, 0, policy, parameters)


def _lock(undo: ExitStack) -> None:
    """Keep every page that is used, now or later, in memory: a page fault from a disk costs many cycles."""
    library = ctypes.CDLL(None, use_errno=True)
    _checked(library.mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT))
    undo.callback(library.munlockall)


def _sharpen(undo: ExitStack) -> None:
    """Let sleeps end when they should: the kernel otherwise gathers wake-ups within 50 us."""
    library = ctypes.CDLL(None, use_errno=True)
    _checked(library.prctl(PR_SET_TIMERSLACK, LEAST_SLACK_NS))
    undo.callback(library.prctl, PR_SET_TIMERSLACK, USUAL_SLACK)


def _pin(processor: Processor, undo: ExitStack) -> None:
    """Keep to one processor, whose caches then stay warm.

    Only with SCHED_FIFO: a thread of ordinary scheduling would wait there for others while the next one stands idle.
    """
    allowed = os.sched_getaffinity(0)
    if len(allowed) == 1:
        raise OSError(0, "only one processor may be used")
    if os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK != os.SCHED_FIFO:
        raise OSError(0, "without SCHED_FIFO it would wait behind others there")
    os.sched_setaffinity(0, {sorted(allowed)[processor.value]})
    undo.callback(os.sched_setaffinity, 0, allowed)


def _see_frozen() -> None:
    """See that a collection would look at nothing that existed before."""
    if not gc.get_freeze_count():
        raise OSError(0, "whoever asked for real time has not frozen it")


def _checked(result: int) -> None:
    if result:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
