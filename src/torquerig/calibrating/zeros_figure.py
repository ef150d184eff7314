"""The figure of the encoder zeros: the motion, how the legs missed each other before and after, what was observed."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from torquerig.calibration.procedure import Result
from torquerig.calibration.zeros import Zeros
from torquerig.picture import COLOURS, INK, drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw(result: Result, title: str, path: Path) -> None:
    """Save the figure; where nothing was found, the reasons."""
    found = result.drawing
    with drawing(title, path, (11.0, 6.0)) as picture:
        if not isinstance(found, Zeros):
            axes = picture.subplots()
            axes.set_axis_off()
            axes.text(0.0, 0.5, ";\n".join(result.verdict.reasons), color=COLOURS[1], wrap=True)
            return
        grid = picture.add_gridspec(2, 2, width_ratios=(1, 1.6))
        _path(picture.add_subplot(grid[0, 0]), found)
        _combinations(picture.add_subplot(grid[1, 0]), found)
        before = picture.add_subplot(grid[0, 1])
        after = picture.add_subplot(grid[1, 1], sharex=before)
        for axes, residuals, words, colour in (
            (before, found.before, "before", COLOURS[1]),
            (after, found.residuals, "after", COLOURS[0]),
        ):
            rms = math.degrees(math.sqrt(float(np.mean(residuals**2))))
            axes.set_title(f"How the legs miss each other {words}: {rms:.2g} deg rms")
            axes.plot(np.degrees(residuals), color=colour, linewidth=0.6)
            axes.set_ylabel("closure residual [deg]")
        before.tick_params(labelbottom=False)
        after.set_xlabel("sample")


def _path(axes: "Axes", found: Zeros) -> None:
    axes.set_title("The motion, zeros corrected")
    axes.plot(*(1e3 * found.position).T, color=INK, linewidth=0.8)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")


def _combinations(axes: "Axes", found: Zeros) -> None:
    """The three combinations of zeros, and how strongly each shows in the residuals."""
    seen = found.observability
    axes.set_title(f"What can be observed (condition {seen.condition_number:.0f})")
    labels = [
        " ".join(f"{weight:+.2f} z{leg}" for leg, weight in enumerate(row, start=1))
        for row in seen.combinations.tolist()
    ]
    axes.barh(range(len(labels)), seen.singular_values, color=COLOURS[0])
    axes.set_yticks(range(len(labels)), labels, fontsize=9)
    axes.set_xscale("log")
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("singular value: residual a unit of this sum")
