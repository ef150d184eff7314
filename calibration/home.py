"""The home procedure: drives take the fixture's pose for home, and a small round shows whether the legs close."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.conductor import Conductor
from torquerig.calibration.following import move
from torquerig.calibration.procedure import Bounds, Column, Doubt, Estimate, Plan, Result, Start, Table, Verdict
from torquerig.control.motions import SmoothMove
from torquerig.mechanism import Manipulator, MechanismError

Vector = NDArray[np.float64]

CLOSES: Final = 20e-6
"""[m] Residual up to which the legs close: ten times what the encoders' counts make of it; our choice."""
OPEN: Final = 300e-6
"""[m] Residual from which home must not be used: about that of one zero 1° off; our choice."""
_SPEED: Final = 0.02  # [m/s]
_ACCELERATION: Final = 0.2  # [m/s²]
_JOINT_SPEED: Final = 2.0  # [rad/s]: 0.02 m/s turn a joint by 0.6 rad/s at most; twice that, and breaking loose
_PAUSE: Final = 0.1  # [s] at each corner
_COVERED: Final = 0.5  # of its travel that each joint must cover; friction leaves 0.55 of the smallest round


class Round(NamedTuple):
    """How much of the round was made.

    Attributes:
        farthest: From the fixture [m].
        missed: How near each corner was come to, shape (4,) [m].
        covered: Share of its planned travel that each joint covered, shape (3,).
    """

    farthest: float
    missed: Vector
    covered: Vector


class Around(NamedTuple):
    """What was measured.

    Attributes:
        q: Joint angles in every cycle, shape (m, 3) [rad].
        was_homed: Whether the drives said before that they were homed.
    """

    q: Vector
    was_homed: bool


class Drawing(NamedTuple):
    """What the figure shows.

    Attributes:
        position: By forward kinematics, shape (m, 2) [m].
        residual: Of each leg, shape (m, 3) [m].
    """

    position: Vector
    residual: Vector


@dataclass(frozen=True, slots=True)
class HomeProcedure:
    """Homes all drives anew and checks what the redundant leg says.

    Attributes:
        model: The mechanism.
        place: The end-effector in the fixture [m].
        reach: Half the side of the square that it goes round [m].
        torque: The most that is used [N·m at the motor].
        name: As the command line calls it.
        start: Homing comes before enabling.
    """

    model: Manipulator
    place: tuple[float, float]
    reach: float
    torque: float
    name: str = "home"
    start: Start = Start.AS_FOUND

    def legs(self) -> list[SmoothMove]:
        """The moves: out to a corner, round the square, and back."""
        stops = [self.place, *((float(x), float(y)) for x, y in self._corners()), self.place]
        return [SmoothMove.within(a, b, speed=_SPEED, acceleration=_ACCELERATION) for a, b in pairwise(stops)]

    def plan(self) -> Plan:
        """Home, and one round."""
        lasts = sum(leg.duration + _PAUSE for leg in self.legs())
        theta = self.model.inverse_kinematics(self.place).theta
        travel = float(np.abs(self._angles(self._corners()) - theta).max())
        x, y = 1e3 * self.place[0], 1e3 * self.place[1]
        return Plan(
            "Home: the fixture's pose becomes home, checked by the redundant leg",
            (
                f"The machine stands in its home fixture, ({x:g}, {y:g}) mm, within 0.1 mm.",
                f"The fixture leaves it {1e3 * self.reach:g} mm of room: it moves as soon as it is homed.",
            ),
            (
                "All drives take their present position for home (CiA 402 homing, method 37 or 35 by their profile).",
                f"The end-effector goes round a square of {2e3 * self.reach:g} mm at {_SPEED:g} m/s, and back.",
                "Three joints say twice where it is: what disagrees is the residual of the closure.",
            ),
            Bounds(torque=self.torque, speed=_JOINT_SPEED, travel=1.5 * travel + 0.05, duration=1.5 * lasts + 1.0),
            lasts=lasts,
        )

    def _corners(self) -> Vector:
        """Where the square has its corners, shape (4, 2) [m]."""
        return np.array(self.place) + self.reach * np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)])

    def _angles(self, positions: Vector) -> Vector:
        """Joint angles at positions, shape (n, 3) [rad]."""
        return np.array([self.model.inverse_kinematics((x, y)).theta for x, y in positions])

    def measure(self, conductor: Conductor) -> Around:
        """Home, enable, go round."""
        conductor.say("homing")
        was_homed = conductor.group.is_homed
        conductor.group.home(anew=True)
        conductor.group.enable()
        conductor.rest("at home", _PAUSE)
        for number, leg in enumerate(self.legs(), start=1):
            move(conductor, f"round, part {number}", self.model, leg, torque=self.torque, hold=_PAUSE)
        conductor.settle()
        return Around(conductor.notebook.trace().q, was_homed)

    def evaluate(self, measured: Around) -> Result:
        """The residuals of the closure."""
        try:
            position = np.array([self.model.forward_kinematics(q) for q in measured.q])
            residual = np.array([self.model.closure_residuals(q) for q in measured.q])
        except MechanismError as error:
            return Result(Verdict.of(failures=[Doubt(f"the angles are no pose: {error}", "Run direction first.")]))
        largest = float(np.abs(residual).max())
        at_home = float(np.abs(residual[0]).max())
        made = self._made(measured.q, position)
        moved = made.farthest
        return Result(
            _verdict(largest, made, self.reach),
            estimates=(
                Estimate("largest residual of the closure", 1e6 * largest, np.nan, np.nan, "µm"),
                Estimate("residual in the fixture", 1e6 * at_home, np.nan, np.nan, "µm"),
                Estimate("farthest from the fixture", 1e3 * moved, np.nan, np.nan, "mm"),
            ),
            facts={
                "residual_um": 1e6 * largest,
                "residual_at_home_um": 1e6 * at_home,
                "moved_mm": 1e3 * moved,
                "was_homed": measured.was_homed,
            },
            tables=(_table(position, residual),),
            drawing=Drawing(position, residual),
        )

    def _made(self, q: Vector, position: Vector) -> Round:
        """Hold what was gone against what was planned."""
        corners = self._corners()
        planned = self._angles(np.vstack([self.place, corners]))
        return Round(
            float(np.linalg.norm(position - position[0], axis=1).max()),
            np.linalg.norm(position[:, None] - corners, axis=2).min(axis=0),
            np.ptp(q, axis=0) / np.ptp(planned, axis=0),
        )


