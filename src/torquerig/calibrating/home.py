"""What the application adds to the home procedure."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from torquerig.building import manipulator
from torquerig.calibrating.offer import Offer, Option, Request
from torquerig.calibration.home import CLOSES, Drawing, HomeProcedure
from torquerig.calibration.procedure import Result
from torquerig.configuration import Configuration
from torquerig.errors import ConfigurationError
from torquerig.picture import COLOURS, DESIRED, drawing


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


def truth(configuration: Configuration, request: Request) -> Mapping[str, Any]:
    """Where the simulated machine stands when it is homed, and how far the legs then miss each other on the round.

    Every joint tells its angle at home plus what it turned since; the machine goes round about where it stands.
    """
    rig = configuration.rig
    model, true = (manipulator(each.model, each.model) for each in (rig, configuration.simulated))
    reach = request.options["reach"] / 1e3
    stands = np.array(rig.simulator.stands_at or rig.model.home)
    places = stands + reach * np.array([(0, 0), (1, 1), (1, -1), (-1, -1), (-1, 1)])
    zeros = np.array([axis.encoder_zero for axis in rig.axes.legs])
    off = model.inverse_kinematics(rig.model.home).theta + zeros - true.inverse_kinematics(stands).theta
    residuals = [model.closure_residuals(true.inverse_kinematics(place).theta + off) for place in places]
    return {
        "home_m": stands.tolist(),
        "beside_mm": 1e3 * float(np.linalg.norm(stands - rig.model.home)),
        "residual_um": 1e6 * float(np.abs(residuals).max()),
        "residual_at_home_um": 1e6 * float(np.abs(residuals[0]).max()),
    }


def draw(result: Result, title: str, path: Path) -> None:
    """The round, and how well the legs closed on it."""
    shown = result.drawing
    with drawing(title, path, (11.0, 6.0)) as figure:
        if not isinstance(shown, Drawing):
            figure.text(0.05, 0.5, "The angles are no pose of the mechanism.")
            return
        left, right = figure.subplots(1, 2)
        left.set_title("The round")
        left.plot(*(1e3 * shown.position).T, color=COLOURS[0], linewidth=1.4)
        left.plot(*(1e3 * shown.position[0]), marker="o", color=COLOURS[1], linestyle="none", label="fixture")
        left.set_aspect("equal", adjustable="datalim")
        left.set_xlabel("x [mm]")
        left.set_ylabel("y [mm]")
        left.legend()
        right.set_title("Residual of the closure (dotted: ok)")
        right.plot(1e6 * shown.residual[:, 0], color=COLOURS[0], linewidth=1.0)
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
