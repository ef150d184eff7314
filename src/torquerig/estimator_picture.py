"""The estimators of joint rates side by side, as one picture."""

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from torquerig.control.estimators import NANOSECONDS_PER_SECOND
from torquerig.estimator_study import Finding, Study
from torquerig.picture import DESIRED, INK, STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PALETTE: Final = ("#0b6e99", "#c2410c", "#4d7c0f", "#7c3aed", "#a16207", "#db2777", "#0f766e", "#475569")
SHOWN: Final = 0.15
"""How much of the motion is drawn [s]: a stroke and a half of the thesis' motions."""
MILLI: Final = 1e3
ROOM_FOR_NUMBERS: Final = 0.4
"""Beside the longest bar, as a share of it."""


class Bar(NamedTuple):
    """A number of each estimator that is drawn.

    Attributes:
        title: What it is.
        unit: Its unit.
        digits: How many of its decimals are told.
        number: Takes it from a finding; NaN where there is none.
    """

    title: str
    unit: str
    digits: int
    number: Callable[[Finding], float]


BARS: Final = (
    Bar("Delay", "sampling periods", 2, lambda finding: finding.delay),
    Bar("Noise of counts", "mrad/s", 2, lambda finding: MILLI * finding.noise),
    Bar("Error", "rms, mrad/s", 0, lambda finding: MILLI * finding.error),
    Bar("Loop: position", "true RMSE, mm", 2, lambda finding: finding.loop.position_rmse_mm),
    Bar("Loop: velocity", "RMSE, m/s", 3, lambda finding: finding.loop.velocity_rmse_m_s),
    Bar("Loop: chatter", "torque, mN·m", 1, lambda finding: MILLI * finding.loop.torque_chatter_nm),
)


def estimator_figure(study: Study, title: str) -> "Figure":
    """Rates and their errors over the motion's beginning, and every estimator's numbers as bars.

    Args:
        study: What came out.
        title: What it is a picture of.

    Returns:
        The figure; `savefig` writes it.
    """
    import matplotlib as mpl  # noqa: PLC0415  (takes half a second, and most commands draw nothing)
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(13, 8.5), dpi=150, layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(title, x=0.01, ha="left", fontsize=14, fontweight="bold", color=INK)
        grid = figure.add_gridspec(2, 1, height_ratios=(1.25, 1))
        above, below = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
        _draw_rates(above.add_subplot(1, 2, 1), above.add_subplot(1, 2, 2), study)
        first = below.add_subplot(1, len(BARS), 1)
        others = [below.add_subplot(1, len(BARS), k, sharey=first) for k in range(2, len(BARS) + 1)]
        _draw_bars([first, *others], study.findings)
    return figure


def _draw_rates(rates: "Axes", errors: "Axes", study: Study) -> None:
    """The rate of the swiftest joint, and what each estimate lacks, from the motion's beginning."""
    replay = study.replay
    joint = int(np.argmax(np.max(np.abs(replay.rates[replay.judged]), axis=0)))
    begin = replay.at_ns[np.argmax(replay.judged)]
    seconds = (replay.at_ns - begin) / NANOSECONDS_PER_SECOND
    shown = (seconds >= -2 * replay.sampling.period) & (seconds <= SHOWN)
    ms = MILLI * seconds[shown]
    rates.plot(ms, replay.rates[shown, joint], color=DESIRED, linewidth=5, alpha=0.7, label="as it was")
    for finding, colour in _coloured(study.findings):
        estimate = finding.estimates[shown, joint]
        rates.plot(ms, estimate, color=colour, linewidth=1.3, label=finding.name)
        errors.plot(ms, estimate - replay.rates[shown, joint], color=colour, linewidth=1.3)
    rates.set_title(f"Rate of joint {joint + 1}, by {replay.reference}")
    rates.set_ylabel("joint rate [rad/s]")
    rates.legend(loc="best", fontsize=8.5)
    errors.set_title("Error of the estimate")
    errors.set_ylabel("estimated - true rate [rad/s]")
    for axes in (rates, errors):
        axes.set_xlabel("time from the motion's start [ms]")


def _draw_bars(panels: Sequence["Axes"], findings: Sequence[Finding]) -> None:
    """Each estimator's numbers, and those of the loop that runs with it."""
    rows = range(len(findings))
    for axes, bar in zip(panels, BARS, strict=True):
        for (finding, colour), row in zip(_coloured(findings), rows, strict=True):
            number = bar.number(finding)
            if math.isnan(number):
                axes.text(0, row, " stopped", va="center", fontsize=8.5, color=colour)
            else:
                axes.barh(row, number, color=colour, height=0.62)
                axes.text(max(number, 0), row, f" {number:.{bar.digits}f}", va="center", fontsize=8.5)
        axes.set_title(bar.title)
        axes.set_xlabel(bar.unit)
        axes.margins(x=ROOM_FOR_NUMBERS)
        axes.grid(visible=False)
        axes.locator_params(axis="x", nbins=4)
        axes.tick_params(axis="y", length=0, labelleft=axes is panels[0])
    panels[0].set_yticks(rows, [finding.name for finding in findings])
    panels[0].invert_yaxis()


def _coloured(findings: Sequence[Finding]) -> list[tuple[Finding, str]]:
    """Each with its colour."""
    return [(finding, PALETTE[k % len(PALETTE)]) for k, finding in enumerate(findings)]
