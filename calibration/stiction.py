"""The stiction procedure: slow ramps of torque on pairs of joints until something moves."""

from dataclasses import dataclass
from itertools import product
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.conductor import Conductor, Moment
from torquerig.calibration.notebook import Trace
from torquerig.calibration.procedure import Bounds, Column, Doubt, Plan, Result, Start, Table, Verdict
from torquerig.calibration.stiction_fit import JOINTS, Push, Stiction, along, fit_stiction, onset
from torquerig.mechanism import Manipulator

Vector = NDArray[np.float64]

_COARSE: Final = 8.0  # times the slow rate: finds where the slow ramps begin
_BEGIN: Final = 0.85  # of the coarse ramp's torque: where slow ramps begin
_MOVED: Final = 20.0  # [counts] after which a ramp ends: 0.6 mrad at 200 000 counts a revolution
_REST: Final = 1.0  # [s] between two ramps at most, until nothing moves
_TRAVEL: Final = 0.15  # [rad]: 10 mm at the end of a link of 70 mm
_SPEED: Final = 2.0  # [rad/s]: breaking loose at 0.5 N·m and moving on for two samples gives 0.3
_SPREAD: Final = 0.1  # of the friction: repeats that differ more are suspicious


class Ramp(NamedTuple):
    """One ramp as it was measured.

    Attributes:
        held: Which joint is meant to stand still, from 0.
        sense: +1 or -1.
        is_fine: Whether it counts; coarse ones only find where to begin.
        rates: The joints' rates along the push, shape (3,) [rad/m].
        torque: What each of the two motors was commanded, shape (m,) [N·m at the motor].
        trace: The cycles.
        moved: How far each joint got, shape (m, 3) [counts].
    """

    held: int
    sense: int
    is_fine: bool
    rates: Vector
    torque: Vector
    trace: Trace
    moved: Vector

    @property
    def farthest(self) -> Vector:
        """How far the joint that got farthest had moved, shape (m,) [counts]."""
        farthest: Vector = np.abs(self.moved).max(axis=1)
        return farthest

    @property
    def has_moved(self) -> bool:
        """Whether it ended in motion."""
        return bool(self.farthest[-1] >= _MOVED)

    def push(self) -> Push:
        """The torque at which motion began."""
        began = onset(self.trace.t, self.farthest)
        return Push(self.held, self.sense, self.rates, float(np.interp(began, self.trace.t, self.torque)))


class Drawing(NamedTuple):
    """What the figure shows.

    Attributes:
        ramps: All ramps.
        fit: Friction; None when there is none.
    """

    ramps: tuple[Ramp, ...]
    fit: Stiction | None


