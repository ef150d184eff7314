"""Which installation explains how the joints answer to pushes: signs, wiring, gear, couplings.

An installation turns commanded torques into true ones and true motion into measured motion. Three things hold whatever
the dry friction is, and are asked of each: the motion lets the legs close (`wiring_closure`), and the motors did its
work and pushed in its direction (`wiring_judge`).

A motor that turns alone is not the mechanism's motion: its coupling slips. If nothing explains all pushes, one that
slips in the middle of its pushes is sought by leaving these out. Of installations that explain all pushes the one with
the fewest mistakes is named, and beside it those with as few that explain them about as well.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.installation import JOINTS, ORDERS, SIGNS, Hypothesis
from torquerig.calibration.pushes import Evidence, Place, Push
from torquerig.calibration.wiring_closure import BESIDE, OPENS, Closing, closings
from torquerig.calibration.wiring_judge import FITS, WORKS, Field

Vector = NDArray[np.float64]

MOST: Final = 3
"""Mistakes that an installation may have to be looked at: more are explained by too many alike."""
CLEARLY: Final = 1.6
"""How many times worse an installation with as few mistakes must explain all to be ruled out; our choice, and ..."""
CLEARLY_GOOD: Final = 0.3
"""... a score that no right installation is expected to go below."""
_TWINS: Final = 0.05  # within which the scales of twins are in one proportion, and beyond which that is not 1


class Answer(NamedTuple):
    """An installation and how well it explains what was measured.

    Attributes:
        hypothesis: The installation.
        misfit: Of the directions: root mean square distance of unit vectors, 0 to 2.
        labour: Of the work: root mean square share that is left over.
        opening: Of the legs' closing, in `wiring_closure.CLOSING`.
        beside: How far the machine stands beside the fixture's pose with it [m].
    """

    hypothesis: Hypothesis
    misfit: float
    labour: float
    opening: float
    beside: float

    @property
    def score(self) -> float:
        """All three misfits together, each in what is allowed of it."""
        return float(np.linalg.norm([self.misfit / FITS, self.labour / WORKS, self.opening / OPENS]))

    @property
    def moves_alike(self) -> bool:
        """Whether it explains the motion, perhaps from elsewhere than the fixture's pose."""
        return self.misfit < FITS and self.labour < WORKS and self.opening < OPENS

    @property
    def fits(self) -> bool:
        """Whether it explains all."""
        return self.moves_alike and self.beside <= BESIDE


def explain(pushes: Sequence[Push], place: Place) -> list[Answer]:
    """Installations with at most `MOST` mistakes, the best explanation first.

    Args:
        pushes: What was measured.
        place: Where.

    Returns:
        Those that fit, by mistakes and score; then the others by score.
    """
    field = Field(place)
    answers = _answers(Evidence.of(pushes), place, field)
    if not any(answer.fits for answer in answers):
        answers += [answer for axis in range(JOINTS) for answer in _answers(Evidence.of(pushes, axis), place, field)]
    answers.sort(key=lambda each: (not each.fits, each.hypothesis.mistakes if each.fits else 0, each.score))
    better = [
        each
        for each in answers[1:]
        if _are_twins(each.hypothesis, answers[0].hypothesis)
        and CLEARLY * max(each.score, CLEARLY_GOOD) < answers[0].score
    ]
    return [*better, *(each for each in answers if each not in better)]


def _answers(evidence: Evidence, place: Place, field: Field) -> list[Answer]:
    return [answer for closing in closings(evidence, place, MOST) for answer in _judged(closing, evidence, field)]


def rivals(answers: Sequence[Answer]) -> list[Answer]:
    """Other installations that explain about as well as the best: with as few mistakes, or its twin.

    Twins have all else alike and scales in the same proportion: one axis that shows twice its motion, or two that show
    half. Only how the closure bends tells them apart.
    """
    best = answers[0]
    bound = CLEARLY * max(best.score, CLEARLY_GOOD)
    return [
        each
        for each in answers[1:]
        if each.fits
        and each.score <= bound
        and (each.hypothesis.mistakes == best.hypothesis.mistakes or _are_twins(each.hypothesis, best.hypothesis))
    ]


def elsewhere(answers: Sequence[Answer]) -> Answer | None:
    """What would be wrong, less than with the best, if the machine stood somewhere beside the fixture's pose."""
    best = answers[0]
    fewer = [each for each in answers if each.moves_alike and each.hypothesis.mistakes < best.hypothesis.mistakes]
    return min(fewer, key=lambda each: (each.hypothesis.mistakes, each.beside)) if fewer else None


def _are_twins(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two installations differ by a factor that is common to all scales."""
    ratio = np.array(one.scale) / np.array(other.scale)
    alike = bool(np.ptp(ratio) < _TWINS * ratio.max()) and bool(np.abs(np.log(ratio)).min() > _TWINS)
    return alike and replace(one, scale=other.scale) == other


def _judged(closing: Closing, evidence: Evidence, field: Field) -> Iterator[Answer]:
    """All motors and torque signs with one choice of encoders."""
    motion = field.motion(evidence, closing)
    for motors in ORDERS:
        slipping = tuple(sorted(motors[axis] for axis in evidence.loose))
        for sign in SIGNS:
            hypothesis = Hypothesis(motors, closing.encoders, sign, closing.sign, closing.scale, slipping)
            if hypothesis.mistakes > MOST or not _turns_alone(hypothesis, evidence):
                continue
            judged = [field.judge(hypothesis, evidence, motion, factor) for factor in _factors(closing)]
            misfit, labour = min(judged, key=lambda each: each[0] / FITS + each[1] / WORKS)
            yield Answer(hypothesis, misfit, labour, closing.opening, closing.beside)


def _factors(closing: Closing) -> Iterator[Vector]:
    """How many times the configured torque each motor may give: a wrong scale is the gear's, or the counts' only."""
    for gears in product(*((1.0,) if scale == 1.0 else (1.0, scale) for scale in closing.scale)):
        factor = np.ones(JOINTS)
        factor[list(closing.encoders)] = gears
        yield factor


def _turns_alone(hypothesis: Hypothesis, evidence: Evidence) -> bool:
    """Whether motors that turned alone are those with a slipping coupling, and turned the way that they were driven."""
    for push in evidence.lone:
        axis = push.lone
        assert axis is not None  # noqa: S101  (that is what makes it a lone one)
        leg = hypothesis.encoders[axis]
        by = hypothesis.motors.index(leg)
        driven = hypothesis.torque_sign[by] * push.torque[by]
        if leg not in hypothesis.slipping or driven * hypothesis.encoder_sign[axis] * push.moved[axis] <= 0.0:
            return False
    return True
