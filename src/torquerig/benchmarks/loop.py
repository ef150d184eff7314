"""The loop in real time: two processes over a bus, rate by rate; and cyclictest beside it where that is installed."""

import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.configuration import Configuration, load_configuration
from torquerig.control.errors import ControlError
from torquerig.control.log import LoopLog
from torquerig.control.tracking import overruns
from torquerig.driver.errors import TorqueRigError
from torquerig.errors import RigError
from torquerig.experiment import run_experiment

RATES_HZ: Final = (250.0, 500.0, 1000.0, 2000.0, 4000.0)
CHECKED_HZ: Final = 1000.0
"""The highest of them that a bus of 1 Mbit/s carries, and so the configuration allows; the others are set past it."""
PATIENCE_S: Final = 1.0
"""What watchdogs wait for a stalled process: a stall is to be counted as late cycles, not to end the run."""
WITHOUT_LIMIT: Final = ("joint_speed", "position_error", "torque_stop")
NO_LIMIT: Final = 1e9
"""A sample that came late is to be counted too; what its joint rates are taken for does not matter to a simulator."""
ENDING_S: Final = 10.0
CYCLICTEST: Final = "cyclictest"
SAME_PRIORITY: Final = 10  # `loop.fifo_priority` of the shipped configuration


@dataclass(frozen=True, slots=True)
class Times:
    """A distribution [us]."""

    p50: float
    p99: float
    p999: float
    max: float

    @classmethod
    def of(cls, ns: NDArray[np.int64]) -> "Times | None":
        """The distribution of times [ns]; None of none."""
        if len(ns) == 0:
            return None
        return cls(*(float(value) / 1000.0 for value in np.percentile(ns, (50, 99, 99.9, 100))))


@dataclass(frozen=True, slots=True)
class TimerTimes:
    """What cyclictest tells [us]."""

    least: float
    mean: float
    max: float


@dataclass(frozen=True, slots=True)
class RateRow:
    """How the loop did at one rate.

    Attributes:
        rate_hz: Cycles a second.
        cycles: Cycles that were due; of a run that was stopped those that are known to be done.
        overruns: Of them, those skipped, or not done when the next was due; None if the run was stopped.
        incomplete: Samples that lacked a drive; likewise.
        latency_us: From SYNC to the last RPDO; None if no cycle ran.
        lateness_us: SYNC after it was due.
        stopped: What ended the run early; None for nothing.
        cyclictest_us: Lateness of a bare timer at this rate, by cyclictest: p50 is its mean; None without it.
    """

    rate_hz: float
    cycles: int
    overruns: int | None
    incomplete: int | None
    latency_us: Times | None
    lateness_us: Times | None
    stopped: str | None
    cyclictest_us: TimerTimes | None


@dataclass(frozen=True, slots=True)
class LoopTimes:
    """What the benchmark found.

    Attributes:
        bus: Where.
        seconds: Of holding at each rate [s].
        scheduling: How the loop ran, in words.
        rates: A row a rate.
    """

    bus: str
    seconds: float
    scheduling: str
    rates: tuple[RateRow, ...]

    def as_json(self) -> dict[str, Any]:
        """The figures."""
        return asdict(self)


class _Count:
    """Watches a run, and knows how far it came."""

    def __init__(self) -> None:
        self.done = 0

    def phase(self, words: str) -> None:
        """Something new begins."""

    def prepare(self, words: str, cycles: int) -> None:
        """The loop will begin."""

    def cycles_done(self, done: int) -> None:
        """So many cycles are done."""
        self.done = done


def measure(
    url: str | None = None,
    *,
    seconds: float,
    rates_hz: Sequence[float] = RATES_HZ,
    tell: Callable[[str], None] = lambda _words: None,
) -> LoopTimes:
    """Run test motion 1 and hold at each rate, the simulated drives in a process of their own.

    All the loop does is done while it holds, and a machine at rest bears that the processor is taken away for a while.

    Args:
        url: The bus; None for a unix bus in a temporary folder.
        seconds: Of holding at each rate [s].
        rates_hz: The rates.
        tell: Called with what is being done.

    Raises:
        BusUrlError, BusError: The bus cannot be opened.
        RigError: The simulated drives did not start.
    """
    with tempfile.TemporaryDirectory(prefix="torquerig-") as folder:
        bus = url or f"unix:{folder}/bus"
        rows, scheduling = [], ""
        for rate_hz in rates_hz:
            tell(f"{rate_hz:g} Hz, {seconds:g} s")
            with _simulated_drives(bus, Path(folder)):
                row, words = _run(configuration_at(bus, rate_hz, seconds))
                scheduling = words or scheduling
            rows.append(replace(row, cyclictest_us=cyclictest(rate_hz, seconds)))
        return LoopTimes(bus=url or "unix:", seconds=seconds, scheduling=scheduling, rates=tuple(rows))


