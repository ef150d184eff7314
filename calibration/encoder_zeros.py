"""The procedure for encoder zeros: a motion, driven or by hand, and the zeros that make the legs close in it."""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from torquerig.calibration.conductor import Conductor
from torquerig.calibration.driving import follow, lasts, motion_rows
from torquerig.calibration.excitation import FourierMotion
from torquerig.calibration.installation import Gearing
from torquerig.calibration.procedure import Bounds, Doubt, Estimate, Plan, Result, Start, Verdict
from torquerig.calibration.regressor import Array
from torquerig.calibration.zeros import MotionTooSmall, Zeros, find_zeros
from torquerig.calibration.zeros_scale import wrong_scales
from torquerig.control.loop import Controller
from torquerig.control.reference import ReferenceTable
from torquerig.mechanism import SingularPoseError

LEGS: Final = 3
_TRAVEL: Final = 0.3  # [rad] beyond what the motion asks for, or about what a hand needs for +-20 mm
_SPEED: Final = 3.0  # [rad/s] a hand's, ten times the driven motion's
_PATIENCE: Final = 1.5  # times the duration that is planned
_SETUP: Final = 10.0  # [s] for the way to the motion's start
_LEFT_OVER: Final = 1.0  # [count] rms of closure residuals; rounding alone leaves 0.29 of a count
_HOPELESS: Final = 10.0  # [count] rms beyond which zeros are no use: links 0.2 mm off their drawing leave about that
_INSTALLATION: Final = "Run calibrate direction first (gear, counts, wiring), then calibrate home."
_WIDE: Final = math.radians(0.005)  # half of an interval; the driven motion's is 0.0003 deg


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """Joint angles of a motion.

    Attributes:
        period: Sampling period [s].
        q: Shape (n, 3) [rad]; NaN where a sample is missing.
    """

    period: float
    q: Array


@dataclass(frozen=True, slots=True)
class Driven:
    """The motion that the procedure drives.

    Attributes:
        motion: What it asks for.
        table: The same, ready for the loop.
    """

    motion: FourierMotion
    table: ReferenceTable


