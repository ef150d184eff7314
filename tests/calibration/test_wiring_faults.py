"""Which installation explains the answers to pushes: mistakes alone and two at once, with and without dry friction."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from torquerig.calibration.installation import Hypothesis
from torquerig.calibration.pushes import Place, Push
from torquerig.calibration.stiction_fit import along
from torquerig.calibration.wiring import elsewhere, explain, rivals
from torquerig.calibration.wiring_judge import Field
from torquerig.mechanism import HOME, Manipulator

MODEL = Manipulator.thesis()
START = (float(HOME[0]), float(HOME[1]))
PLACE = Place.of(MODEL, START)
FIELD = Field(PLACE)
PATTERNS = [*np.eye(3), *(np.sign(along(PLACE.S, held)) for held in range(3))]
ENOUGH = 0.01  # [rad]
COUNT = 2 * np.pi / 200_000  # [rad]
SECONDS = 0.1


def answers(truth: Hypothesis, *, friction: bool, gear: bool = False, start=START) -> list[Push]:
    """What a machine of this installation answers: closing, work and direction as they are, counts rounded down."""
    begin, position, made = None, np.array(start), []
    told = np.zeros(3)
    for pattern in [sense * each for each in PATTERNS for sense in (1.0, -1.0)]:
        given = np.zeros(3)
        given[list(truth.motors)] = np.array(truth.torque_sign) * pattern
        if gear:
            given[list(truth.encoders)] *= truth.scale
        if any(given[leg] for leg in truth.slipping):
            leg = next(leg for leg in truth.slipping if given[leg])
            true, torque = ENOUGH * np.sign(given[leg]) * np.eye(3)[leg], 0.05
        else:
            ways = FIELD.directions(given[None], np.full(3, 0.07))[0, :, -1 if friction else 0]
            velocity = np.linalg.pinv(PLACE.S) @ ways[np.isfinite(ways[:, 0])][0]
            after = position + ENOUGH * velocity / np.abs(PLACE.S @ velocity).max()
            true = MODEL.inverse_kinematics(after).theta - MODEL.inverse_kinematics(position).theta
            position = after
            torque = load(true, friction=friction) / float(given @ true)
        before, told = told, told + measured(true, truth)
        seen = np.floor(told / COUNT) * COUNT - np.floor(before / COUNT) * COUNT
        begin = before if begin is None else begin
        rates = (60 if any(given[leg] for leg in truth.slipping) else 2 / SECONDS) * seen  # a rotor alone spins up
        squares = np.outer(rates, rates) * SECONDS / 3
        made.append(Push(pattern, seen, before - begin, np.outer(torque * pattern, seen), rates, squares))
    return made


def measured(true: np.ndarray, truth: Hypothesis) -> np.ndarray:
    return np.array(truth.encoder_sign) * np.array(truth.scale) * true[list(truth.encoders)]


def load(true: np.ndarray, *, friction: bool) -> float:
    """What a motion takes, at the motor: as fast at its end as twice its mean, with unlike dry frictions."""
    velocity = np.linalg.pinv(PLACE.S) @ (2 * true / SECONDS)
    taken = velocity @ PLACE.Mt @ velocity / 2 + velocity @ PLACE.Ft @ velocity * SECONDS / 3
    dry = np.array([0.07, 0.06, 0.08]) @ np.abs(true) if friction else 0.0
    return float(taken / MODEL.gear_ratio + dry)


def flipped(axis: int) -> tuple[int, ...]:
    return tuple(-1 if each == axis else 1 for each in range(3))


def scaled(axis: int, scale: float) -> tuple[float, ...]:
    return tuple(scale if each == axis else 1.0 for each in range(3))


SWAPS = [(1, 0, 2), (0, 2, 1), (2, 1, 0)]
SINGLE = [
    *({"torque_sign": flipped(axis)} for axis in range(3)),
    *({"encoder_sign": flipped(axis)} for axis in range(3)),
    *({"motors": legs} for legs in SWAPS),
    *({"encoders": legs} for legs in SWAPS),
    *({"motors": legs, "encoders": legs} for legs in SWAPS),
    *({"scale": scaled(axis, 1.3)} for axis in range(3)),
    *({"slipping": (leg,)} for leg in range(3)),
]
RINGS = [{"motors": (1, 2, 0)}, {"encoders": (2, 0, 1)}, {"motors": (1, 2, 0), "encoders": (1, 2, 0)}]
WHOLE = [{"torque_sign": flipped(axis), "encoder_sign": flipped(axis)} for axis in range(3)]
DOUBLE = [{**one, **other} for one, other in combinations(SINGLE, 2) if not one.keys() & other.keys()]
SOME = np.random.default_rng(1).permutation(len(DOUBLE))[:24]
ALIKE = [
    {"torque_sign": (-1, -1, 1)},
    {"encoder_sign": (1, -1, -1)},
    {"torque_sign": (1, -1, -1), "encoder_sign": (1, -1, -1)},
    {"motors": (1, 0, 2), "encoders": (0, 2, 1)},
    {"slipping": (0, 2)},
]


def named(*mistakes) -> str:
    return "; ".join(Hypothesis(**mistakes[0]).words()) or "none"


def told_of(truth: Hypothesis, **how) -> list[list[str]]:
    """Words of the best explanation and its rivals, without what depends on rounding."""
    found = explain(answers(truth, **how), PLACE)
    assert found[0].fits
    best = [found[0], *rivals(found)]
    return [list(replace(each.hypothesis, scale=rounded(each.hypothesis)).words()) for each in best]


def rounded(hypothesis: Hypothesis) -> tuple[float, ...]:
    return tuple(float(f"{each:.2g}") for each in hypothesis.scale)


def words(truth: Hypothesis) -> list[str]:
    return list(replace(truth, scale=rounded(truth)).words())


@pytest.mark.parametrize("friction", [False, True])
@pytest.mark.parametrize("mistake", [{}, *SINGLE, *WHOLE, *RINGS], ids=named)
def test_each_mistake_is_named(mistake, friction):
    truth = Hypothesis(**mistake)
    assert told_of(truth, friction=friction)[0] == words(truth)


@pytest.mark.parametrize("mistakes", [*(DOUBLE[each] for each in SOME), *ALIKE], ids=named)
def test_two_mistakes_at_once_are_both_named(mistakes):
    truth = Hypothesis(**mistakes)
    assert told_of(truth, friction=True)[0] == words(truth)


def test_all_axes_together_the_other_way_round_do_not_close_as_the_machine_moves():
    truth = Hypothesis(torque_sign=(-1, -1, -1), encoder_sign=(-1, -1, -1))
    assert told_of(truth, friction=True)[0] == words(truth)


@pytest.mark.parametrize("scale", [(1.0, 1.3, 1.3), (1.3, 1.0, 0.5)])
def test_two_wrong_gears_are_among_those_that_it_could_be(scale):
    told = told_of(Hypothesis(scale=scale), friction=True, gear=True)
    assert words(Hypothesis(scale=scale)) in told


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("scale", [0.5, 0.96, 1.06, 2.0])
def test_a_wrong_scale_is_measured(axis, scale):
    best = explain(answers(Hypothesis(scale=scaled(axis, scale)), friction=True), PLACE)[0]
    assert best.fits
    assert best.hypothesis.scale == pytest.approx(scaled(axis, scale), rel=0.02)


def test_a_machine_beside_the_fixture_may_be_that_or_a_wrong_scale():
    found = explain(answers(Hypothesis(), friction=True, start=(START[0] + 1.2e-3, START[1] + 0.8e-3)), PLACE)
    assert found[0].hypothesis.mistakes
    away = elsewhere(found)
    assert away is not None
    assert away.hypothesis == Hypothesis()
    assert away.beside == pytest.approx(1.44e-3, rel=0.3)


def test_motion_that_no_installation_makes_is_not_explained():
    rng = np.random.default_rng(3)
    noise = [push._replace(moved=ENOUGH * rng.normal(size=3)) for push in answers(Hypothesis(), friction=True)]
    found = explain(noise, PLACE)
    assert not found or not found[0].fits