@dataclass(frozen=True, slots=True)
class StictionProcedure:
    """Finds the least torque that moves each joint.

    Attributes:
        model: The mechanism.
        most: Greatest torque of a ramp [N·m at the motor].
        rate: Of the slow ramps [N·m/s at the motor].
        repeats: Slow ramps of each pair and sense, at least 2.
        scale_uncertainty: How well newton metres are known, as a share.
        axes: Which joints are reported, from 1.
    """

    model: Manipulator
    most: float
    rate: float
    repeats: int
    scale_uncertainty: float
    axes: tuple[int, ...] = (1, 2, 3)
    name: str = "stiction"
    start: Start = Start.HOMED

    def plan(self) -> Plan:
        """Six pushes, each found coarsely and then repeated slowly."""
        coarse, fine = self.most / (_COARSE * self.rate), (1 - _BEGIN) * self.most / self.rate
        longest = 2 * JOINTS * (coarse + self.repeats * fine + (1 + self.repeats) * (_REST + 0.1))
        return Plan(
            "Stiction: the least torque that moves each joint, both ways",
            ("The machine stands free, in its home fixture's pose with the fixture taken off, unless it was homed.",),
            (
                "Of the three joints no one moves alone: push two while the third holds, for each pair, both ways.",
                f"A fast ramp ({_COARSE * self.rate:g} N·m/s) to at most {self.most:g} N·m finds where motion begins.",
                f"{self.repeats} slow ramps ({self.rate:g} N·m/s) each, ended after {_MOVED:g} counts of motion.",
            ),
            Bounds(torque=self.most, speed=_SPEED, travel=_TRAVEL, duration=longest),
            lasts=longest / 2,
        )

    def measure(self, conductor: Conductor) -> list[Ramp]:
        """All ramps; a pair that does not move is left alone after its coarse ramp."""
        ramps = []
        for held in range(JOINTS):
            coarse = [self._ramp(conductor, held, sense, begin=0.0, rate=_COARSE * self.rate) for sense in (1, -1)]
            ramps += coarse
            if not all(ramp.has_moved for ramp in coarse):
                continue
            begins = [_BEGIN * ramp.push().torque for ramp in coarse]
            # to and fro in turn: the machine stays where it is, and comes to a true rest at each reversal
            for _, (sense, begin) in product(range(self.repeats), zip((1, -1), begins, strict=True)):
                # a ramp that begins elsewhere in the sampling period each time averages over it
                shift = conductor.rng.uniform(0.0, self.rate * conductor.period_ns / 1e9)
                ramps.append(self._ramp(conductor, held, sense, begin=begin + shift, rate=self.rate))
        return ramps

    def evaluate(self, measured: list[Ramp]) -> Result:
        """Friction of each joint, or which pair did not move."""
        fine = [ramp for ramp in measured if ramp.is_fine and ramp.has_moved]
        failures = [
            Doubt(
                f"no joint of the pair {_pair(ramp.held)} moved up to {self.most:g} N·m at both motors",
                "See that the machine is free (fixture, brakes) and powered, or allow more with --most.",
            )
            for ramp in measured
            if not ramp.has_moved
        ]
        if failures:
            return Result(
                Verdict.of(failures=failures), drawing=Drawing(tuple(measured), None), tables=_tables(measured)
            )
        fit = fit_stiction([ramp.push() for ramp in fine], self.scale_uncertainty)
        chosen = [each for each in fit.estimates() if int(each.name.split()[1].rstrip(",")) in self.axes]
        return Result(
            Verdict.of(suspicions=self._suspicions(fit)),
            estimates=tuple(chosen),
            facts={"axes": [_facts(fit, axis, self.model.gear_ratio) for axis in self.axes], "spread_nm": fit.spread},
            tables=_tables(measured),
            drawing=Drawing(tuple(measured), fit),
        )

    def _suspicions(self, fit: Stiction) -> list[Doubt]:
        doubts = []
        level = float(fit.friction.mean())
        if fit.spread > _SPREAD * level:
            doubts.append(
                Doubt(
                    f"repeats differ by {fit.spread:.2g} N·m (standard deviation), {100 * fit.spread / level:.0f} % of"
                    " the friction",
                    "Friction may depend on the position: look at the figure, and repeat with more --repeats.",
                )
            )
        doubts += [
            Doubt(
                f"joint {joint + 1} has a friction of {value:.2g} N·m in one sense, which cannot be",
                "The frictions differ so much that a held joint gave way: look at the figure.",
            )
            for joint, values in enumerate(fit.friction)
            for value, half in zip(values, fit.half_width[joint], strict=True)
            if value + half < 0.0
        ]
        return doubts

    def _ramp(self, conductor: Conductor, held: int, sense: int, *, begin: float, rate: float) -> Ramp:
        """Let everything come to rest, then push until something moves, or `most` is reached."""
        conductor.settle(most=_REST)
        q = conductor.notebook.last_q
        rates = along(self.model.jacobians(self.model.forward_kinematics(q))[1], held)
        pattern = sense * np.sign(rates)
        steps = np.array([abs(axis.scale.rad_per_count) for axis in conductor.group.axes if axis.scale is not None])
        torques: list[float] = []

        def script(now: Moment) -> Vector | None:
            torque = begin + rate * now.t
            torques.append(min(torque, self.most))
            if torque > self.most or (np.abs(now.q - q) >= _MOVED * steps).any():
                return None
            commanded: Vector = pattern * torque
            return commanded

        sign = "+" if sense > 0 else "-"
        words = f"joints {_pair(held)} {sign}, {'slow' if rate == self.rate else 'fast'}"
        trace = conductor.drive(words, 2 * self.most / rate, script)
        # a sample shows what was commanded one cycle before: its torque acted from then until now
        acted = np.array([begin, *torques])[: len(trace)]
        return Ramp(held, sense, rate == self.rate, rates, acted, trace, (trace.q - q) / steps)


def _pair(held: int) -> str:
    """The joints that are pushed, in words."""
    first, second = (joint + 1 for joint in range(JOINTS) if joint != held)
    return f"{first} and {second}"


def _facts(fit: Stiction, axis: int, gear: float) -> dict[str, object]:
    """One joint for JSON."""

    def side(number: int) -> dict[str, float]:
        value, half = float(fit.friction[axis - 1, number]), float(fit.half_width[axis - 1, number])
        return {"motor_nm": value, "low": value - half, "high": value + half, "joint_nm": gear * value}

    return {"axis": axis, "positive": side(0), "negative": side(1)}


def _tables(ramps: list[Ramp]) -> tuple[Table, ...]:
    """One row a ramp."""
    moved = np.array([ramp.has_moved for ramp in ramps])
    torque = np.array([ramp.push().torque if ramp.has_moved else np.nan for ramp in ramps])
    columns = [
        Column("held_joint", "1", np.array([ramp.held + 1 for ramp in ramps])),
        Column("sense", "1", np.array([ramp.sense for ramp in ramps])),
        Column("slow", "1", np.array([ramp.is_fine for ramp in ramps])),
        Column("moved", "1", moved),
        Column("torque", "N·m", torque),
    ]
    return (Table("ramps", tuple(columns)),)