@dataclass(frozen=True, slots=True)
class ZerosProcedure:
    """Finds what is to be added to the joint angles that the homed encoders tell.

    Attributes:
        controller: Drives the machine; its model closes the legs.
        driven: The motion; None: a person moves the machine by hand for `seconds`, at zero torque.
        seconds: How long that is recorded [s].
        torque: Greatest torque [N·m at the motor].
        resolution: Joint angle of a count [rad].
        zeros: What is added already at each axis [rad].
        home: Where the end-effector is when the drives are homed [m].
        gearing: What the drives are believed to be fitted with.
        tolerance: Standard deviation of link lengths and base points, to seek them too [m]; None: they are right.
        whose: Where the samples come from, if not from a motion of this procedure.
    """

    controller: Controller
    driven: Driven | None
    seconds: float
    torque: float
    resolution: float
    zeros: tuple[float, float, float]
    home: tuple[float, float]
    gearing: Gearing
    tolerance: float | None = None
    whose: str | None = None
    name: str = "zeros"
    start: Start = Start.HOMED

    def plan(self) -> Plan:
        """One motion."""
        title = "Zeros: what makes the three legs close"
        homed = "The machine stands free, in its home fixture's pose with the fixture taken off, unless it was homed."
        if self.whose is not None:
            return Plan(title, (), (f"Nothing moves: {self.whose} is evaluated.",), Bounds(0.0, 0.0, 0.0, 0.0))
        if self.driven is None:
            steps = (
                f"The drives are enabled at zero torque. Move the end-effector by hand for {self.seconds:g} s: slow"
                " circles and figures of +-10 mm about home, in all directions.",
            )
            bounds = Bounds(0.0, _SPEED, 1.0, math.ceil(_PATIENCE * self.seconds + _SETUP))
            return Plan(title, (homed,), steps, bounds, lasts=self.seconds)
        motion, table = self.driven.motion, self.driven.table
        x, y = np.ptp(table.position, axis=0) / 2
        fastest = float(np.max(np.hypot(*table.velocity.T)))
        travel = float(np.max(np.abs(table.q - table.q[0])))
        steps = (
            f"Drive a slow figure of +-{1e3 * x:.0f} mm by +-{1e3 * y:.0f} mm for {motion.duration:g} s, at most"
            f" {1e3 * fastest:.0f} mm/s.",
        )
        bounds = Bounds(self.torque, _SPEED, 2 * travel + _TRAVEL, math.ceil(_PATIENCE * lasts(table) + _SETUP))
        return Plan(title, (homed,), steps, bounds, lasts=lasts(table))

    def measure(self, conductor: Conductor) -> Recorded:
        """The joint angles of the motion."""
        if self.driven is None:
            trace = conductor.rest("move the end-effector by hand, +-10 mm in all directions", self.seconds)
            return Recorded(conductor.period_ns * 1e-9, _whole(trace.q, trace.complete))
        log = follow(conductor, self.controller, self.driven.table, "the figure")
        rows = motion_rows(log)
        return Recorded(log.period_ns * 1e-9, _whole(log.q[rows], log.complete[rows]))

    def evaluate(self, measured: Recorded) -> Result:
        """The zeros, or how large the motion would have to be."""
        model = self.controller.model
        place = np.nanmean(measured.q, axis=0) if len(measured.q) else np.zeros(LEGS)
        x, y = self.home
        try:
            x, y = model.forward_kinematics(place).tolist()
            found = find_zeros(model, measured.q, measured.period, start=(x, y), tolerance=self.tolerance)
        except MotionTooSmall as error:
            return Result(Verdict.of(failures=[Doubt(str(error), "Record a larger motion.")]))
        except SingularPoseError as error:
            doubt = self._scale(measured, (x, y)) or Doubt(str(error), _INSTALLATION)
            return Result(Verdict.of(failures=[doubt]))
        return Result(
            self._judge(found, measured),
            estimates=tuple(self._estimates(found)),
            settings=self._settings(found),
            facts=self._facts(found),
            drawing=found,
        )

    def _totals(self, found: Zeros) -> list[float]:
        return [float(old + new) for old, new in zip(self.zeros, found.values, strict=True)]

    def _settings(self, found: Zeros) -> dict[str, object]:
        """The zeros for the loop; none that belong to another geometry than the loop's."""
        if self.tolerance is not None:
            return {}
        return {f"axes.{leg}.encoder_zero": value for leg, value in enumerate(self._totals(found), start=1)}

    def _estimates(self, found: Zeros) -> list[Estimate]:
        def total(leg: int, values: Array) -> float:
            return math.degrees(self.zeros[leg] + float(values[leg]))

        zeros = [
            Estimate(f"axis {leg + 1}", total(leg, found.values), total(leg, found.low), total(leg, found.high), "deg")
            for leg in range(LEGS)
        ]
        return zeros + [
            Estimate(f"{name}, above the drawing", 1e3 * value, 1e3 * low, 1e3 * high, "mm")
            for name, (value, low, high) in found.lengths.items()
        ]

    def _facts(self, found: Zeros) -> dict[str, Any]:
        seen = found.observability
        total = np.array(self.zeros)
        return {
            "zeros_deg": np.degrees(self._totals(found)).tolist(),
            "intervals_deg": np.degrees([found.low + total, found.high + total]).T.tolist(),
            "condition_number": seen.condition_number,
            "singular_values": seen.singular_values.tolist(),
            "combinations": seen.combinations.tolist(),
            "samples": seen.samples,
            "extent_mm": [1e3 * half for half in seen.extent],
            "residual_rms_deg": math.degrees(found.rms),
            "lengths_mm": {name: [1e3 * part for part in parts] for name, parts in found.lengths.items()},
        }

    def _judge(self, found: Zeros, measured: Recorded) -> Verdict:
        """Legs that still do not close are no matter of zeros: what else it is decides whether zeros are any use."""
        failures, suspicions = [], []
        missed = found.rms / self.resolution
        if not missed <= _LEFT_OVER:
            x, y = found.position[0].tolist()
            words = (
                f"the legs still miss each other by {missed:.1f} counts rms, {_LEFT_OVER:g} is the most that rounding"
                " explains"
            )
            if doubt := self._scale(measured, (x, y)):
                failures.append(doubt)
            elif not missed <= _HOPELESS:
                failures.append(Doubt(f"{words}, and no one axis' scale", _INSTALLATION))
            else:
                suspicions.append(Doubt(words, "Link lengths or base points differ from the drawing: see --geometry."))
        worst = float(np.max(found.high - found.low)) / 2
        if self.tolerance is None and not failures and not worst <= _WIDE:
            suspicions.append(
                Doubt(
                    f"a zero is known within {math.degrees(worst):.2g} deg only, {math.degrees(_WIDE):.2g} is wanted",
                    "Record a longer or larger motion.",
                )
            )
        return Verdict.of(failures=failures, suspicions=suspicions)

    def _scale(self, measured: Recorded, start: tuple[float, float]) -> Doubt | None:
        """The one axis whose wrong gear or counts would explain that the legs do not close; None if none would."""
        model = self.controller.model
        homed = model.inverse_kinematics(self.home).theta + np.array(self.zeros)
        scales = wrong_scales(model, measured.q, start=start, homed=homed.tolist())
        if not scales or not scales[0].rms <= _LEFT_OVER * self.resolution:
            return None
        axis, scale, _ = scales[0]
        return Doubt(
            f"axis {axis}: wrong gear or encoder counts, it shows {scale:.4g} times its motion",
            self.gearing.advice(axis, scale),
        )


def _whole(q: Array, complete: np.ndarray) -> Array:
    """Joint angles, NaN where an axis did not answer in time."""
    return np.where(complete[:, None], q, np.nan)
