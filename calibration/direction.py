"""The direction procedure: which way everything counts, and whether cables, gears and couplings are as configured."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.conductor import Conductor, Moment
from torquerig.calibration.installation import Gearing, Hypothesis
from torquerig.calibration.procedure import Bounds, Column, Doubt, Estimate, Plan, Result, Start, Table, Verdict
from torquerig.calibration.pushes import Place, Push
from torquerig.calibration.stiction_fit import JOINTS, along
from torquerig.calibration.wiring import MOST, Answer, elsewhere, explain, rivals
from torquerig.calibration.wiring_closure import BESIDE
from torquerig.calibration.wiring_judge import FITS, WORKS

Vector = NDArray[np.float64]

_ENOUGH: Final = 0.01  # [rad] of motion: 318 counts, so that one count is 0.3 %; the closure bends by 2 % in it
_LEAST: Final = 0.05  # of `_ENOUGH`: what moved less did not move
_TRAVEL: Final = 0.1  # [rad]: 7 mm at the end of a link of 70 mm
_SPEED: Final = 3.0  # [rad/s]: a free rotor under 0.3 N·m for one sample has 5 rad/s at the motor, 0.2 at the joint
_REST: Final = 1.0  # [s] between two pushes at most, until nothing moves
_GEOMETRY_ADVICE: Final = "Put the machine into the home fixture's pose, see the figure, and repeat."
_SCALE: Final = re.compile(r"axis (\d): wrong .* it shows ([\d.e+-]+) times its motion")
_ADVICE: Final = (
    ("wrong torque sign", "Exchange two motor leads of that axis, or the drive's torque polarity; then repeat."),
    ("wrong encoder sign", "Exchange the encoder's A and B, or the drive's position polarity; then repeat."),
    ("swapped", "Exchange the cables, or the drives' node-ids (axes.N.node_id); then repeat."),
    ("slips", "Tighten the coupling between motor, gear and joint; then repeat."),
    ("both count", "Put axes.N.sign right together with the other faults; then repeat."),
)


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
        place: The mechanism about the pose in which the machine stands.
        signs: axes.N.sign as configured.
        gearing: What is believed to be fitted.
        most: Greatest torque of a push [N·m at the motor].
        rate: At which it rises [N·m/s at the motor].
        name: As the command line calls it.
        start: Positions need no meaning.
    """

    place: Place
    signs: tuple[int, int, int]
    gearing: Gearing
    most: float
    rate: float
    name: str = "direction"
    start: Start = Start.ENABLED

    def patterns(self) -> list[Vector]:
        """The pushes: each motor alone, then each pair as it turns when the third joint holds; both ways."""
        alone = list(np.eye(JOINTS))
        pairs = [np.sign(along(self.place.S, held)) for held in range(JOINTS)]
        return [sense * pattern for pattern in (*alone, *pairs) for sense in (1.0, -1.0)]

    def plan(self) -> Plan:
        """Twelve pushes."""
        longest = len(self.patterns()) * (self.most / self.rate + 2 * _REST)
        return Plan(
            "Direction: signs, wiring, gear and counts of each axis",
            (f"The machine stands in the home fixture's pose within {1e3 * BESIDE:g} mm, the fixture taken off.",),
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
        first = conductor.rest("looking", 0.0).q[0]
        pushes = []
        for pattern in self.patterns():
            conductor.settle(most=_REST)
            pushes.append(self._push(conductor, pattern, first))
        return pushes

    def _push(self, conductor: Conductor, pattern: Vector, first: Vector) -> Push:
        """Push until a joint has moved enough; `first` is where the joints stood at the first of all samples."""
        q = conductor.notebook.last_q

        def script(now: Moment) -> Vector | None:
            torque = self.rate * now.t
            if torque > self.most or float(np.abs(now.q - q).max()) >= _ENOUGH:
                return None
            commanded: Vector = torque * pattern
            return commanded

        pushed = " and ".join(f"{'+' if part > 0 else '-'}{axis}" for axis, part in enumerate(pattern, 1) if part)
        trace = conductor.drive(f"pushing {pushed}", 2 * self.most / self.rate, script)
        steps, seconds = np.diff(trace.q, axis=0), np.diff(trace.t)[:, None]
        return Push(
            pattern,
            trace.q[-1] - q,
            q - first,
            trace.command[:-1].T @ steps,
            steps[-1] / seconds[-1],
            steps.T @ (steps / seconds),
        )

    def evaluate(self, measured: list[Push]) -> Result:
        """Name what explains the answers."""
        answered = np.abs(np.array([push.moved for push in measured])) >= _LEAST * _ENOUGH
        table = _table(measured)
        failures = list(_dead(measured, answered, self.most))
        if failures:
            drawing = Drawing(tuple(measured), ())
            return Result(
                Verdict.of(failures=failures), tables=(table,), facts={"faults": _reasons(failures)}, drawing=drawing
            )
        answers = explain(measured, self.place)
        return self._named(answers, Drawing(tuple(measured), tuple(answers[:3])), table)

    def _named(self, answers: Sequence[Answer], drawing: Drawing, table: Table) -> Result:
        """The best explanation, those that cannot be told from it, and what follows for the signs."""
        if not answers or not answers[0].fits:
            doubt = Doubt(_unexplained(answers), _GEOMETRY_ADVICE)
            facts = {"faults": [], "could_be": [], "signs": list(self.signs)}
            return Result(Verdict.of(failures=[doubt]), facts=facts, tables=(table,), drawing=drawing)
        best, others = answers[0], rivals(answers)
        settings = self._settings(best.hypothesis) if best.hypothesis.is_sign_only else {}
        sets = [list(each.hypothesis.words()) for each in (best, *others)]
        return Result(
            self._verdict(best, sets[1:], elsewhere(answers)),
            estimates=(
                Estimate("directions, misfit", best.misfit, np.nan, np.nan, "1"),
                Estimate("work left over", best.labour, np.nan, np.nan, "1"),
                Estimate("beside the fixture", 1e3 * best.beside, np.nan, np.nan, "mm"),
                *(Estimate(key, value, np.nan, np.nan, "1") for key, value in settings.items()),
            ),
            settings=settings,
            facts={
                "faults": sets[0],
                "could_be": sets if len(sets) > 1 else [],
                "signs": list(settings.values()) or list(self.signs),
                "scales": list(best.hypothesis.scale),
                "misfit": best.misfit,
                "work_left_over": best.labour,
                "beside_mm": 1e3 * best.beside,
            },
            tables=(table,),
            drawing=drawing,
        )

    def _settings(self, hypothesis: Hypothesis) -> dict[str, int]:
        """axes.N.sign with which everything counts as it should."""
        turned = zip(self.signs, hypothesis.encoder_sign, strict=True)
        return {f"axes.{axis}.sign": sign * other for axis, (sign, other) in enumerate(turned, start=1)}

    def _verdict(self, best: Answer, others: Sequence[Sequence[str]], away: Answer | None) -> Verdict:
        """Signs that can be set are no failure; whatever else could be it is told."""
        words = list(best.hypothesis.words())
        doubts = [Doubt(f"or else: {_all(each)}", _GEOMETRY_ADVICE) for each in others]
        if away is not None:
            rest = _all(list(away.hypothesis.words()))
            doubts.append(
                Doubt(f"or the machine stands {1e3 * away.beside:.1f} mm beside home, and {rest}", _GEOMETRY_ADVICE)
            )
        if not best.hypothesis.is_sign_only:
            return Verdict.of(failures=[*(Doubt(each, self._advice(each)) for each in words), *doubts])
        if doubts:
            return Verdict.of(suspicions=[*(Doubt(each) for each in words), *doubts])
        return Verdict(reasons=tuple(f"{each}: turned round" for each in words))

    def _advice(self, fault: str) -> str:
        """What to do about a fault that `Hypothesis.words` names."""
        if match := _SCALE.search(fault):
            return self.gearing.advice(int(match[1]), float(match[2]))
        return next(advice for part, advice in _ADVICE if part in fault)


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


def _unexplained(answers: Sequence[Answer]) -> str:
    """Why nothing is named."""
    if not answers:
        return f"with no installation of up to {MOST} mistakes the legs close in this motion, unless gears wind up"
    best = answers[0]
    return (
        f"no installation with up to {MOST} mistakes explains the motion (the best leaves {100 * best.labour:.0f} % of"
        f" the work, {100 * WORKS:.0f} % is the most, and misses directions by {best.misfit:.2f}, {FITS} is the most)"
    )


def _all(words: Sequence[str]) -> str:
    return " and ".join(words) or "all is as configured"


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
