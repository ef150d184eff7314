"""Which installation explains the answers to pushes: every single mistake, with and without dry friction."""

from functools import cache

import numpy as np
import pytest

from torquerig.calibration.stiction_fit import along
from torquerig.calibration.wiring import FITS, Geometry, Hypothesis, Push, directions, explain
from torquerig.mechanism import HOME, Manipulator

MODEL = Manipulator.thesis()
PLACE = Geometry(MODEL.jacobians(HOME)[1], MODEL.task_inertia(HOME))
ALONE = list(np.eye(3))
PAIRS = [np.sign(along(PLACE.S, held)) for held in range(3)]


@cache
def way(torque: tuple[float, ...], *, friction: bool) -> np.ndarray:
    """Where the joints go: the first blend is frictionless, the fifth ruled by friction."""
    return directions(np.array(torque), PLACE)[4 if friction else 0]


def answers(truth: Hypothesis, *, friction: bool) -> list[Push]:
    made = []
    for pattern in (*ALONE, *PAIRS):
        given = np.zeros(3)
        given[list(truth.motors)] = np.array(truth.torque_sign) * pattern
        if truth.slipping is not None and given[truth.slipping]:
            seen = np.eye(3)[truth.slipping] * np.sign(given[truth.slipping])
        else:
            seen = np.array(truth.encoder_sign) * way(tuple(given), friction=friction)[list(truth.encoders)]
            if truth.scaled is not None:
                seen[truth.scaled] *= truth.scale
        made += [Push(pattern, 4e-3 * seen), Push(-pattern, -4e-3 * seen)]
    return made


def flipped(axis: int) -> tuple[int, ...]:
    return tuple(-1 if each == axis else 1 for each in range(3))


SWAPS = [(1, 0, 2), (0, 2, 1), (2, 1, 0), (1, 2, 0), (2, 0, 1)]
MISTAKES = [
    Hypothesis(),
    *(Hypothesis(torque_sign=flipped(axis)) for axis in range(3)),
    *(Hypothesis(encoder_sign=flipped(axis)) for axis in range(3)),
    *(Hypothesis(torque_sign=flipped(axis), encoder_sign=flipped(axis)) for axis in range(3)),
    *(Hypothesis(motors=legs) for legs in SWAPS),
    *(Hypothesis(encoders=legs) for legs in SWAPS),
    *(Hypothesis(motors=legs, encoders=legs) for legs in SWAPS),
    *(Hypothesis(slipping=leg) for leg in range(3)),
]


@pytest.mark.parametrize("friction", [False, True])
@pytest.mark.parametrize("truth", MISTAKES, ids=lambda each: "; ".join(each.words()) or "none")
def test_each_mistake_is_named(truth, friction):
    best = explain(answers(truth, friction=friction), PLACE)[0]
    assert list(best.hypothesis.words()) == list(truth.words())
    assert best.misfit < FITS / 2


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("scale", [0.5, 0.85, 1.25, 2.0])
def test_a_wrong_scale_is_measured(axis, scale):
    best = explain(answers(Hypothesis(scaled=axis, scale=scale), friction=True), PLACE)[0].hypothesis
    assert best.scaled == axis
    assert best.scale == pytest.approx(scale, rel=0.02)


def test_motion_that_no_installation_makes_is_not_explained():
    rng = np.random.default_rng(3)
    noise = [Push(pattern, rng.normal(size=3)) for pattern in (*ALONE, *PAIRS, *ALONE, *PAIRS)]
    assert explain(noise, PLACE)[0].misfit > FITS
