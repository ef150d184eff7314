"""What the application adds to the direction procedure."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from torquerig.building import manipulator
from torquerig.calibrating.drives import gearing
from torquerig.calibrating.offer import Offer, Option, Request
from torquerig.calibration.direction import DirectionProcedure, Drawing
from torquerig.calibration.procedure import Result
from torquerig.calibration.pushes import Place
from torquerig.configuration import Configuration
from torquerig.errors import ConfigurationError
from torquerig.picture import COLOURS, DESIRED, INK, drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def make(configuration: Configuration, request: Request) -> DirectionProcedure:
    """The procedure for a rig.

    Raises:
        ConfigurationError: An option is out of range, or one axis is asked for.
    """
    if request.axis is not None:
        raise ConfigurationError("direction looks at all axes together, because no joint moves alone: leave --axis out")
    rig = configuration.rig
    most, rate = request.options["most"], request.options["rate"]
    if not 0 < most <= rig.limits.torque:
        raise ConfigurationError(
            f"--most {most:g} N·m cannot be: above 0, at most limits.torque = {rig.limits.torque:g}"
        )
    if not 0 < rate <= 10:
        raise ConfigurationError(f"--rate {rate:g} N·m/s cannot be: above 0 and at most 10")
    model = manipulator(rig.model, rig.model)
    first, second, third = rig.axes.legs
    return DirectionProcedure(
        Place.of(model, rig.model.home),
        (first.sign, second.sign, third.sign),
        gearing(rig),
        most,
        rate,
    )


def truth(configuration: Configuration, _request: Request) -> Mapping[str, Any]:
    """How the simulated machine is wired and coupled."""
    return configuration.rig.simulator.installation.model_dump(mode="json")


def draw(result: Result, title: str, path: Path) -> None:
    """Each push's answer beside what the best explanation of it is."""
    shown = result.drawing
    assert isinstance(shown, Drawing)  # noqa: S101  (its own procedure's)
    with drawing(title, path, (11.0, 6.0)) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.7, 1))
        _answers(left, shown)
        _explanations(right, shown)


def _answers(axes: "Axes", drawing: Drawing) -> None:
    axes.set_title("How far the joints moved in each push")
    places = np.arange(len(drawing.pushes))
    moved = 1e3 * np.array([push.moved for push in drawing.pushes])
    for axis, colour in enumerate(COLOURS):
        axes.bar(places + 0.27 * (axis - 1), moved[:, axis], width=0.25, color=colour, label=f"axis {axis + 1}")
    axes.set_axisbelow(True)
    axes.axhline(0, color=DESIRED, linewidth=0.8)
    names = [
        "\n".join(f"{'+' if part > 0 else '-'}{axis}" for axis, part in enumerate(push.torque, 1) if part)
        for push in drawing.pushes
    ]
    axes.set_xticks(places, names)
    axes.set_xlabel("motors that pushed, with the sense of their torque")
    axes.set_ylabel("motion as the drives tell it [mrad]")
    axes.legend(loc="best", ncols=3)


def _explanations(axes: "Axes", drawing: Drawing) -> None:
    axes.set_title("Explanations, the best first")
    axes.set_axis_off()
    lines = [
        f"{number}. mistakes: {answer.hypothesis.mistakes}, work left over: {100 * answer.labour:.1f} %\n    "
        + ("\n    ".join(_wrapped(answer.hypothesis.words())) or "as configured")
        for number, answer in enumerate(drawing.answers, start=1)
    ]
    words = "\n\n".join(lines) or "None sought: something did not move at all."
    axes.text(0.0, 0.95, words, va="top", color=INK, transform=axes.transAxes)


def _wrapped(phrases: Any) -> list[str]:  # noqa: ANN401  (an iterator of phrases)
    import textwrap  # noqa: PLC0415  (for the figure only)

    return [line for phrase in phrases for line in textwrap.wrap(phrase, 42)]


OFFER: Final = Offer(
    make=make,
    draw=draw,
    truth=truth,
    options=(
        Option("most", float, 0.3, "Greatest torque of a push [N·m at the motor].", "NM"),
        Option("rate", float, 0.2, "At which torque rises [N·m/s].", "RATE"),
    ),
)
