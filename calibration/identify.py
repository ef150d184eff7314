"""The identification procedure: drive an excitation, then another one, fit the first and foretell the second."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from torquerig.calibration import differentiation
from torquerig.calibration.conductor import Conductor
from torquerig.calibration.driving import follow, lasts, motion_rows
from torquerig.calibration.excitation import FourierMotion, Worth, worth
from torquerig.calibration.identification import (
    LOPSIDED,
    UNKNOWNS,
    WAYS,
    Identified,
    Recording,
    foretold,
    identify,
)
from torquerig.calibration.procedure import Bounds, Doubt, Estimate, Plan, Result, Start, Verdict
from torquerig.calibration.regressor import Array
from torquerig.control.log import LoopLog
from torquerig.control.loop import Controller
from torquerig.control.reference import ReferenceTable

UNITS: Final = {"I1": "kg·m²", "K1": "N·m·s/rad", "K2": "N·m·s/rad", "Fc": "N·m", **dict.fromkeys(LOPSIDED, "1")}
SETTINGS: Final = {
    "I1": "model.actuator_inertia",
    "K1": "model.active_viscous",
    "K2": "model.passive_viscous",
    "Fc": "model.active_coulomb",
}
_TRAVEL: Final = 0.3  # [rad] that a joint may get beyond what the motions ask for: 20 mm at the end-effector
_SPEED: Final = 2.0  # times the joint rates that the motions ask for
_PATIENCE: Final = 1.5  # times the duration that is planned
_SETUP: Final = 10.0  # [s] for the ways to the motions' starts, 0.4 m at 0.05 m/s and no less than any workspace
_UNFORETOLD: Final = 0.05  # of the torque: a validation that misses more is suspicious; the simulator's is 0.002
_UNKNOWN: Final = 0.05  # of a value: a wider interval is suspicious; the simulator's are 0.003
_CLUMSY: Final = 20.0  # condition number, five times the shipped excitation's
_SATURATED: Final = (
    0.02,
    0.05,
)  # [N·m] and share by which actual torques may miss the command before the axis counts as saturated


class Driven(NamedTuple):
    """A motion that was driven.

    Attributes:
        motion: What was asked for.
        log: What happened.
    """

    motion: FourierMotion
    log: LoopLog


class Drawing(NamedTuple):
    """What the figure shows.

    Attributes:
        ways: What each way found, in the order of `WAYS`.
        path: Where the excitation led, shape (n, 2) [m].
        time: Of the validation's samples that were foretold [s].
        measured: Their motor torques, less what the links take, shape (m, 3) [N·m at the motor].
        foretold: What the recommended values foretell of them.
        thesis: What the thesis' values foretell of them.
    """

    ways: dict[str, Identified]
    path: Array
    time: Array
    measured: Array
    foretold: Array
    thesis: Array


@dataclass(frozen=True, slots=True)
class IdentifyProcedure:
    """Finds I1, K1, K2 and Fc, three ways side by side.

    Attributes:
        controller: What drives the machine; its model's I1, K1, K2 are only what is believed before.
        fit: The motion that is fitted, and its table.
        validation: The motion that is foretold, and its table.
        torque: Greatest torque [N·m at the motor].
        delay: What passes from sample to torque at each axis beyond the time from SYNC's leaving to the command's,
            shape (3,) [s].
    """

    controller: Controller
    fit: tuple[FourierMotion, ReferenceTable]
    validation: tuple[FourierMotion, ReferenceTable]
    torque: float
    delay: Array
    name: str = "identify"
    start: Start = Start.HOMED

    def plan(self) -> Plan:
        """Two motions."""
        model = self.controller.model
        both = [worth(model, motion, window=differentiation.WINDOW) for motion, _ in (self.fit, self.validation)]
        tables = [table for _, table in (self.fit, self.validation)]
        home = np.mean([table.q[0] for table in tables], axis=0)
        travel = max(float(np.max(np.abs(table.q - home))) for table in tables)
        duration = sum(lasts(table) for table in tables)
        return Plan(
            "Identify: inertia and friction of the actuators, friction of the elbows",
            (
                "Torque scale (calibrate torque) and latency first: what they are off by, the result is off by.",
                "The machine stands free, in its home fixture's pose with the fixture taken off, unless it was homed.",
            ),
            (
                _sentence("Drive an excitation that is fitted", self.fit[0], both[0]),
                _sentence("Drive another one that is only foretold", self.validation[0], both[1]),
            ),
            Bounds(
                torque=self.torque,
                speed=_SPEED * max(each.joint_speed for each in both),
                travel=2 * travel + _TRAVEL,
                duration=math.ceil(_PATIENCE * duration + _SETUP),
            ),
            lasts=duration,
        )

    def measure(self, conductor: Conductor) -> tuple[Driven, Driven]:
        """Both motions, one after the other."""
        driven = []
        for words, (motion, table) in (("the excitation", self.fit), ("the validation", self.validation)):
            driven.append(Driven(motion, follow(conductor, self.controller, table, words)))
        return driven[0], driven[1]

    def evaluate(self, measured: tuple[Driven, Driven]) -> Result:
        """Three fits of the first motion, judged by the second."""
        recording, other = (recorded(driven.log, self.delay) for driven in measured)
        model = self.controller.model
        try:
            ways = {way: identify(model, way, recording, other) for way in WAYS}
        except ValueError as error:
            advice = "Drive faster joints for longer: another --design, more --periods."
            return Result(Verdict.of(failures=[Doubt(str(error), advice)]))
        best = ways["recommended"]
        seen = foretold(model, best.fit.values, other)
        times = other.period * seen.rows.astype(np.float64)
        drawing = Drawing(
            ways,
            differentiation.positions(model, recording.q),
            times,
            seen.measured,
            seen.foretold,
            foretold(model, ways["thesis"].fit.values, other).foretold,
        )
        return Result(
            self._judge(best),
            estimates=tuple(estimates(ways)),
            settings={key: max(best.values[name], 0.0) for name, key in SETTINGS.items()},
            facts=facts(ways),
            drawing=drawing,
        )

    @staticmethod
    def _judge(best: Identified) -> Verdict:
        failures, suspicions = [], []
        for name in UNKNOWNS:
            value, (low, high) = best.values[name], best.intervals[name]
            if name != "Fc" and high <= 0.0:
                failures.append(
                    Doubt(f"{name} = {value:.4g} {UNITS[name]} is below 0", "Check signs with calibrate direction.")
                )
            elif high - low > 2 * _UNKNOWN * abs(value) and name != "Fc":
                suspicions.append(
                    Doubt(
                        f"{name} is known within {50 * (high - low) / abs(value):.0f} % only, {100 * _UNKNOWN:.0f} %"
                        " is wanted",
                        "Drive longer: more --periods.",
                    )
                )
        missed = best.validation.rmse / best.validation.torque
        if not missed <= _UNFORETOLD:
            suspicions.append(
                Doubt(
                    f"the validation's torques are missed by {100 * missed:.0f} % of their size,"
                    f" {100 * _UNFORETOLD:.0f} % is wanted",
                    "Measure torque scale and latency first; what is left is friction of other kinds.",
                )
            )
        if not best.condition_number <= _CLUMSY:
            suspicions.append(
                Doubt(
                    f"the condition number is {best.condition_number:.0f}, {_CLUMSY:.0f} is the most", "Try --design."
                )
            )
        return Verdict.of(suspicions=suspicions, failures=failures)


def recorded(log: LoopLog, delay: Array) -> Recording:
    """A loop's motion as a recording.

    Args:
        log: Its cycles.
        delay: What passes from sample to torque at each axis beyond the time from SYNC's leaving to the command's,
            shape (3,) [s].
    """
    rows = motion_rows(log)
    period = log.period_ns * 1e-9
    kept = ~log.skipped[rows]
    after = 1e-9 * float(np.median((log.command_ns - log.lateness_ns)[rows][kept]))
    tau, actual = log.tau[rows], log.tau_actual[rows]
    # what a drive reports at a sample is the torque that was commanded after the sample before
    room = _SATURATED[0] + _SATURATED[1] * np.abs(tau[:-1])
    in_force = np.append(np.all(np.abs(actual[1:] - tau[:-1]) <= room, axis=1), True)
    good = kept & log.complete[rows] & in_force
    return Recording(period, _filled(log.q[rows]), _filled(tau), after + delay, good)


def estimates(ways: Mapping[str, Identified]) -> list[Estimate]:
    """Every value of every way with its interval, as a table."""
    return [
        Estimate(f"{name}, {found.way}", found.values[name], *found.intervals[name], UNITS[name])
        for name in (*UNKNOWNS, *LOPSIDED)
        for found in ways.values()
        if name in found.values
    ]


def facts(ways: Mapping[str, Identified]) -> dict[str, Any]:
    """What `--json` prints; intervals, condition number and validation are the recommended way's."""
    best = ways["recommended"]
    return {
        **{way: {name: found.values[name] for name in UNKNOWNS if name in found.values} for way, found in ways.items()},
        "intervals": {name: list(best.intervals[name]) for name in UNKNOWNS},
        "condition_number": best.condition_number,
        "validation_rmse_nm": best.validation.rmse,
        "validation_torque_nm": best.validation.torque,
        "lopsided": {name: best.values[name] for name in LOPSIDED},
        "ways": {
            way: {
                "intervals": {name: list(pair) for name, pair in found.intervals.items()},
                "condition_number": found.condition_number,
                "residual_rms_n": found.fit.residual_rms,
                "kept": found.kept,
                "validation_rmse_nm": found.validation.rmse,
            }
            for way, found in ways.items()
        },
    }


def _filled(values: Array) -> Array:
    """Missing rows bridged by straight lines, so that the samples stay equidistant; they are marked elsewhere."""
    missing = ~np.all(np.isfinite(values), axis=1)
    if not missing.any():
        return values.copy()
    k = np.arange(len(values))
    return np.column_stack([np.interp(k, k[~missing], column[~missing]) for column in values.T])


def _sentence(words: str, motion: FourierMotion, figures: Worth) -> str:
    harmonics = len(motion.sines[0])
    (left, right), (bottom, top) = figures.x, figures.y
    return (
        f"{words}: {motion.periods} periods of {motion.period:g} s, up to {harmonics / motion.period:.2g} Hz;"
        f" x {1e3 * left:.0f} to {1e3 * right:.0f} mm, y {1e3 * bottom:.0f} to {1e3 * top:.0f} mm;"
        f" about {figures.joint_speed:.1f} rad/s and {figures.torque:.2f} N·m at most;"
        f" condition number {figures.condition_number:.1f}."
    )
