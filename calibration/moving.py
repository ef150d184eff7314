"""Jogging and holding: what a person needs before any procedure, under low limits."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.conductor import Conductor
from torquerig.calibration.following import holding, move
from torquerig.calibration.guard import Guard, Room
from torquerig.calibration.notebook import Trace
from torquerig.calibration.procedure import Bounds, Doubt, Estimate, Plan, Result, Start, Verdict
from torquerig.control.motions import SmoothMove
from torquerig.mechanism import Manipulator

Vector = NDArray[np.float64]

SPEED: Final = 0.02
"""Of the end-effector [m/s]; our choice: slow enough to let go of a key."""
_ACCELERATION: Final = 0.2  # [m/s²]
_JOINT_SPEED: Final = 2.0  # [rad/s]: 0.02 m/s turn a joint by 0.6 rad/s at most; the rest is for breaking loose
_ROOM: Final = 0.1  # [rad] of travel beyond what the move needs
_TURNS: Final = 20  # steps of Newton's method towards an angle
_SHARE: Final = 0.5  # of a jog that is made at least; dry friction leaves 0.68 of one of 1 mm
_CLOSE: Final = 1e-9  # [rad] at which it ends


@dataclass(frozen=True, slots=True)
class Jog:
    """Moves the end-effector by a small way, or a joint by a small angle, and holds.

    Attributes:
        model: The mechanism.
        way: By how much, (x, y) [m]; where `turn` is given it is not used.
        turn: Joint, from 0, and angle [rad]; None for a way.
        reach: How far the end-effector may be moved at most [m].
        torque: The most that is used [N·m at the motor].
        hold: How long the end is held [s].
        room: Where the end-effector may be.
        name: As the command line calls it.
        start: Poses have to mean something.
    """

    model: Manipulator
    way: tuple[float, float]
    turn: tuple[int, float] | None
    reach: float
    torque: float
    hold: float
    room: Room
    name: str = "jog"
    start: Start = Start.HOMED

    def plan(self) -> Plan:
        """One slow move."""
        lasts = 2 * self.reach / SPEED + self.hold
        what = (
            f"The end-effector goes by ({1e3 * self.way[0]:g}, {1e3 * self.way[1]:g}) mm"
            if self.turn is None
            else f"Joint {self.turn[0] + 1} turns by {np.degrees(self.turn[1]):g}°, by the shortest way"
        )
        travel = _ROOM + (4 * self.reach / self.model.link_length if self.turn is None else 2 * abs(self.turn[1]))
        return Plan(
            "Jog",
            ("Drives that were not homed take the present pose for that of the home fixture.",),
            (f"{what}, at {SPEED:g} m/s.", f"There it is held for {self.hold:g} s, and let go."),
            Bounds(torque=self.torque, speed=_JOINT_SPEED, travel=travel, duration=lasts + 1.0),
            lasts=lasts,
        )

    def measure(self, conductor: Conductor) -> Trace:
        """Move and hold."""
        conductor.rest("looking", 2 * conductor.period_ns / 1e9)
        x, y = self.model.forward_kinematics(conductor.notebook.last_q).tolist()
        target = (x + self.way[0], y + self.way[1]) if self.turn is None else self._turned(np.array([x, y]))
        self.room.require(target, self.room.outside((x, y)))
        motion = SmoothMove.within((x, y), target, speed=SPEED, acceleration=_ACCELERATION)
        order = self.model.inverse_kinematics(target).theta - self.model.inverse_kinematics((x, y)).theta
        guard = Guard(self.model, conductor.notebook.last_q, order, self.room)
        return move(conductor, "moving", self.model, motion, torque=self.torque, hold=self.hold, guard=guard.look)

    def evaluate(self, measured: Trace) -> Result:
        """Where it went."""
        begin, end = (self.model.forward_kinematics(q) for q in (measured.q[0], measured.q[-1]))
        went, turned = 1e3 * (end - begin), np.degrees(measured.q[-1] - measured.q[0])
        estimates = [
            Estimate(f"moved along {name}", float(way), np.nan, np.nan, "mm")
            for name, way in zip("xy", went, strict=True)
        ]
        estimates += [
            Estimate(f"joint {joint} turned", float(angle), np.nan, np.nan, "°")
            for joint, angle in enumerate(turned, 1)
        ]
        facts = {
            "moved_mm": went.tolist(),
            "turned_deg": turned.tolist(),
            "position_mm": (1e3 * end).tolist(),
            "peak_torque_nm": float(np.abs(measured.torque).max()),
        }
        return Result(Verdict.of(suspicions=list(self._short(went, turned))), estimates=tuple(estimates), facts=facts)

    def _short(self, way: Vector, turned: Vector) -> Iterator[Doubt]:
        """Whether less than half of what was asked for was made, of the way [mm] or of the turn [deg]."""
        if self.turn is None:
            asked = 1e3 * np.array(self.way)
            share, words = float(way @ asked / (asked @ asked)), f"of the {np.linalg.norm(asked):g} mm asked for"
        else:
            joint, angle = self.turn[0], float(np.degrees(self.turn[1]))
            share, words = float(turned[joint] / angle), f"of the {angle:g}° asked for joint {joint + 1}"
        if not share >= _SHARE:
            yield Doubt(
                f"{100 * share:.0f} % {words} were made",
                "Friction may be more than --torque, or an axis reversed: torquerig calibrate direction.",
            )

    def _turned(self, position: Vector) -> tuple[float, float]:
        """The nearest place where a joint has another angle: Newton's method along the joint's own gradient."""
        assert self.turn is not None  # noqa: S101  (the caller looked)
        joint, angle = self.turn
        wanted = float(self.model.inverse_kinematics(position).theta[joint]) + angle
        for _ in range(_TURNS):
            missing = wanted - float(self.model.inverse_kinematics(position).theta[joint])
            if abs(missing) < _CLOSE:
                break
            gradient = self.model.jacobians(position)[1][joint]
            position = position + missing * gradient / float(gradient @ gradient)
        x, y = position.tolist()
        return x, y


@dataclass(frozen=True, slots=True)
class Hold:
    """Holds every joint where it stands; positions need no meaning.

    Attributes:
        seconds: How long [s].
        torque: The most that is used [N·m at the motor].
        name: As the command line calls it.
        start: Nothing is homed.
    """

    seconds: float
    torque: float
    name: str = "hold"
    start: Start = Start.ENABLED

    def plan(self) -> Plan:
        """Stay."""
        return Plan(
            "Hold: every joint stays where it stands",
            (),
            (
                f"Each motor pulls its joint back with at most {self.torque:g} N·m.",
                f"That lasts {self.seconds:g} s; then they let go.",
            ),
            Bounds(torque=self.torque, speed=_JOINT_SPEED, travel=_ROOM, duration=self.seconds + 1.0),
            lasts=self.seconds,
        )

    def measure(self, conductor: Conductor) -> Trace:
        """Hold the pose of the first sample."""
        conductor.rest("looking", 2 * conductor.period_ns / 1e9)
        return conductor.drive("holding", self.seconds, holding(conductor.notebook.last_q, self.torque))

    def evaluate(self, measured: Trace) -> Result:
        """How far it was pushed away, and what that took."""
        away = float(np.degrees(np.abs(measured.q - measured.q[0]).max()))
        torque = float(np.abs(measured.torque).max())
        return Result(
            Verdict(),
            estimates=(
                Estimate("farthest from the pose", away, np.nan, np.nan, "°"),
                Estimate("greatest torque", torque, np.nan, np.nan, "N·m"),
            ),
            facts={"away_deg": away, "peak_torque_nm": torque, "seconds": float(measured.t[-1])},
        )
