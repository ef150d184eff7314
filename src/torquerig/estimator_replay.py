"""Joint angles of a run beside what the joints really did: what estimators of joint rates are judged by."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from torquerig.building import manipulator, sampling
from torquerig.control.estimators import Estimator, Sampling, make_estimator
from torquerig.control.smoother import smoothed_rates
from torquerig.control.tracking import motion_rows
from torquerig.device_sim.plant import TruthRows
from torquerig.driver.wire.frame import worst_case_bits
from torquerig.errors import RecordError
from torquerig.mechanism import Manipulator
from torquerig.records import RecordedRun
from torquerig.schema import Rig

Floats = NDArray[np.float64]

TRUTH: Final = "the simulator's truth"
SMOOTHER: Final = "filterpy's smoother, which knows the future too"
MOST_CYCLES: Final = 20_000
"""Of a record that are replayed: the smoother takes about a millisecond a cycle."""
SHIFT_STEP: Final = 0.25
"""Of the first, coarse search for a delay [periods]."""


@dataclass(frozen=True, slots=True, eq=False)
class Replay:
    """Joint angles as an encoder told them, and what the joints really did.

    Attributes:
        at_ns: When the samples were taken, shape (n,).
        q: Joint angles as measured, shape (n, 3) [rad].
        angles: Joint angles as they were, shape (n, 3) [rad]; None where nobody knows.
        rates: Joint rates as they were, shape (n, 3) [rad/s].
        judged: Which samples count: those of the motion, shape (n,).
        reference: Who says how it was: `TRUTH` or `SMOOTHER`.
        sampling: The nominal period and the angles' resolution.
    """

    at_ns: NDArray[np.int64]
    q: Floats
    angles: Floats | None
    rates: Floats
    judged: NDArray[np.bool_]
    reference: str
    sampling: Sampling

    def estimates(self, estimator: Estimator) -> Floats:
        """What an estimator says to the measured angles, sample by sample, shape (n, 3) [rad/s]."""
        return _fed(estimator, self.at_ns, self.q)

    def noise(self, estimator: Estimator) -> float:
        """What the encoder's counts make of its estimates: standard deviation in the motion [rad/s].

        An estimator is linear: what it says to the measured angles, less what it says to the true ones, is its answer
        to the difference. Where nobody knows the true angles, it is its noise gain times the noise of a count.
        """
        if self.angles is None:
            return estimator.noise_gain * self.sampling.quantisation / self.sampling.period
        answer = _fed(estimator, self.at_ns, self.q) - _fed(estimator, self.at_ns, self.angles)
        return float(np.std(answer[self.judged]))

    def error(self, estimates: Floats) -> float:
        """Estimated less true rates in the motion, root mean square over all joints [rad/s]."""
        return float(np.sqrt(np.mean((estimates - self.rates)[self.judged] ** 2)))

    def delay(self, estimates: Floats, most: float) -> float:
        """How late estimates are in the motion.

        Args:
            estimates: Joint rates, shape (n, 3) [rad/s].
            most: The greatest delay that is looked for [periods].

        Returns:
            The shift of the true rates at which the estimates differ least from them [periods].
        """
        periods = (self.at_ns - self.at_ns[0]) / self.sampling.period_ns
        true_rates = CubicSpline(periods, self.rates)
        when, wanted = periods[self.judged], estimates[self.judged]

        def misfit(shift: float) -> float:
            return float(np.mean((true_rates(when - shift) - wanted) ** 2))

        shifts = np.arange(-2.0, most, SHIFT_STEP)
        near = float(shifts[np.argmin([misfit(shift) for shift in shifts])])
        around = (near - SHIFT_STEP, near + SHIFT_STEP)
        return float(minimize_scalar(misfit, bounds=around, method="bounded").x)


def replay_of(record: RecordedRun) -> Replay:
    """The angles of a record, beside what the joints really did.

    Args:
        record: The record of a run.

    Returns:
        Every cycle that was not skipped, the first `MOST_CYCLES`. The truth is the simulator's, where the record has
        it, else what a smoother finds.

    Raises:
        RecordError: There is no cycle of a motion.
    """
    log, rig = record.cycles(), record.rig()
    kept = np.flatnonzero(np.isfinite(log.q[: log.rows, 0]))[:MOST_CYCLES]
    judged = motion_rows(log)[kept]
    if not judged.any():
        raise RecordError(f"{record.place} has no cycle of a motion among its first {len(kept)}: nothing to judge by")
    at_ns = (log.start_ns + log.due_ns[: log.rows] + log.lateness_ns[: log.rows])[kept]
    how, q = sampling(rig), log.q[kept]
    if record.truth is None:
        rates = smoothed_rates(at_ns, q, how, _jerk_noise(rig))
        return Replay(at_ns, q, None, rates, judged, SMOOTHER, how)
    # a drive latches its encoder when SYNC is complete
    latched = at_ns + round(worst_case_bits(0) * 1e9 / rig.bus.bitrate)
    angles, rates = _truth_at(record.truth, latched, manipulator(rig.model, rig.model))
    return Replay(at_ns, q, angles, rates, judged, TRUTH, how)


def _fed(estimator: Estimator, at_ns: NDArray[np.int64], angles: Floats) -> Floats:
    """The estimates of an estimator that begins anew, shape (n, 3) [rad/s]."""
    estimator.reset()
    rates = np.empty_like(angles)
    for k, at in enumerate(at_ns.tolist()):
        rates[k] = estimator.update(angles[k], at)
    return rates


def _truth_at(truth: TruthRows, instants_ns: NDArray[np.int64], model: Manipulator) -> tuple[Floats, Floats]:
    """True joint angles and rates at given instants, linear between the log's rows; the geometry is the model's."""

    def column(values: Floats) -> Floats:
        return np.interp(instants_ns, truth.at_ns, values)

    angles, positions, velocities = (
        np.column_stack([column(values) for values in quantity.T])
        for quantity in (truth.theta, truth.position, truth.velocity)
    )
    rates = [model.joint_rates(x, v)[:3] for x, v in zip(positions, velocities, strict=True)]
    return angles, np.array(rates)


def _jerk_noise(rig: Rig) -> float:
    """The jerk that the configuration expects of the joints [rad²/s⁵]."""
    given = rig.estimators.get("kalman", {})
    return make_estimator("kalman", 1, sampling(rig), **given).values["jerk_noise"]
