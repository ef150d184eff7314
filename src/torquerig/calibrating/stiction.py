"""What the application adds to the stiction procedure."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from torquerig.building import manipulator
from torquerig.calibrating.offer import Offer, Option, Request
from torquerig.calibration.procedure import Result
from torquerig.calibration.stiction import Drawing, Ramp, StictionProcedure
from torquerig.calibration.stiction_fit import Stiction
from torquerig.configuration import Configuration
from torquerig.errors import ConfigurationError
from torquerig.picture import COLOURS, drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ASSUMED_SCALE: Final = 0.0284
"""How far one average scale may be from each direction's: half of (20670 - 19528) / 20100 (thesis, 5.4.1)."""
CALIBRATED_SCALE: Final = 0.005
"""What the torque procedure promises of a slope."""


def make(configuration: Configuration, request: Request) -> StictionProcedure:
    """The procedure for a rig.

    Raises:
        ConfigurationError: An option is out of range.
    """
    options = request.options
    most, rate, repeats = options["most"], options["rate"], options["repeats"]
    limit = configuration.rig.limits.torque
    if not 0 < most <= limit:
        raise ConfigurationError(f"--most {most:g} N·m cannot be: above 0 and at most limits.torque = {limit:g}")
    if not 0 < rate <= 1:
        raise ConfigurationError(f"--rate {rate:g} N·m/s cannot be: above 0 and at most 1")
    if not 2 <= repeats <= 100:
        raise ConfigurationError(f"--repeats {repeats} cannot be: 2 to 100 ramps of each kind")
    model = manipulator(configuration.rig.model, configuration.rig.model)
    return StictionProcedure(model, most, rate, repeats, _scale_uncertainty(configuration), request.axes)


def _scale_uncertainty(configuration: Configuration) -> float:
    """How well the drives' newton metres are known, as a share: measured on this rig, or assumed."""
    measured = configuration.calibration
    scales = [each.source for each in configuration.settings if "counts_per_nm" in each.key]
    known = measured is not None and all(source.startswith(str(measured)) for source in scales)
    return CALIBRATED_SCALE if known else ASSUMED_SCALE


def truth(configuration: Configuration, _request: Request) -> Mapping[str, Any]:
    """What the simulated joints hold at rest."""
    rig = configuration.rig
    plant = rig.plant[rig.simulator.plant]
    return {"motor_nm": [most / rig.model.gear_ratio for most in plant.breakaway], "joint_nm": list(plant.breakaway)}


def draw(result: Result, title: str, path: Path) -> None:
    """Ramps until motion, and friction of each joint."""
    shown = result.drawing
    assert isinstance(shown, Drawing)  # noqa: S101  (its own procedure's)
    with drawing(title, path, (11.0, 6.0)) as figure:
        down, up, right = figure.subplots(1, 3, width_ratios=(1, 1, 1.1))
        for axes, sense in ((down, -1), (up, 1)):
            _ramps(axes, [ramp for ramp in shown.ramps if ramp.is_fine and ramp.sense == sense])
            axes.set_title(f"Slow ramps, {'with' if sense > 0 else 'against'} the pair's sense")
        if shown.fit is not None:
            _friction(right, shown.fit)
        else:
            right.set_axis_off()
            right.text(0.0, 0.5, "No friction: a pair did not move.", color=COLOURS[1])


def _ramps(axes: "Axes", ramps: list[Ramp]) -> None:
    """How far the joints had moved at which torque, and where motion is taken to begin."""
    begins = []
    for ramp in ramps:
        colour = COLOURS[ramp.held]
        axes.plot(1e3 * ramp.torque, ramp.farthest, color=colour, linewidth=1.0)
        if ramp.has_moved:
            begins.append(1e3 * ramp.push().torque)
            axes.plot(begins[-1:], [0.0], marker="|", markersize=14, color=colour)
    for held, words in enumerate(("joints 2 and 3", "joints 1 and 3", "joints 1 and 2")):
        axes.plot([], [], color=COLOURS[held], label=words)
    if begins:
        axes.set_xlim(0.98 * min(begins), 1.09 * max(begins))
    axes.set_xlabel("torque of both motors [mN·m]")
    axes.set_ylabel("farthest joint [counts]")
    axes.legend(loc="upper right", handlelength=1.0)


def _friction(axes: "Axes", fit: Stiction) -> None:
    axes.set_title("Friction of each joint at rest, 95 %")
    for side, (words, shift) in enumerate((("positive", -0.12), ("negative", 0.12))):
        axes.errorbar(
            np.arange(1, 4) + shift,
            1e3 * fit.friction[:, side],
            yerr=1e3 * fit.half_width[:, side],
            fmt="o",
            capsize=5,
            color=COLOURS[side],
            label=words,
        )
    axes.set_xlim(0.5, 3.5)
    axes.set_ylim(0.0, 1.2e3 * float((fit.friction + fit.half_width).max()))
    axes.set_xticks([1, 2, 3], ["joint 1", "joint 2", "joint 3"])
    axes.set_ylabel("[mN·m at the motor]")
    axes.legend(loc="lower right")


OFFER: Final = Offer(
    make=make,
    draw=draw,
    truth=truth,
    options=(
        Option("most", float, 0.15, "Greatest torque of a ramp [N·m at the motor].", "NM"),
        Option("rate", float, 0.02, "Of the slow ramps [N·m/s].", "RATE"),
        Option("repeats", int, 4, "Slow ramps of each kind.", "N"),
    ),
)