def _verdict(largest: float, made: Round, reach: float) -> Verdict:
    """By how well the legs close, and whether the round was made: legs that stand still close too."""
    if made.farthest < reach / 2:
        return Verdict.of(
            failures=[
                Doubt(
                    f"the end-effector moved by {1e3 * made.farthest:.2g} mm only, where {1e3 * reach:g} mm"
                    " were asked for",
                    "Take the fixture off, or see whether friction is more than --torque.",
                )
            ]
        )
    if failures := list(_not_made(made, reach)):
        return Verdict.of(failures=failures)
    found = Doubt(
        f"the legs close within {1e6 * largest:.0f} µm only; ok is {1e6 * CLOSES:.0f}, unusable {1e6 * OPEN:.0f} µm",
        "Set the fixture right and home again; then find the zeros (torquerig calibrate zeros), or look at direction.",
    )
    if largest >= OPEN:
        return Verdict.of(failures=[found])
    return Verdict.of(suspicions=[found] if largest > CLOSES else [])


def _not_made(made: Round, reach: float) -> Iterator[Doubt]:
    """What of the round is missing. The fixture is 1.4 reaches from a corner, friction leaves 0.8 of the smallest."""
    advice = "Look at the signs of the axes first: torquerig calibrate direction."
    # the negation catches NaN as well
    if not made.missed.max() < reach:
        yield Doubt(
            f"the round was not made: a corner was missed by {1e3 * made.missed.max():.2g} mm, {1e3 * reach:g} mm is"
            " the most",
            advice,
        )
    for joint, share in enumerate(made.covered, start=1):
        if not share >= _COVERED:
            yield Doubt(
                f"joint {joint} covered {100 * share:.0f} % of its planned travel, {100 * _COVERED:.0f} % is the least",
                advice,
            )


def _table(position: Vector, residual: Vector) -> Table:
    columns = [Column(f"position_{name}", "m", part) for name, part in zip("xy", position.T, strict=True)]
    columns += [Column(f"residual_{leg}", "m", part) for leg, part in enumerate(residual.T, start=1)]
    return Table("closure", tuple(columns))
