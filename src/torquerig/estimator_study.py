"""What each estimator of joint rates makes of the same angles, and of the loop that runs with it."""

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.configuration import Configuration
from torquerig.control.errors import LimitExceeded
from torquerig.control.estimators import NANOSECONDS_PER_SECOND, Estimator, load_estimators, make_estimator
from torquerig.control.log import LoopLog
from torquerig.control.tracking import motion_rows
from torquerig.driver.bus.url import LOCKSTEP
from torquerig.estimator_replay import Replay, replay_of
from torquerig.experiment import Watcher, run_experiment
from torquerig.records import RecordedRun, open_record

Floats = NDArray[np.float64]

_BATCH: Final = 100
_BATCHES: Final = 60
"""Batches of updates of which the quickest tells their cost: another process' work is in few of them."""


@dataclass(frozen=True, slots=True)
class LoopEffect:
    """A lockstep run with an estimator, over the motion's samples.

    Attributes:
        position_rmse_mm: By the simulator's own state [mm].
        velocity_rmse_m_s: From the estimated velocity, as in the thesis [m/s].
        rms_torque_nm: Root mean square of the motors' torques [N·m].
        torque_chatter_nm: How rough the commanded torques are; see `torque_chatter` [N·m].
        stopped: The limit that ended the run; empty for a whole one, else the numbers are NaN.
    """

    position_rmse_mm: float = math.nan
    velocity_rmse_m_s: float = math.nan
    rms_torque_nm: float = math.nan
    torque_chatter_nm: float = math.nan
    stopped: str = ""

    def as_json(self) -> dict[str, Any]:
        """The numbers, null for each of a run that was stopped, and what stopped it."""
        return {
            key: None if isinstance(value, float) and math.isnan(value) else value
            for key, value in asdict(self).items()
        }


@dataclass(frozen=True, slots=True, eq=False)
class Finding:
    """One estimator.

    Attributes:
        name: Its name.
        parameters: Its parameters.
        told_delay: The delay that it tells, at low frequency [periods].
        noise_gain: The noise gain that it tells.
        delay: How late it is in this motion: the shift at which it agrees best with the true rates [periods].
        noise: What the encoder's counts make of its estimates: standard deviation in the motion [rad/s].
        error: Estimated less true rates in the motion, root mean square over all joints [rad/s].
        update_us: Time of an update for three joints [µs], the best that was seen.
        estimates: Its estimates, shape (n, 3) [rad/s].
        loop: The loop that runs with it.
    """

    name: str
    parameters: Mapping[str, float]
    told_delay: float
    noise_gain: float
    delay: float
    noise: float
    error: float
    update_us: float
    estimates: Floats
    loop: LoopEffect

    def as_json(self) -> dict[str, Any]:
        """The finding as JSON holds it, without the estimates."""
        return {
            "name": self.name,
            "parameters": dict(self.parameters),
            "low_frequency_delay_periods": self.told_delay,
            "noise_gain": self.noise_gain,
            "delay_periods": self.delay,
            "noise_rad_s": self.noise,
            "error_rad_s": self.error,
            "update_us": self.update_us,
            "loop": self.loop.as_json(),
        }


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """All estimators on the same angles.

    Attributes:
        replay: The angles.
        findings: One for each estimator.
    """

    replay: Replay
    findings: tuple[Finding, ...]

    def as_json(self) -> dict[str, Any]:
        """The study as one JSON object."""
        return {
            "reference": self.replay.reference,
            "period_ns": self.replay.sampling.period_ns,
            "resolution_rad": self.replay.sampling.resolution,
            "samples": int(np.count_nonzero(self.replay.judged)),
            "estimators": [finding.as_json() for finding in self.findings],
        }


def study(configuration: Configuration, record: RecordedRun | None, watcher: Watcher) -> Study:
    """Replay angles to every estimator, and run the loop with every estimator, in lockstep.

    Args:
        configuration: What is run, whatever its bus, and the estimators' parameters.
        record: A run whose angles are replayed; None for a lockstep run of the configuration as it is.
        watcher: Is told what is being done.

    Returns:
        What came out.

    Raises:
        RecordError: The record has no cycle of a motion.
        ControlError: The configuration cannot be run with its own estimator.
    """
    replay = _simulated(configuration, watcher) if record is None else replay_of(record)
    return Study(replay, tuple(_findings(configuration, replay, watcher)))


def torque_chatter(log: LoopLog) -> float:
    """How rough the commanded torques are during the motion [N·m at the motor].

    Args:
        log: A run's log.

    Returns:
        Root mean square of their second difference from cycle to cycle over sqrt(6): the standard deviation of white
        noise that would be as rough; NaN for less than three cycles.
    """
    roughness = np.diff(log.tau[: log.rows][motion_rows(log)], n=2, axis=0)
    return math.sqrt(float(np.mean(roughness**2)) / 6) if len(roughness) else math.nan


def _simulated(configuration: Configuration, watcher: Watcher) -> Replay:
    """The angles of a lockstep run of the configuration as it is."""
    with TemporaryDirectory(prefix="torquerig-") as folder:
        place = Path(folder) / "run"
        run_experiment(_in_lockstep(configuration, configuration.rig.loop.estimator), record=place, watcher=watcher)
        return replay_of(open_record(place))


def _findings(configuration: Configuration, replay: Replay, watcher: Watcher) -> Iterator[Finding]:
    """One estimator after the other."""
    for name in load_estimators():
        estimator = make_estimator(name, 3, replay.sampling, **configuration.rig.estimators.get(name, {}))
        estimates = replay.estimates(estimator)
        yield Finding(
            name,
            estimator.values,
            estimator.delay,
            estimator.noise_gain,
            delay=replay.delay(estimates, most=1.5 * estimator.delay + 5),
            noise=replay.noise(estimator),
            error=replay.error(estimates),
            update_us=_update_us(estimator, replay),
            estimates=estimates,
            loop=_loop_effect(_in_lockstep(configuration, name), watcher),
        )


def _in_lockstep(configuration: Configuration, estimator: str) -> Configuration:
    """The configuration with another estimator, on the simulated bus."""
    rig = configuration.rig
    loop = rig.loop.model_copy(update={"estimator": estimator})
    bus = rig.bus.model_copy(update={"url": f"{LOCKSTEP}:"})
    return replace(configuration, rig=rig.model_copy(update={"loop": loop, "bus": bus}))


def _loop_effect(configuration: Configuration, watcher: Watcher) -> LoopEffect:
    """Run it."""
    try:
        outcome = run_experiment(configuration, watcher=watcher)
    except LimitExceeded as limit:
        return LoopEffect(stopped=str(limit))
    summary = outcome.summary
    true_error = summary.true_position_rmse_mm
    return LoopEffect(
        math.nan if true_error is None else true_error,
        summary.velocity_rmse_m_s,
        summary.rms_torque_nm,
        torque_chatter(outcome.log),
    )


def _update_us(estimator: Estimator, replay: Replay) -> float:
    """Time of an update [µs]: the quickest of some batches."""
    q, period_ns, best = replay.q[0], replay.sampling.period_ns, math.inf
    for _ in range(_BATCHES):
        estimator.reset()
        began = time.perf_counter_ns()
        for at_ns in range(0, _BATCH * period_ns, period_ns):
            estimator.update(q, at_ns)
        best = min(best, time.perf_counter_ns() - began)
    return best / _BATCH * 1e6 / NANOSECONDS_PER_SECOND
