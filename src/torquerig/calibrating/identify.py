"""What the application adds to the identification procedure."""

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from torquerig import building
from torquerig.calibrating.identify_figure import draw, draw_excitations
from torquerig.calibrating.offer import Offer, Option, Request
from torquerig.calibration import excitations
from torquerig.calibration.design import Search, search
from torquerig.calibration.differentiation import WINDOW
from torquerig.calibration.driving import prepare
from torquerig.calibration.excitation import Envelope, FourierMotion, worth
from torquerig.calibration.identify import IdentifyProcedure
from torquerig.configuration import Configuration
from torquerig.control.laws import law_named
from torquerig.control.loop import Controller
from torquerig.delays import action_delay
from torquerig.errors import ConfigurationError
from torquerig.experiment import rehearse
from torquerig.schema import Rig

LAW: Final = "computed-torque"
"""It works on the end-effector: joints whose zeros are off do not fight each other."""
GAINS_OF: Final = 1
TRACKING: Final = 0.003
"""What the machine may be off its path by; the excitation keeps so far from the limits [m]."""
SHARE: Final = 0.8
"""Of the torque limit that an excitation may ask for: what is left is the controller's."""


def make(configuration: Configuration, request: Request) -> IdentifyProcedure:
    """The procedure for a rig.

    Raises:
        ConfigurationError: An option is out of range, or the excitation does not keep to the rig's limits.
    """
    rig, options = configuration.rig, request.options
    if request.axis is not None:
        raise ConfigurationError("--axis cannot be: identification moves all axes, their unknowns are the same")
    if not 0 < options["torque"] <= rig.limits.torque:
        raise ConfigurationError(
            f"--torque {options['torque']:g} N·m cannot be: above 0 and at most limits.torque = {rig.limits.torque:g}"
        )
    if not 1 <= options["periods"] <= 100:
        raise ConfigurationError(f"--periods {options['periods']} cannot be: 1 to 100")
    lag = rig.latency.current_lag if options["lag"] is None else options["lag"]
    if not 0 <= lag <= 0.01:
        raise ConfigurationError(f"--lag {lag:g} s cannot be: 0 to 0.01, a current loop's time constant")
    controller = task_controller(rig, options["torque"])
    fit, validation = _motions(rig, controller, options)
    if options["picture"] is not None:
        _require_writable(options["picture"])
        draw_excitations(controller.model, (fit, validation), options["picture"])
    period = building.period_ns(rig)
    tables = [prepare(controller, motion, period) for motion in (fit, validation)]
    rehearse(controller, tables[0])
    return IdentifyProcedure(
        controller,
        (fit, tables[0]),
        (validation, tables[1]),
        options["torque"],
        action_delay(rig, lag),
    )


def _require_writable(picture: Path) -> None:
    """See that a picture can be drawn into a place.

    Raises:
        ConfigurationError: It cannot.
    """
    if picture.suffix.lower() != ".png":
        raise ConfigurationError(f"--picture {picture} cannot be: its name must end in .png")
    if not picture.parent.is_dir():
        raise ConfigurationError(f"--picture {picture} cannot be written: there is no folder {picture.parent}")
    if not os.access(picture if picture.exists() else picture.parent, os.W_OK):
        raise ConfigurationError(f"--picture {picture} cannot be written: there is no permission")


def task_controller(rig: Rig, torque: float) -> Controller:
    """A controller that holds the end-effector to a path: computed torque with the limits of the rig.

    Args:
        rig: The configuration.
        torque: To which motor torques are cut [N·m at the motor].
    """
    usual = building.controller(rig)
    law = law_named(LAW)
    kp, kv = law.gains[GAINS_OF]
    return replace(usual, law=law(usual.model, kp, kv, friction=True), limits=replace(usual.limits, torque=torque))


def _motions(rig: Rig, controller: Controller, options: Mapping[str, Any]) -> tuple[FourierMotion, FourierMotion]:
    """The shipped excitations if the rig's limits allow them, or newly sought ones."""
    limits = rig.limits
    envelope = Envelope(
        x=(limits.workspace_x[0] + TRACKING, limits.workspace_x[1] - TRACKING),
        y=(limits.workspace_y[0] + TRACKING, limits.workspace_y[1] - TRACKING),
        joint_speed=limits.joint_speed,
        torque=SHARE * options["torque"],
        conditioning=limits.conditioning,
    )
    model, seed = controller.model, options["design"]
    if seed is not None:
        wanted = Search(model, envelope, start=rig.model.home)
        try:
            found = [search(wanted, seed=each).motion for each in (seed, seed + 1)]
        except ValueError as error:
            raise ConfigurationError(f"--design {seed}: {error}") from None
    else:
        found = [excitations.FIT, excitations.VALIDATION]
        objections = [words for motion in found for words in worth(model, motion, window=WINDOW).objections(envelope)]
        if objections:
            raise ConfigurationError(
                f"the shipped excitation does not keep to this rig's limits ({'; '.join(objections)}): --design 1 looks"
                " for another one"
            )
    fit, validation = (replace(motion, periods=options["periods"]) for motion in found)
    return fit, validation


def truth(configuration: Configuration, _request: Request) -> Mapping[str, Any]:
    """What the simulated machine's actuators are."""
    rig = configuration.rig
    plant = rig.plant[rig.simulator.plant]
    return {
        "I1": plant.actuator_inertia,
        "K1": plant.active_viscous,
        "K2": plant.passive_viscous,
        "Fc": float(np.mean(plant.coulomb)),
    }


OFFER: Final = Offer(
    make=make,
    draw=draw,
    truth=truth,
    options=(
        Option("periods", int, 2, "Of each motion, 1.75 s each.", "N"),
        Option("torque", float, 0.45, "To which motor torques are cut [N·m at the motor].", "NM"),
        Option("lag", float, None, "Time constant of the current loops; default: latency.current_lag [s].", "S"),
        Option("design", int, None, "Look for new excitations, from this seed; takes 20 s.", "SEED"),
        Option("picture", Path, None, "Draw the excitations into this PNG before anything moves.", "FILE"),
    ),
)
