"""What the application adds to jogging and holding."""

from collections.abc import Mapping
from math import hypot, radians
from pathlib import Path
from typing import Any, Final

from torquerig.building import manipulator
from torquerig.calibrating.offer import Offer, Request
from torquerig.calibration.guard import Room
from torquerig.calibration.moving import Hold, Jog
from torquerig.calibration.procedure import Result
from torquerig.configuration import Configuration
from torquerig.errors import ConfigurationError

FARTHEST: Final = 0.02
"""How far the end-effector may be jogged at once [m]; our choice."""
WIDEST: Final = 10.0
"""How far a joint may be jogged at once [deg]; our choice."""


def make_jog(configuration: Configuration, request: Request) -> Jog:
    """A jog for a rig.

    Raises:
        ConfigurationError: What is asked for is too far, too much, or not clear.
    """
    options = request.options
    by, x, y, hold = options["by"], options["x"], options["y"], options["hold"]
    along = x is not None or y is not None
    if along == (request.axis is not None) or (request.axis is None) != (by is None):
        raise ConfigurationError("jog either a joint (--axis N --by DEG) or the end-effector (--x MM, --y MM)")
    model = manipulator(configuration.rig.model, configuration.rig.model)
    torque, limits = _torque(configuration, options), configuration.rig.limits
    room = Room(limits.workspace_x, limits.workspace_y)
    if not 0 <= hold <= 3600:
        raise ConfigurationError(f"--hold {hold:g} s cannot be: 0 to 3600")
    if request.axis is not None:
        if not 0 < abs(by) <= WIDEST:
            raise ConfigurationError(
                f"--by {by:g}° cannot be: a jog turns a joint by at most {WIDEST:g}°, and not by 0"
            )
        return Jog(model, (0.0, 0.0), (request.axis - 1, radians(by)), FARTHEST, torque, hold, room)
    way = (x or 0.0) / 1e3, (y or 0.0) / 1e3
    if not 0 < hypot(*way) <= FARTHEST:
        far = 1e3 * hypot(*way)
        raise ConfigurationError(f"a jog of {far:g} mm cannot be: at most {1e3 * FARTHEST:g} mm at once, and not 0")
    return Jog(model, way, None, hypot(*way), torque, hold, room)


def make_hold(configuration: Configuration, request: Request) -> Hold:
    """A hold for a rig.

    Raises:
        ConfigurationError: The torque is out of range, or the time.
    """
    seconds = request.options["seconds"]
    if not 0 < seconds <= 86400:
        raise ConfigurationError(f"--seconds {seconds:g} cannot be: above 0 and at most a day")
    return Hold(seconds, _torque(configuration, request.options))


def _torque(configuration: Configuration, options: Mapping[str, Any]) -> float:
    torque = float(options["torque"])
    limit = configuration.rig.limits.torque
    if not 0 < torque <= limit:
        raise ConfigurationError(f"--torque {torque:g} N·m cannot be: above 0 and at most limits.torque = {limit:g}")
    return torque


def _no_picture(_result: Result, _title: str, _path: Path) -> None:
    """Nothing is drawn of a jog."""


JOG: Final = Offer(make=make_jog, draw=_no_picture)
HOLD: Final = Offer(make=make_hold, draw=_no_picture)
