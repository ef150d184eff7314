"""The torque calibration as one picture: the thesis' Figure 5.5, and what is left of the readings beside the lines."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from torquerig.calibration.procedure import Result
from torquerig.calibration.torque_fit import DirectionFit, LevelReading
from torquerig.calibration.torque_scale import NEGATIVE, AxisTorque
from torquerig.picture import COLOURS, DESIRED, INK, drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIDES: Final = ((-1, "Negative direction: digital value = K τ + c"), (1, "Positive direction: digital value = K τ + c"))
_ROOM: Final = 1.2  # above the greatest deviation


def draw(result: Result, title: str, path: Path) -> None:
    """Save the picture of a torque calibration.

    Args:
        result: What `TorqueProcedure.evaluate` brought back.
        title: What it is a picture of.
        path: The PNG file.

    Raises:
        PictureError: If the file cannot be written.
    """
    scales = result.drawing
    assert isinstance(scales, tuple)  # noqa: S101  (of AxisTorque: this procedure's own)
    with drawing(title, path, (11.0, 7.5)) as figure:
        panels = figure.subplots(2, 2, gridspec_kw={"height_ratios": (2.2, 1)})
        for column, (way, name) in enumerate(SIDES):
            _lines(panels[0, column], scales, way, name)
            _deviations(panels[1, column], scales, way)
        low, high = zip(*(panels[1, column].get_ylim() for column in range(2)), strict=True)
        bound = max(*(abs(end) for end in (*low, *high)), 1e-3)
        for column in range(2):
            panels[1, column].set_ylim(-bound, bound)


def _lines(axes: "Axes", scales: tuple[AxisTorque, ...], way: int, name: str) -> None:
    """Digital value over measured torque, and the lines of both branches."""
    axes.set_title(name)
    for scale, colour in zip(scales, COLOURS, strict=False):
        fit = _fit(scale, way)
        label = f"axis {scale.axis}: no line" if fit is None else f"axis {scale.axis}: {_words(fit)}"
        _points(axes, scale, way, colour, label)
        if fit is not None:
            ends = [min(reading.level for reading in fit.used), max(reading.level for reading in fit.used)]
            for rising in (True, False):
                axes.plot(
                    [fit.torque(end, rising=rising) for end in ends],
                    ends,
                    color=colour,
                    linewidth=1.2,
                    linestyle="-" if rising else "--",
                )
    axes.set_xlabel("measured torque [N·m]")
    axes.set_ylabel("digital value [counts]")
    axes.legend(loc="upper left", fontsize=9, handletextpad=0.4)


def _points(axes: "Axes", scale: AxisTorque, way: int, colour: str, label: str) -> None:
    saturated = {id(each.reading) for each in scale.saturated}
    mine = [reading for reading in scale.readings if reading.level * way > 0]
    for rising, marker in ((True, "^"), (False, "v")):
        chosen = [reading for reading in mine if reading.rising is rising and id(reading) not in saturated]
        axes.plot(
            [reading.torque for reading in chosen],
            [reading.level for reading in chosen],
            linestyle="none",
            marker=marker,
            markersize=5,
            color=colour,
            markerfacecolor=colour if rising else "white",
            label=label if rising else None,
        )
    _crosses(axes, [reading for reading in mine if id(reading) in saturated], DESIRED, "saturated")
    if fit := _fit(scale, way):
        _crosses(axes, fit.outliers, INK, "outlier")


def _crosses(axes: "Axes", readings: Sequence[LevelReading], colour: str, why: str) -> None:
    """Levels that no line was fitted to."""
    if readings:
        torques, levels = [reading.torque for reading in readings], [reading.level for reading in readings]
        label = f"{why}: left out"
        axes.plot(torques, levels, "x", markersize=9, markeredgewidth=1.8, color=colour, label=label)


def _deviations(axes: "Axes", scales: tuple[AxisTorque, ...], way: int) -> None:
    """Readings less the lines."""
    axes.set_title("Reading less line (full: up, hollow: down)" if way < 0 else "Reading less line", fontsize=10)
    for scale, colour in zip(scales, COLOURS, strict=False):
        fit = _fit(scale, way)
        for rising, marker in ((True, "^"), (False, "v")) if fit is not None else ():
            chosen = [reading for reading in fit.used if reading.rising is rising] if fit else []
            levels = [reading.level for reading in chosen]
            rest = [1e3 * (r.torque - fit.torque(r.level, rising=rising)) for r in chosen] if fit else []
            face = colour if rising else "white"
            axes.plot(levels, rest, linestyle="none", marker=marker, markersize=5, color=colour, markerfacecolor=face)
    axes.axhline(0, color=DESIRED, linewidth=0.8)
    top = float(np.max(np.abs(axes.get_ylim())))
    axes.set_ylim(-_ROOM * top, _ROOM * top)
    axes.set_xlabel("digital value [counts]")
    axes.set_ylabel("deviation [mN·m]")


def _fit(scale: AxisTorque, way: int) -> DirectionFit | None:
    return next(fit for name, fit in scale.fits if (name == NEGATIVE) == (way < 0))


def _words(fit: DirectionFit) -> str:
    """The line as a formula, with what the interval leaves open."""
    slope, intercept = fit.counts_per_nm, fit.intercept.value
    half = (slope.high - slope.low) / 2
    return f"({slope.value:.0f} ± {half:.0f}) τ {'+' if intercept >= 0 else '−'} {abs(intercept):.0f}"
