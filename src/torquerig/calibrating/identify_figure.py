"""Figures of identification: the excitations before they run, and what came of them."""

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from torquerig.calibration.differentiation import WINDOW
from torquerig.calibration.excitation import RESOLUTION, SLOW, FourierMotion, reckoned_torques, worth
from torquerig.calibration.identification import UNKNOWNS
from torquerig.calibration.identify import UNITS, Drawing
from torquerig.calibration.procedure import Result
from torquerig.calibration.regressor import equation
from torquerig.mechanism import Manipulator
from torquerig.picture import COLOURS, DESIRED, INK, drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MILLI: Final = 1e3


def draw_excitations(model: Manipulator, motions: tuple[FourierMotion, FourierMotion], path: Path) -> None:
    """Save what will be driven: path, joint rates and reckoned torques of a period of each motion."""
    with drawing("Excitations, before they run", path, (11.0, 7.0)) as figure:
        panels = figure.subplots(2, 3, width_ratios=(1, 1.5, 1.5))
        for row, (name, motion) in enumerate(zip(("fitted", "foretold"), motions, strict=True)):
            t = RESOLUTION * np.arange(round(motion.period / RESOLUTION) + 1, dtype=np.float64)
            movement = motion.sampled(t)
            both = equation(model, movement)
            figures = worth(model, motion, window=WINDOW)
            _path(panels[row, 0], _MILLI * movement.position, f"{name}: condition {figures.condition_number:.1f}")
            rates, torques = panels[row, 1:]
            rates.set_title("joint rates [rad/s]")
            rates.axhspan(-SLOW, SLOW, color=DESIRED, alpha=0.35, linewidth=0)
            torques.set_title("motor torques, reckoned [N·m]")
            reckoned = reckoned_torques(model, movement.position, both.Y, both.force)
            for joint, colour in enumerate(COLOURS):
                rates.plot(t, both.rates[:, joint], color=colour, label=f"joint {joint + 1}")
                torques.plot(t, reckoned[:, joint], color=colour)
            rates.margins(y=0.2)
        panels[0, 1].legend(loc="upper right", ncols=3, fontsize=8)
        for axes in panels[1, 1:]:
            axes.set_xlabel("time in a period [s]")


def draw(result: Result, title: str, path: Path) -> None:
    """Save what identification found: path, values of the three ways, and the foretold torques."""
    with drawing(title, path, (11.0, 7.0)) as figure:
        shown = result.drawing
        if not isinstance(shown, Drawing):
            axes = figure.subplots()
            axes.set_axis_off()
            axes.text(0.0, 0.5, "; ".join(result.verdict.reasons), color=COLOURS[1], wrap=True)
            return
        grid = figure.add_gridspec(2, 2, width_ratios=(1, 2), height_ratios=(1, 1.1))
        _path(figure.add_subplot(grid[0, 0]), _MILLI * shown.path, "The excitation as it ran")
        _values(figure.add_subplot(grid[0, 1]), shown)
        _torques(figure.add_subplot(grid[1, :]), shown)


def _path(axes: "Axes", position: np.ndarray, title: str) -> None:
    axes.set_title(title)
    axes.plot(position[:, 0], position[:, 1], color=INK, linewidth=1.0)
    axes.plot(*position[0], marker="o", color=COLOURS[1])
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")


def _values(axes: "Axes", drawing: Drawing) -> None:
    """Each way's values as deviations from the recommended ones, in percent, with intervals."""
    axes.set_title("Values by each way, with 95 % intervals")
    best = drawing.ways["recommended"]
    for number, (way, found) in enumerate(drawing.ways.items()):
        shift = 0.22 * (number - 1)
        colour = COLOURS[(1, 0, 2)[number]]
        for column, name in enumerate(UNKNOWNS):
            if name not in found.values:
                continue
            centre = found.values[name] / best.values[name]
            low, high = (end / best.values[name] for end in found.intervals[name])
            axes.errorbar(
                column + shift,
                centre,
                yerr=[[abs(centre - low)], [abs(high - centre)]],
                fmt="o",
                capsize=4,
                color=colour,
            )
        axes.plot([], [], "o", color=colour, label=f"{way}: misses {_MILLI * found.validation.rmse:.2g} mN·m")
    axes.axhline(1.0, color=DESIRED, linewidth=0.8)
    labels = [f"{name}\n{best.values[name]:.4g} {UNITS[name]}" for name in UNKNOWNS]
    axes.set_xticks(range(len(UNKNOWNS)), labels)
    axes.set_xlim(-0.5, len(UNKNOWNS) - 0.5)
    axes.set_ylabel("of the recommended value")
    axes.legend(loc="upper right", fontsize=9)


def _torques(axes: "Axes", drawing: Drawing) -> None:
    """Measured and foretold torques of joint 1 where all joints move; gaps where one is slow."""
    axes.set_title("The motion that was not fitted: torque of motor 1, less what the links take")
    breaks = np.flatnonzero(np.diff(drawing.time) > 1.5 * np.min(np.diff(drawing.time))) + 1
    for values, colour, width, label in (
        (drawing.measured, DESIRED, 4.0, "measured"),
        (drawing.thesis, COLOURS[1], 1.2, "foretold by the thesis' way"),
        (drawing.foretold, COLOURS[0], 1.2, "foretold by the recommended way"),
    ):
        pieces = zip(np.split(drawing.time, breaks), np.split(_MILLI * values[:, 0], breaks), strict=True)
        for number, (time, piece) in enumerate(pieces):
            axes.plot(time, piece, color=colour, linewidth=width, label=label if number == 0 else None)
    axes.margins(y=0.2)
    axes.set_xlabel("time [s]; only where all joints move")
    axes.set_ylabel("[mN·m at the motor]")
    axes.legend(loc="upper right", ncols=3, fontsize=9)
