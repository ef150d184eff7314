"""One session of fuzzing a target, and what is told when it fails: a log to replay, as short as could be found."""

import shlex
import traceback
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final

from fuzz_devices import DeviceTarget
from fuzz_driver import DriverTarget
from fuzz_driver import replay as replay_driver
from fuzz_frames import pause_ns
from fuzz_log import Timed, shortest, to_candump
from fuzz_maker import FrameMaker
from fuzz_sdo import SdoTarget
from fuzz_source import Source

FRAMES: Final = 2_000  # of a session; then drives, driver and wire are new ones
_TRANSFERS: Final = 50  # of a session of the SDO machines
_PATIENCE: Final = 40  # replays to shorten a driver's log
_DEEPEST: Final = 4  # entries of a traceback that are told


@dataclass(frozen=True, slots=True)
class Failure:
    """A session that failed.

    Attributes:
        error: What happened, and where.
        log: The frames to replay.
        plan: What the driver did; empty where there was none.
    """

    error: str
    log: Sequence[Timed] = ()
    plan: Sequence[str] = ()

    @property
    def report(self) -> str:
        """The failure with its log in candump's format, and how to replay it."""
        plan = f" --plan {shlex.quote(' '.join(self.plan))}" if self.plan else ""
        how = f"# python tests/fuzz/long_run.py --replay FILE{plan}, FILE with these {len(self.log)} lines:"
        return "\n".join([self.error, *([how, to_candump(self.log)] if self.log else [])])


@dataclass(slots=True)
class Outcome:
    """What a session, or many of them, came to.

    Attributes:
        frames: Frames or messages that were given to the target.
        sessions: How many sessions.
        seen: What was refused, or which errors ended an action, by kind.
        failure: Why it failed, None when it did not.
    """

    frames: int = 0
    sessions: int = 0
    seen: Counter[str] = field(default_factory=Counter)
    failure: Failure | None = None

    def add(self, other: "Outcome") -> None:
        """Take another session in."""
        self.frames += other.frames
        self.sessions += other.sessions
        self.seen += other.seen
        self.failure = self.failure or other.failure


def fuzz_devices(source: Source) -> Outcome:
    """Say anything to the simulated drives."""
    target = DeviceTarget()
    maker = FrameMaker(source)
    failure = None
    try:
        while len(target.log) < FRAMES and not (target.choked or source.exhausted):
            pause = pause_ns(source)
            for number, frame in enumerate(maker.burst()):
                target.say(frame, 0 if number else pause)
        target.finish()
    except Exception as error:  # noqa: BLE001 - that there is none is what is tested
        failure = Failure(_told(error), shortest(target.log, _devices_fail))
    return Outcome(len(target.log), 1, Counter(target.refusals()), failure)


def fuzz_driver(source: Source) -> Outcome:
    """Let a driver work on a hostile wire."""
    target = DriverTarget(source)
    failure = None
    try:
        target.session()
    except Exception as error:  # noqa: BLE001 - as above
        failure = _shortened(Failure(_told(error), target.wire.log, target.plan))
    finally:
        target.driver.close()
    errors = Counter(sentence.partition(":")[0] for sentence in target.driver.errors)
    return Outcome(len(target.wire.log), 1, errors, failure)


def fuzz_sdo(source: Source) -> Outcome:
    """Let SDO clients and a server talk over a bad line."""
    target = SdoTarget(source)
    failure = None
    try:
        for _ in range(_TRANSFERS):
            target.session()
            if source.exhausted:
                break
    except Exception as error:  # noqa: BLE001 - as above
        failure = Failure(_told(error), target.log)
    return Outcome(target.messages, 1, target.outcomes, failure)


TARGETS: Final[Mapping[str, Callable[[Source], Outcome]]] = MappingProxyType(
    {"devices": fuzz_devices, "driver": fuzz_driver, "sdo": fuzz_sdo}
)


def play(log: Sequence[Timed], plan: Sequence[str]) -> str | None:
    """Replay a log to the drives, or with a plan to a driver; what went wrong."""
    try:
        if plan:
            replay_driver(log, plan)
        else:
            DeviceTarget().replay(log)
    except Exception as error:  # noqa: BLE001 - as above
        return _told(error)
    return None


def _devices_fail(log: Sequence[Timed]) -> bool:
    return play(log, ()) is not None


def _shortened(failure: Failure) -> Failure:
    """A driver's failure with only those frames that bring about an error of the same kind; all, if they do not."""

    def fails(log: Sequence[Timed]) -> bool:
        error = play(log, failure.plan)
        return error is not None and _kind(error) == _kind(failure.error)

    return replace(failure, log=shortest(failure.log, fails, _PATIENCE)) if fails(failure.log) else failure


def _kind(error: str) -> str:
    return error.splitlines()[-1].partition(":")[0]


def _told(error: Exception) -> str:
    lines = traceback.format_exception(type(error), error, error.__traceback__, limit=-_DEEPEST)
    return "".join(lines).rstrip()
