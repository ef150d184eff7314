"""How a loop kept its time as one picture: a histogram of each of a cycle's times."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.picture import COLOURS, INK, drawing
from torquerig.timing import CycleTimes, Distribution

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BINS_PER_DECADE: Final = 30
LEAST_US: Final = 0.1
"""The left end of the axis at least: what is shorter is beyond what the clock can tell."""
LEAST_COUNT: Final = 0.7
"""The lower end of the logarithmic axis of counts: a single cycle must still be seen."""


class Panel(NamedTuple):
    """One histogram of the picture.

    Attributes:
        title: What is shown.
        series: Times [us], each shape (cycles,); one after the other in the house's colours.
        names: Their names; none for a single one.
    """

    title: str
    series: Sequence[NDArray[np.float64]]
    names: Sequence[str] = ()


def draw_timing(times: CycleTimes, period_us: float, title: str, path: Path) -> None:
    """Save histograms of a run's times, all over one logarithmic axis.

    Args:
        times: The times.
        period_us: The sampling period [us], which is marked.
        title: What it is a picture of.
        path: The PNG file.

    Raises:
        OSError: If the file cannot be written.
    """
    panels = [panel for panel in _panels(times) if any(series.size for series in panel.series)]
    edges = _edges([series for panel in panels for series in panel.series], period_us)
    with drawing(title, path, (10, 1.7 * len(panels) + 0.7)) as figure:
        grid = figure.subplots(len(panels), 1, sharex=True, squeeze=False)
        for axes, panel in zip(grid[:, 0], panels, strict=True):
            _histogram(axes, panel, edges)
            axes.axvline(period_us, color=INK, linewidth=1, linestyle="--", label="period")
        grid[0, 0].legend(handles=grid[0, 0].lines, loc="upper right")
        grid[-1, 0].set_xlabel("time [µs]")
        figure.align_ylabels(grid[:, 0])
        grid[-1, 0].xaxis.set_major_formatter("{x:g}")


def _panels(times: CycleTimes) -> Iterator[Panel]:
    """What there is to draw."""
    yield Panel("Lateness of SYNC", (times.lateness,))
    if times.tpdo_by_drive:
        names = [f"drive {place}" for place in range(1, len(times.tpdo_by_drive) + 1)]
        yield Panel("SYNC to each drive's TPDO", times.tpdo_by_drive, names)
    yield Panel("SYNC to last TPDO, as the loop saw it", (times.last_tpdo,))
    yield Panel("Estimate and law", (times.law,))
    yield Panel("SYNC to last RPDO", (times.last_rpdo,))


def _edges(series: Sequence[NDArray[np.float64]], period_us: float) -> NDArray[np.float64]:
    """The edges of the bins: whole decades that hold every time and the period."""
    known = np.concatenate(series)
    known = known[known > LEAST_US]
    low = math.floor(math.log10(min(known.min(initial=period_us), period_us)))
    high = math.ceil(math.log10(max(known.max(initial=period_us), period_us) * 1.01))
    return np.logspace(low, high, (high - low) * BINS_PER_DECADE + 1)


def _histogram(axes: "Axes", panel: Panel, edges: NDArray[np.float64]) -> None:
    """One panel; what is shorter than the axis is counted in its first bin, and said to be."""
    from matplotlib.ticker import NullFormatter, NullLocator  # noqa: PLC0415  (with matplotlib, when something is drawn)

    for place, series in enumerate(panel.series):
        held = np.clip(series, edges[0], edges[-1])
        colour = COLOURS[place % len(COLOURS)]
        if panel.names:  # outlines, for filled ones would hide each other
            axes.hist(held, edges.tolist(), histtype="step", color=colour, linewidth=1.5, label=panel.names[place])
        else:
            axes.hist(held, edges.tolist(), histtype="stepfilled", color=colour, alpha=0.8)
    axes.set_axisbelow(True)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(bottom=LEAST_COUNT)
    axes.set_xlim(edges[0], edges[-1])
    axes.set_ylabel("cycles")
    axes.set_title(_heading(panel, edges[0]))
    if panel.names:
        axes.legend(loc="upper left")


def _heading(panel: Panel, least_us: float) -> str:
    """The panel's title with its numbers."""
    spread = Distribution.of(np.concatenate(panel.series))
    told = zip(("p50", "p99", "p99.9", "max"), (spread.p50, spread.p99, spread.p999, spread.max), strict=True)
    numbers = ", ".join(f"{name} {value:.1f}" for name, value in told) + " µs"
    short = sum(int(np.count_nonzero(series < least_us)) for series in panel.series)
    note = f" ({short} shorter than the axis, in its first bar)" if short else ""
    return f"{panel.title}: {numbers}{note}" if not panel.names else f"{panel.title}{note}"
