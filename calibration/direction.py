"""The direction procedure: which way everything counts, and whether cables, gears and couplings are as configured."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.conductor import Conductor, Moment
from torquerig.calibration.procedure import Bounds, Column, Doubt, Estimate, Plan, Result, Start, Table, Verdict
from torquerig.calibration.stiction_fit import JOINTS, along
from torquerig.calibration.wiring import CLEARLY, FITS, Answer, Geometry, Hypothesis, Push, explain

Vector = NDArray[np.float64]

_ENOUGH: Final = 0.004  # [rad] of motion: 127 counts, so that one count is below 1 %
_LEAST: Final = 0.05  # of `_ENOUGH`: what moved less did not move
_TRAVEL: Final = 0.1  # [rad]: 7 mm at the end of a link of 70 mm
_SPEED: Final = 3.0  # [rad/s]: a free rotor under 0.3 N·m for one sample has 5 rad/s at the motor, 0.2 at the joint
_REST: Final = 1.0  # [s] between two pushes at most, until nothing moves
_GEOMETRY_ADVICE: Final = "Put the machine into the home fixture's pose, see the figure, and repeat."


class Drawing(NamedTuple):
    """What the figure shows.

    Attributes:
        pushes: What was measured.
        answers: The best explanations, best first.
    """

    pushes: tuple[Push, ...]
    answers: tuple[Answer, ...]


@dataclass(frozen=True, slots=True)
class DirectionProcedure:
    """Pushes each motor and each pair of motors a little, both ways, and finds the installation that explains it.

    Attributes:
        geometry: At the pose in which the machine stands, by the configuration.
        signs: axes.N.sign as configured.
        most: Greatest torque of a push [N·m at the motor].
        rate: At which it rises [N·m/s at the motor].
        name: As the command line calls it.
        start: Positions need no meaning.
    """

    geometry: Geometry
    signs: tuple[int, int, int]
    most: float
    rate: float
    name: str = "direction"
    start: Start = Start.ENABLED

    def patterns(self) -> list[Vector]:
        """The pushes: each motor alone, then each pair as it turns when the third joint holds; both ways."""
        alone = list(np.eye(JOINTS))
        pairs = [np.sign(along(self.geometry.S, held)) for held in range(JOINTS)]
        return [sense * pattern for pattern in (*alone, *pairs) for sense in (1.0, -1.0)]

    def plan(self) -> Plan:
        """Twelve pushes."""
        longest = len(self.patterns()) * (self.most / self.rate + 2 * _REST)
        return Plan(
            "Direction: signs, wiring, gear and counts of each axis",
            ("The machine stands in the home fixture's pose, within 2 mm, with the fixture taken off.",),
            (
                f"Each motor alone, then two motors at a time, both ways: torque rises by {self.rate:g} N·m/s,",
                f"until a joint has moved {_ENOUGH:g} rad ({np.degrees(_ENOUGH):.2g}°), or to {self.most:g} N·m.",
                "Which joints move, and which way, tells how everything is connected.",
            ),
            Bounds(torque=self.most, speed=_SPEED, travel=_TRAVEL, duration=longest),
            lasts=longest / 3,
        )

    def measure(self, conductor: Conductor) -> list[Push]:
        """All pushes and their answers."""
        return [self._push(conductor, pattern) for pattern in self.patterns()]

    def _push(self, conductor: Conductor, pattern: Vector) -> Push:
        conductor.settle(most=_REST)
        q = conductor.notebook.last_q

        def script(now: Moment) -> Vector | None:
            torque = self.rate * now.t
            if torque > self.most or float(np.abs(now.q - q).max()) >= _ENOUGH:
                return None
            commanded: Vector = torque * pattern
            return commanded

        pushed = " and ".join(f"{'+' if part > 0 else '-'}{axis}" for axis, part in enumerate(pattern, 1) if part)
        trace = conductor.drive(f"pushing {pushed}", 2 * self.most / self.rate, script)
        return Push(pattern, trace.q[-1] - q)

    def evaluate(self, measured: list[Push]) -> Result:
        """Name what explains the answers."""
        moved = np.array([push.moved for push in measured])
        answered = np.abs(moved) >= _LEAST * _ENOUGH
        table = _table(measured)
        failures = list(_dead(measured, answered, self.most))
        if failures:
            drawing = Drawing(tuple(measured), ())
            return Result(
                Verdict.of(failures=failures), tables=(table,), facts={"faults": _reasons(failures)}, drawing=drawing
            )
        answers = explain(
            [Push(push.torque, push.moved * seen) for push, seen in zip(measured, answered, strict=True)], self.geometry
        )
        return self._judge(answers, Drawing(tuple(measured), tuple(answers[:3])), table)

    def _judge(self, answers: Sequence[Answer], drawing: Drawing, table: Table) -> Result:
        best = answers[0]
        hypothesis = best.hypothesis
        turned = [a * b < 0 for a, b in zip(hypothesis.encoder_sign, (1, 1, 1), strict=True)]
        is_sign_only = hypothesis == Hypothesis(
            torque_sign=hypothesis.encoder_sign, encoder_sign=hypothesis.encoder_sign
        )
        settings = {
            f"axes.{axis}.sign": -sign if other else sign
            for axis, (sign, other) in enumerate(zip(self.signs, turned, strict=True), start=1)
        }
        words = list(hypothesis.words())
        failures: list[Doubt] = []
        if best.misfit >= FITS:
            words = []
            failures.append(
                Doubt(
                    f"no installation explains the motion (misfit {best.misfit:.2f}, fits below {FITS})",
                    _GEOMETRY_ADVICE,
                )
            )
        elif not is_sign_only:
            failures += [Doubt(each, _advice(each)) for each in words]
        rivals = _rivals(answers) if best.misfit < FITS else []
        suspicions = [
            Doubt(f"as well it may be: {' and '.join(each.hypothesis.words())}", _GEOMETRY_ADVICE) for each in rivals
        ]
        verdict = Verdict.of(failures=failures, suspicions=suspicions)
        if verdict == Verdict() and words:
            verdict = Verdict(reasons=tuple(f"{each}: turned round" for each in words))
        facts = {
            "faults": words,
            "misfit": best.misfit,
            "signs": list(settings.values()),
            "scale": hypothesis.scale,
            "rivals": [list(each.hypothesis.words()) for each in rivals],
        }
        estimates = [Estimate("misfit of this installation", best.misfit, np.nan, np.nan, "1")]
        estimates += (
            [Estimate(key, value, np.nan, np.nan, "1") for key, value in settings.items()] if is_sign_only else []
        )
        return Result(
            verdict,
            estimates=tuple(estimates),
            settings=settings if is_sign_only else {},
            facts=facts,
            tables=(table,),
            drawing=drawing,
        )


def _dead(pushes: Sequence[Push], answered: NDArray[np.bool_], most: float) -> list[Doubt]:
    """Motors that move nothing, and encoders that never count."""
    doubts = []
    for axis in range(JOINTS):
        alone = [
            row
            for push, row in zip(pushes, answered, strict=True)
            if np.count_nonzero(push.torque) == 1 and push.torque[axis]
        ]
        if not np.any(alone):
            doubts.append(
                Doubt(
                    f"axis {axis + 1}: nothing moved up to {most:g} N·m",
                    "See that the fixture is off, the motor is connected, and friction is not more: --most.",
                )
            )
    if not doubts:
        doubts = [
            Doubt(f"axis {axis + 1}: its encoder never counts while others do", "See its encoder's cable and supply.")
            for axis in range(JOINTS)
            if not answered[:, axis].any()
        ]
    return doubts


def _rivals(answers: Sequence[Answer]) -> list[Answer]:
    """Other explanations with as few mistakes that fit about as well."""
    best = answers[0]
    return [
        each
        for each in answers[1:]
        if each.hypothesis.mistakes == best.hypothesis.mistakes and each.misfit <= CLEARLY * max(best.misfit, FITS / 4)
    ]


def _advice(fault: str) -> str:
    """What to do about a fault that `Hypothesis.words` names."""
    for part, advice in (
        ("wrong torque sign", "Exchange two motor leads of that axis, or the drive's torque polarity; then repeat."),
        ("wrong encoder sign", "Exchange the encoder's A and B, or the drive's position polarity; then repeat."),
        ("swapped", "Exchange the cables, or the drives' node-ids (axes.N.node_id); then repeat."),
        ("wrong gear", "Compare axes.N.gear and axes.N.encoder_counts with what is fitted; then repeat."),
        ("slips", "Tighten the coupling between motor, gear and joint; then repeat."),
        ("both count", "Put axes.N.sign right together with the other faults; then repeat."),
    ):
        if part in fault:
            return advice
    return ""


def _reasons(doubts: Sequence[Doubt]) -> list[str]:
    return [doubt.reason for doubt in doubts]


def _table(pushes: Sequence[Push]) -> Table:
    """One row a push."""
    columns: list[Any] = []
    for name, unit, rows in (
        ("pattern", "1", [push.torque for push in pushes]),
        ("moved", "rad", [push.moved for push in pushes]),
    ):
        columns += [Column(f"{name}_{axis}", unit, values) for axis, values in enumerate(np.array(rows).T, start=1)]
    return Table("pushes", tuple(columns))