def configuration_at(bus: str, rate_hz: float, seconds: float) -> Configuration:
    """The configuration of a run, also at rates that no CAN of 1 Mbit/s carries.

    Args:
        bus: Its URL.
        rate_hz: Cycles a second.
        seconds: Of standing still after the motion [s].
    """
    options: dict[str, object] = {
        "bus.url": bus,
        "loop.rate_hz": min(rate_hz, CHECKED_HZ),
        "loop.command_after": "computed",
        "approach.hold_after": seconds,
        "master.heartbeat_limit": PATIENCE_S,
    }
    checked = load_configuration(None, options, origin="benchmark")
    loop = checked.rig.loop.model_copy(update={"rate_hz": rate_hz})
    master = checked.rig.master.model_copy(update={"watchdog_periods": round(PATIENCE_S * rate_hz)})
    limits = checked.rig.limits.model_copy(update=dict.fromkeys(WITHOUT_LIMIT, NO_LIMIT))
    return replace(checked, rig=checked.rig.model_copy(update={"loop": loop, "master": master, "limits": limits}))


def cyclictest(rate_hz: float, seconds: float) -> TimerTimes | None:
    """How late a bare timer is, by cyclictest; None where it is not installed or not allowed.

    Args:
        rate_hz: Its rate.
        seconds: How long [s].
    """
    program = shutil.which(CYCLICTEST)
    if program is None:
        return None
    interval = ["-i", f"{round(1e6 / rate_hz)}", "-l", f"{max(1, round(seconds * rate_hz))}"]
    done = subprocess.run(  # noqa: S603  (a program that the user has installed)
        [program, "-q", "-m", "-p", f"{SAME_PRIORITY}", *interval], capture_output=True, text=True, check=False
    )
    found = re.search(r"Min:\s*(\d+).*Avg:\s*(\d+)\s*Max:\s*(\d+)", done.stdout)
    return None if found is None else TimerTimes(*(float(number) for number in found.groups()))


def _run(configuration: Configuration) -> tuple[RateRow, str]:
    """One rate; and how the loop was scheduled."""
    count, rate_hz = _Count(), configuration.rig.loop.rate_hz
    try:
        outcome = run_experiment(configuration, watcher=count)
    except (TorqueRigError, ControlError) as error:
        return RateRow(rate_hz, count.done, None, None, None, None, str(error), None), ""
    scheduling = next((note for note in outcome.notes if note.startswith("The loop ran")), "")
    return row_of(rate_hz, outcome.log), scheduling


def row_of(rate_hz: float, log: LoopLog) -> RateRow:
    """A row of a run's log; cyclictest's part is left open."""
    ran = ~log.skipped[: log.rows]
    lateness = log.lateness_ns[: log.rows][ran]
    return RateRow(
        rate_hz=rate_hz,
        cycles=log.rows,
        overruns=overruns(log),
        incomplete=int(np.count_nonzero(~log.complete[: log.rows] & ran)),
        latency_us=Times.of(log.command_ns[: log.rows][ran] - lateness),
        lateness_us=Times.of(lateness),
        stopped=None,
        cyclictest_us=None,
    )


@contextmanager
def _simulated_drives(bus: str, folder: Path) -> Iterator[None]:
    """`torquerig sim` as a process, until the end."""
    with (folder / "complaints").open("w+b") as complaints:
        process = subprocess.Popen(  # noqa: S603  (this interpreter, and this package)
            [sys.executable, "-P", "-m", "torquerig", "sim", "--bus", bus],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=complaints,
        )
        try:
            assert process.stdout is not None  # noqa: S101  (it was asked for)
            if not process.stdout.readline():
                complaints.seek(0)
                words = complaints.read().decode(errors="replace").strip()
                raise RigError(words.removeprefix("torquerig: ") or "the simulated drives did not start")
            yield
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.communicate(timeout=ENDING_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()
