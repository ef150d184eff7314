"""The components of a run's torques as curves, and as three panels below the picture of the run."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.control.components import TorqueComponents
from torquerig.control.log import LoopLog
from torquerig.picture import COLOURS, DESIRED, INK, draw_on, drawing, show_motion, time_ms
from torquerig.torque_parts import TorqueParts, motion_part

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase

MOTORS: Final = 3
COMPONENTS: Final[Mapping[str, str]] = {
    "total": "total",
    "inertia": "inertia",
    "coriolis": "Coriolis and centrifugal",
    "friction": "viscous friction",
    "stiction": "stiction",
}
"""What each part of `TorqueComponents` is called, the total first."""
_COLOURS: Final = dict(zip(COMPONENTS, (INK, COLOURS[0], "#6d28d9", COLOURS[1], COLOURS[2]), strict=True))
_RECORDED: Final = {"color": DESIRED, "linewidth": 4.0, "zorder": 1.5}
_REFERENCE: Final = {"linewidth": 1.6}
_MEASURED: Final = {"linestyle": "none", "marker": ".", "markersize": 4, "alpha": 0.7}
_RESIDUAL: Final = {"color": "#be185d", "linewidth": 1.4, "linestyle": "--"}
_AS_MEASURED: Final = {"total": "dots: as measured"}
"""What stands in the legend for all dots."""
_SIZE: Final = (11.0, 10.4)
_HEIGHTS: Final = (7.0, 3.4)
_LEGEND_COLUMNS: Final = 4


class Curve(NamedTuple):
    """A line in a panel.

    Attributes:
        name: Its name in the legend; empty for none.
        values: One value a sample.
        look: How it is drawn, as matplotlib's `plot` takes it.
    """

    name: str
    values: NDArray[np.float64]
    look: Mapping[str, Any]


def component_curves(parts: TorqueParts, motor: int) -> list[Curve]:
    """A motor's torque and what it is made of.

    Lines are along the reference, dots along what was measured; the residual is what of the recorded torque the model
    does not explain. Stiction is left out where the motor has none.

    Args:
        parts: The torques of a run.
        motor: Which motor, from 0.

    Returns:
        The curves, one value a row of `parts` [N·m at the motor].
    """
    return [
        Curve("recorded torque", parts.recorded[:, motor], _RECORDED),
        *_component_curves(parts.reference, motor, _REFERENCE, named=True),
        *_component_curves(parts.measured, motor, _MEASURED, named=False),
        Curve("residual", parts.residual[:, motor], _RESIDUAL),
    ]


def draw_with_parts(
    log: LoopLog, parts: TorqueParts, title: str, path: Path, truth: NDArray[np.float64] | None = None
) -> None:
    """Save a picture of a run, with what its torques are made of below it.

    Args:
        log: The run's log.
        parts: Its torques.
        title: What it is a picture of.
        path: The file: .png, .svg or .pdf.
        truth: True positions of the end-effector at the log's rows, shape (rows, 2) [m], where they are known.

    Raises:
        PictureError: If the file cannot be written.
    """
    with drawing(title, path, _SIZE) as figure:
        grid = figure.add_gridspec(2, 1, height_ratios=_HEIGHTS)
        above, below = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
        draw_on(above, log, truth)
        _draw_parts(below, log, parts)


def _component_curves(components: TorqueComponents, motor: int, look: Mapping[str, Any], *, named: bool) -> list[Curve]:
    """A motor's components, those that are there."""
    parts = {part: getattr(components, part)[:, motor] for part in COMPONENTS}
    return [
        Curve(name if named else _AS_MEASURED.get(part, ""), parts[part], {**look, "color": _COLOURS[part]})
        for part, name in COMPONENTS.items()
        if part != "stiction" or np.nan_to_num(parts[part]).any()
    ]


def _draw_parts(figure: "FigureBase", log: LoopLog, parts: TorqueParts) -> None:
    """A panel a motor, and one legend for all."""
    times = time_ms(log)
    handles: dict[str, Any] = {}
    for motor, axes in enumerate(figure.subplots(1, MOTORS)):
        axes.set_title(f"Torque components, motor {motor + 1}")
        for curve in component_curves(parts, motor):
            axes.plot(times[motion_part(log)], curve.values, label=curve.name or None, **curve.look)
        axes.axhline(0, color=DESIRED, linewidth=0.8)
        show_motion(axes, times, log)
        axes.set_ylabel("torque [N·m]")
        axes.set_xlabel("time from the motion's start [ms]")
        found, names = axes.get_legend_handles_labels()
        handles |= dict(zip(names, found, strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside lower left", ncols=_LEGEND_COLUMNS)
