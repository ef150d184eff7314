"""What can be wrong between three drives and three legs: cables, signs, gears and counts, couplings; and its words."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import permutations, product
from typing import Final, NamedTuple

JOINTS: Final = 3
Legs = tuple[int, int, int]
Signs = tuple[int, int, int]
Scales = tuple[float, float, float]

STRAIGHT: Final[Legs] = (0, 1, 2)
PLUS: Final[Signs] = (1, 1, 1)
ORDERS: Final[tuple[Legs, ...]] = tuple((a, b, c) for a, b, c in permutations(STRAIGHT))
SIGNS: Final[tuple[Signs, ...]] = tuple((a, b, c) for a, b, c in product((1, -1), repeat=JOINTS))


class Gearing(NamedTuple):
    """What the drives are believed to be fitted with.

    Attributes:
        gears: axes.N.gear as configured.
        counts: axes.N.encoder_counts as configured.
    """

    gears: Scales
    counts: tuple[int, int, int]

    def advice(self, axis: int, scale: float) -> str:
        """What to look at when an axis, from 1, shows so many times its motion."""
        gear, counts = scale * self.gears[axis - 1], scale * self.counts[axis - 1]
        return (
            f"Look what is fitted: axes.{axis}.gear = {gear:.4g} would explain it, or axes.{axis}.encoder_counts ="
            f" {counts:.0f}; then repeat."
        )


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """An installation; axes and legs count from 0.

    Attributes:
        motors: Which leg's motor each axis feeds.
        encoders: Which leg's encoder each axis reads.
        torque_sign: -1 where an axis' torque is reversed.
        encoder_sign: -1 where an axis' encoder is reversed.
        scale: Measured over true motion of each axis; exactly 1 where gear and counts are right.
        slipping: Legs whose coupling slips.
    """

    motors: Legs = STRAIGHT
    encoders: Legs = STRAIGHT
    torque_sign: Signs = PLUS
    encoder_sign: Signs = PLUS
    scale: Scales = (1.0, 1.0, 1.0)
    slipping: tuple[int, ...] = ()

    @property
    def mistakes(self) -> int:
        """How many things are wrong; a drive that is exchanged or reversed as a whole is one."""
        reversed_ = sum(-1 in pair for pair in zip(self.torque_sign, self.encoder_sign, strict=True))
        scaled = sum(each != 1.0 for each in self.scale)
        return _exchanges(self.motors, self.encoders) + reversed_ + scaled + len(self.slipping)

    @property
    def is_sign_only(self) -> bool:
        """Whether nothing is wrong but that axes count the other way as a whole, which `axes.N.sign` sets right."""
        return self == Hypothesis(torque_sign=self.encoder_sign, encoder_sign=self.encoder_sign)

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
        for axis, (leg, scale) in enumerate(zip(self.encoders, self.scale, strict=True)):
            if scale != 1.0:
                what = "wrong gear or encoder counts"
                if leg != axis:
                    what = f"wrong encoder counts, or wrong gear at leg {leg + 1} whose encoder it reads"
                yield f"axis {axis + 1}: {what}, it shows {scale:.3g} times its motion"
        for leg in self.slipping:
            yield f"axis {leg + 1}: its motor turns and the joint does not: the coupling slips"


@cache
def _exchanges(motors: Legs, encoders: Legs) -> int:
    """How many exchanges of two drives, two motors or two encoders it takes at least."""
    return min(_swaps(drives) + _swaps(_after(motors, drives)) + _swaps(_after(encoders, drives)) for drives in ORDERS)


def _swaps(legs: Legs) -> int:
    """Exchanges of two that make an order of three: none, one, or two where it goes round."""
    return max(sum(leg != place for place, leg in enumerate(legs)) - 1, 0)


def _after(legs: Legs, drives: Legs) -> Legs:
    """The order that is left of `legs` when the drives are put back first."""
    a, b, c = (drives.index(leg) for leg in legs)
    return a, b, c


def _crossed(motors: Legs, encoders: Legs) -> Iterator[str]:
    """Which cables are exchanged."""
    wrong_motors = [i + 1 for i, leg in enumerate(motors) if leg != i]
    wrong_encoders = [i + 1 for i, leg in enumerate(encoders) if leg != i]
    if wrong_motors and motors == encoders:
        yield f"axes {_list(wrong_motors)} are swapped (motors and encoders: drives or node-ids)"
        return
    if wrong_motors:
        yield f"the motors of axes {_list(wrong_motors)} are swapped"
    if wrong_encoders:
        yield f"the encoders of axes {_list(wrong_encoders)} are swapped"


def _list(numbers: Sequence[int]) -> str:
    *others, last = map(str, numbers)
    return f"{', '.join(others)} and {last}"
