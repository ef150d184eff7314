"""What the application adds to the home procedure."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from torquerig.building import manipulator
from torquerig.calibrating.figure import COLOURS, DESIRED, drawn
from torquerig.calibrating.offer import Offer, Option, Request
from torquerig.calibration.home import CLOSES, Drawing, HomeProcedure
from torquerig.calibration.procedure import Result
from torquerig.configuration import Configuration
from torquerig.errors import ConfigurationError


def make(configuration: Configuration, request: Request) -> HomeProcedure:
    """The procedure for a rig.

    Raises:
        ConfigurationError: An option is out of range, or one axis is asked for.
    """
    if request.axis is not None:
        raise ConfigurationError("home is a pose of all axes together: leave --axis out")
    rig = configuration.rig
    reach, torque = request.options["reach"], request.options["torque"]
    if not 0.5 <= reach <= 10:
        raise ConfigurationError(f"--reach {reach:g} mm cannot be: 0.5 to 10")
    if not 0 < torque <= rig.limits.torque:
        raise ConfigurationError(
            f"--torque {torque:g} N·m cannot be: above 0, at most limits.torque = {rig.limits.torque:g}"
        )
    return HomeProcedure(manipulator(rig.model, rig.model), rig.model.home, reach / 1e3, torque)


def truth(configuration: Configuration, _request: Request) -> Mapping[str, Any]:
    """Where the simulated machine stands when it is homed."""
    return {"home_m": list(configuration.rig.model.home), "residual_um": 0.0}


def draw(result: Result, title: str, path: Path) -> None:
    """The round, and how well the legs closed on it."""
    drawing = result.drawing
    with drawn(path, title) as figure:
        if not isinstance(drawing, Drawing):
            figure.text(0.05, 0.5, "The angles are no pose of the mechanism.")
            return
        left, right = figure.subplots(1, 2)
        left.set_title("The round")
        left.plot(*(1e3 * drawing.position).T, color=COLOURS[0], linewidth=1.4)
        left.plot(*(1e3 * drawing.position[0]), marker="o", color=COLOURS[1], linestyle="none", label="fixture")
        left.set_aspect("equal", adjustable="datalim")
        left.set_xlabel("x [mm]")
        left.set_ylabel("y [mm]")
        left.legend()
        right.set_title("Residual of the closure, the same for all legs (dotted: ok)")
        right.plot(1e6 * drawing.residual[:, 0], color=COLOURS[0], linewidth=1.0)
        for bound in (-CLOSES, CLOSES):
            right.axhline(1e6 * bound, color=DESIRED, linewidth=1.0, linestyle=":")
        right.set_xlabel("cycle")
        right.set_ylabel("|C - B| - L [µm]")


OFFER: Final = Offer(
    make=make,
    draw=draw,
    truth=truth,
    options=(
        Option("reach", float, 4.0, "Half the side of the square that is gone round [mm].", "MM"),
        Option("torque", float, 0.2, "The most that is used [N·m at the motor].", "NM"),
    ),
)
