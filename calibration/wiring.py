"""Which installation explains how the joints answer to pushes: signs, wiring, gear, couplings.

A push is a pattern of motor torques. What moves is known up to dry friction: without it the joints go along
S Mt^-1 S' tau; where it rules, one joint holds and the others go along S v_k (see `stiction_fit`), for the k whose
friction gives way first. An installation turns commanded torques into true ones and true motion into measured motion.
The one whose prediction fits all pushes is the explanation; of two that fit alike the one with fewer mistakes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations, product
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.stiction_fit import JOINTS, along

Vector = NDArray[np.float64]
Legs = tuple[int, int, int]
Signs = tuple[int, int, int]

FITS: Final = 0.2
"""Mean distance of unit vectors (0.2: 11 degrees) below which an installation explains what was measured."""
CLEARLY: Final = 1.6
"""How many times worse an installation with as few mistakes must fit to be ruled out; our choice."""
RIGHT_SCALE: Final = 0.05
"""How far a gear or an encoder may seem to be off before it is named: linear closure is as good as this."""
KEPT: Final = 0.75
"""Share of the pushes that count, the best explained ones: where friction falls once a joint moves, some go astray."""
CLOSURE: Final = 4.0
"""Weight of closing against direction: it holds whatever friction does, so that a gear 10 % off shows."""
_GIVES_WAY: Final = 0.8  # of the load at which the first joints give way: others, with unlike friction, may be first
_BLENDS: Final = (0.0, 0.25, 0.5, 0.75, 1.0)
_STRAIGHT: Legs = (0, 1, 2)
_PLUS: Signs = (1, 1, 1)


class Push(NamedTuple):
    """A push and its answer.

    Attributes:
        torque: Pattern of the commanded torques, shape (3,).
        moved: How far each joint moved, as its drive tells, shape (3,) [rad].
    """

    torque: Vector
    moved: Vector


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """An installation; axes and legs count from 0.

    Attributes:
        motors: Which leg's motor each axis feeds.
        encoders: Which leg's encoder each axis reads.
        torque_sign: -1 where an axis' torque is reversed.
        encoder_sign: -1 where an axis' encoder is reversed.
        scaled: Axis whose counts are off; None for none.
        scale: Measured over true motion of that axis.
        slipping: Leg whose coupling slips; None for none.
    """

    motors: Legs = _STRAIGHT
    encoders: Legs = _STRAIGHT
    torque_sign: Signs = _PLUS
    encoder_sign: Signs = _PLUS
    scaled: int | None = None
    scale: float = 1.0
    slipping: int | None = None

    @property
    def mistakes(self) -> int:
        """How many things are wrong; a drive that is exchanged or reversed as a whole is one."""
        moved = sum(
            motor != i or encoder != i
            for i, (motor, encoder) in enumerate(zip(self.motors, self.encoders, strict=True))
        )
        reversed_ = sum(-1 in pair for pair in zip(self.torque_sign, self.encoder_sign, strict=True))
        return moved // 2 + reversed_ + (self.scaled is not None) + (self.slipping is not None)

    def words(self) -> Iterator[str]:
        """What is wrong, a phrase each."""
        yield from _crossed(self.motors, self.encoders)
        for axis, (torque, encoder) in enumerate(zip(self.torque_sign, self.encoder_sign, strict=True), start=1):
            if torque < 0 and encoder < 0:
                yield f"axis {axis}: torque and encoder both count the other way (axes.{axis}.sign)"
            elif torque < 0:
                yield f"axis {axis}: wrong torque sign"
            elif encoder < 0:
                yield f"axis {axis}: wrong encoder sign"
        if self.scaled is not None:
            yield f"axis {self.scaled + 1}: wrong gear or encoder counts, it shows {self.scale:.3g} times its motion"
        if self.slipping is not None:
            yield f"axis {self.slipping + 1}: its motor turns and the joint does not: the coupling slips"


class Answer(NamedTuple):
    """An installation and how well it explains what was measured.

    Attributes:
        hypothesis: The installation.
        misfit: Root mean square distance of unit vectors, 0 to 2.
    """

    hypothesis: Hypothesis
    misfit: float


class Geometry(NamedTuple):
    """Where the pushes were made.

    Attributes:
        S: Joint rates per end-effector velocity, shape (3, 2) [1/m].
        Mt: Task inertia, shape (2, 2) [kg].
    """

    S: Vector
    Mt: Vector


def explain(pushes: Sequence[Push], geometry: Geometry) -> list[Answer]:
    """All installations, the best explanation first.

    Args:
        pushes: What was measured; pushes without an answer are no help and are left out.
        geometry: Where.

    Returns:
        Hypotheses by misfit; among those that fit about alike the one with the fewest mistakes first.
    """
    moving = [push for push in pushes if np.any(push.moved)]
    field = _Field(geometry)
    answers = [_judge(hypothesis, moving, field) for hypothesis in hypotheses()]
    best = min(answer.misfit for answer in answers)
    near = max(FITS / 2, CLEARLY * best)

    def rank(answer: Answer) -> tuple[bool, int, float]:
        fits = answer.misfit <= near
        return (not fits, answer.hypothesis.mistakes if fits else 0, answer.misfit)

    return sorted(answers, key=rank)


def hypotheses() -> Iterator[Hypothesis]:
    """Every combination of signs, every exchange of motors, encoders or drives, one wrong scale, one slipping leg."""
    for torque, encoder in product(product((1, -1), repeat=JOINTS), repeat=2):
        yield Hypothesis(
            torque_sign=(torque[0], torque[1], torque[2]), encoder_sign=(encoder[0], encoder[1], encoder[2])
        )
    for a, b, c in permutations(_STRAIGHT):
        if (a, b, c) != _STRAIGHT:
            yield Hypothesis(motors=(a, b, c))
            yield Hypothesis(encoders=(a, b, c))
            yield Hypothesis(motors=(a, b, c), encoders=(a, b, c))
    for axis in range(JOINTS):
        yield Hypothesis(scaled=axis)
        yield Hypothesis(slipping=axis)


def directions(torque: Vector, geometry: Geometry) -> Vector:
    """Where the joints may go under motor torques, unit vectors, shape (n, 3): frictionless to ruled by it."""
    S, Mt = geometry
    free = _unit(S @ np.linalg.solve(Mt, S.T @ torque))
    ways = [sense * along(S, held) for held in range(JOINTS) for sense in (1.0, -1.0)]
    loads = [float(way @ torque) / float(np.abs(way).sum()) for way in ways]
    most = max(loads)
    first = [_unit(way) for way, load in zip(ways, loads, strict=True) if load >= _GIVES_WAY * most]
    return np.array([_unit(blend * way + (1.0 - blend) * free) for way in first for blend in _BLENDS])


def _judge(hypothesis: Hypothesis, pushes: Sequence[Push], field: "_Field") -> Answer:
    """How well an installation explains pushes; the scale of one that has one is fitted first."""
    if hypothesis.scaled is not None:
        scale = _fitted_scale(hypothesis.scaled, pushes, field.closure)
        if not RIGHT_SCALE < abs(scale - 1.0) < 1e3 or scale < 1e-3:
            return Answer(hypothesis, 2.0)
        hypothesis = replace(hypothesis, scale=scale)
    squares = [_square(hypothesis, push, field) for push in pushes]
    kept = sorted(squares)[: max(1, round(KEPT * len(squares)))]
    return Answer(hypothesis, float(np.sqrt(np.mean(kept))) if squares else 2.0)


def _square(hypothesis: Hypothesis, push: Push, field: "_Field") -> float:
    """Squared distance from what was measured to the nearest that an installation predicts, and to closing."""
    given = np.zeros(JOINTS)
    given[list(hypothesis.motors)] = np.array(hypothesis.torque_sign) * push.torque
    measured = _unit(push.moved)
    slipping = hypothesis.slipping
    if slipping is not None and given[slipping]:
        # the rotor spins free of its joint; what the other motor does to the mechanism is small against that
        alone = np.zeros(JOINTS)
        alone[slipping] = np.sign(given[slipping])
        return float(np.sum((measured - alone) ** 2))
    factor = np.array(hypothesis.encoder_sign, dtype=np.float64)
    if hypothesis.scaled is not None:
        factor[hypothesis.scaled] *= hypothesis.scale
    encoders = list(hypothesis.encoders)
    seen = factor * field.directions(given)[:, encoders]
    seen /= np.linalg.norm(seen, axis=1, keepdims=True)
    true = np.zeros(JOINTS)
    true[encoders] = push.moved / factor
    opening = CLOSURE * float(field.closure @ _unit(true))
    return float(np.min(np.sum((measured - seen) ** 2, axis=1))) + opening**2


class _Field:
    """Where joints may go at one place, worked out once a torque."""

    def __init__(self, geometry: Geometry) -> None:
        self.closure: Vector = np.linalg.svd(geometry.S.T)[2][-1]
        self._geometry = geometry
        self._known: dict[tuple[float, ...], Vector] = {}

    def directions(self, torque: Vector) -> Vector:
        key = tuple(torque.tolist())
        if key not in self._known:
            self._known[key] = directions(torque, self._geometry)
        return self._known[key]


def _fitted_scale(axis: int, pushes: Sequence[Push], closure: Vector) -> float:
    """Measured over true motion of one axis, so that the mechanism closes: c (moved / scale) = 0."""
    moved = np.array([_unit(push.moved) for push in pushes])
    own = moved[:, axis] * closure[axis]
    others = own - moved @ closure
    return float(own @ own / (own @ others)) if own @ others else 0.0


def _crossed(motors: Legs, encoders: Legs) -> Iterator[str]:
    """Which cables are exchanged."""
    wrong_motors = [i + 1 for i, leg in enumerate(motors) if leg != i]
    wrong_encoders = [i + 1 for i, leg in enumerate(encoders) if leg != i]
    if wrong_motors and motors == encoders:
        yield f"axes {_list(wrong_motors)} are swapped (motors and encoders: drives or node-ids)"
    else:
        if wrong_motors:
            yield f"the motors of axes {_list(wrong_motors)} are swapped"
        if wrong_encoders:
            yield f"the encoders of axes {_list(wrong_encoders)} are swapped"


def _list(numbers: Sequence[int]) -> str:
    *others, last = map(str, numbers)
    return f"{', '.join(others)} and {last}"


def _unit(vector: Vector) -> Vector:
    length = float(np.linalg.norm(vector))
    unit: Vector = vector / length if length else vector
    return unit
