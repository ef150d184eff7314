"""The motion that `loop.motion` names: a test motion of the thesis, a built-in one, or a trajectory file."""

from pathlib import Path
from typing import Final, NamedTuple, cast

from torquerig.building import period_ns
from torquerig.control.circle import Circle
from torquerig.control.motions import Motion, OutAndBack
from torquerig.control.polyline import Polyline
from torquerig.control.profile import TrapezoidalAcceleration
from torquerig.control.trajectory import Trajectory
from torquerig.feasibility import Place, check_motion, check_points
from torquerig.mechanism import Manipulator
from torquerig.schema import Rig
from torquerig.schema_values import CIRCLE, CORNER
from torquerig.trajectory_file import read_trajectory

CLOSED: Final = 1e-9
"""[m] A motion that ends so near to its start is one that ends there."""


class Chosen(NamedTuple):
    """A motion and its ends.

    Attributes:
        motion: The motion.
        start: Where it starts, (x, y) [m].
        end: Where it ends, (x, y) [m].
    """

    motion: Motion
    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def is_closed(self) -> bool:
        """Whether it ends where it starts."""
        return max(abs(a - b) for a, b in zip(self.start, self.end, strict=True)) <= CLOSED


def choose_motion(rig: Rig, model: Manipulator) -> Chosen:
    """The motion that is to be run; one of the user's is held against all limits.

    Args:
        rig: The configuration.
        model: The machine as the controller knows it.

    Returns:
        The motion.

    Raises:
        MotionError: The trajectory file cannot be used, or the machine could not follow the motion.
    """
    match rig.loop.motion:
        case 1 | 2 as number:
            stroke = rig.motion.of(number)
            profile = TrapezoidalAcceleration(stroke.stroke, stroke.speed, stroke.acceleration, stroke.tj)
            return Chosen(OutAndBack(rig.model.home, profile), rig.model.home, rig.model.home)
        case "circle":
            return _checked(_circle(rig), rig, model, lambda t: f"motion.{CIRCLE} at {t:.3f} s")
        case "corner":
            return _checked(_corner(rig), rig, model, lambda t: f"motion.{CORNER} at {t:.3f} s")
        case path:
            return _from_file(Path(path), rig, model)


def _circle(rig: Rig) -> Circle:
    """The circle of `motion.circle`."""
    table = rig.motion.circle
    return Circle.laps(
        table.centre,
        table.radius,
        table.laps,
        speed=table.speed,
        acceleration=table.acceleration,
        ramp=table.tj,
        turn=-1 if table.clockwise else 1,
    )


def _corner(rig: Rig) -> Polyline:
    """The path of `motion.corner`: so many laps through all corners, and back to the first."""
    table = rig.motion.corner
    corners = [*table.corners * table.laps, table.corners[0]]
    return Polyline.through(corners, speed=table.speed, acceleration=table.acceleration, ramp=table.tj)


def _from_file(path: Path, rig: Rig, model: Manipulator) -> Chosen:
    """The motion through the points of a file; the points are checked first, for they have lines of their own."""
    file = read_trajectory(path)
    check_points(file.times, file.points, model, rig.limits, file.place)
    return _checked(Trajectory(file.times, file.points), rig, model, file.place)


def _checked(motion: Motion, rig: Rig, model: Manipulator, place: Place) -> Chosen:
    """A motion that the machine can follow, with its ends."""
    check_motion(motion, model, rig.limits, period_ns(rig), place)
    ends = (tuple(motion.at(t).position.tolist()) for t in (0.0, motion.duration))
    start, end = cast("tuple[tuple[float, float], tuple[float, float]]", tuple(ends))
    return Chosen(motion, start, end)
