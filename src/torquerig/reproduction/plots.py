"""Pictures of the report: how they look, and the thesis' panels with our curves in them."""

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.picture import DESIRED, INK, STYLE
from torquerig.reproduction.experiments import MODEL_BASED_LAWS, PD_LAWS
from torquerig.reproduction.thesis_axes import Panel
from torquerig.torque_picture import Curve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH: Final = 11.6  # [in] shown 1160 px wide, so that 10 points are 14 px
DPI: Final = 150
SAMPLE_LABEL: Final = "sample (4 ms each)"
_LEFT, _RIGHT, _TOP, _BOTTOM = 0.85, 0.25, 0.7, 0.55  # [in] around the panels
_BESIDE, _BETWEEN = 0.95, 0.85  # [in] from one panel to the next
_LINE: Final = 0.24  # [in] of a legend
_LEGEND_COLUMNS: Final = 5
_ROOM: Final = 0.04
"""Between the greatest value and the end of an axis that had to grow, as a share of the axis."""
_COLOURS: Final = dict(zip(PD_LAWS + MODEL_BASED_LAWS, ("#b45309", "#be185d", "#0b6e99", "#4d7c0f"), strict=True))
_MORE_COLOURS: Final = ("#6d28d9", "#0f766e", "#525252", "#a16207")


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure of the report.

    Attributes:
        number: The thesis' number of it, as "6.2".
        plant: The plant whose runs it shows; empty for the thesis' model itself.
        title: What it shows.
        caption: What has to be known to read it.
        alt: What is in it, in a sentence for who cannot see it.
        png: The file.
    """

    number: str
    plant: str
    title: str
    caption: str
    alt: str
    png: bytes

    @property
    def file_name(self) -> str:
        """The name of its file."""
        return "-".join(filter(None, ("figure", self.number, self.plant))) + ".png"


def look_of(law: str, laws: Sequence[str]) -> dict[str, Any]:
    """How a law's curves look in every figure: PD laws dashed.

    Args:
        law: Its name.
        laws: All laws that are shown.
    """
    more = [name for name in laws if name not in _COLOURS]
    colour = _COLOURS.get(law) or _MORE_COLOURS[more.index(law) % len(_MORE_COLOURS)]
    return {"color": colour, "linewidth": 1.5, "linestyle": (0, (5, 1.5)) if law in PD_LAWS else "-"}


def png_of(figure: "Figure") -> bytes:
    """A figure as a PNG file."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415

    FigureCanvasAgg(figure)
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=DPI, facecolor="white", metadata={"Description": _in_words(figure)})
    return file.getvalue()


def _in_words(figure: "Figure") -> str:
    """What each panel shows over what, a line each: it goes into the file, for who cannot see the picture."""
    panels = (
        (axes.get_title(loc="left") or axes.get_title(), axes.get_ylabel(), axes.get_xlabel()) for axes in figure.axes
    )
    return "\n".join(f"{title}: {ordinate} over {abscissa}" for title, ordinate, abscissa in panels)


def draw_panels(
    panels: Sequence[Panel],
    curves: Sequence[Sequence[Curve]],
    *,
    columns: int,
    height: float,
    decorate: Callable[[int, "Axes"], None] | None = None,
) -> bytes:
    """The thesis' panels with our curves.

    An axis is the thesis' own. Where a curve of ours leaves it, the axis grows, and dotted lines show where the
    thesis' ends.

    Args:
        panels: The panels.
        curves: The curves of each panel.
        columns: Panels a row.
        height: Of the picture [in].
        decorate: Adds to a panel, given its place.

    Returns:
        The picture as a PNG file.
    """
    import matplotlib as mpl  # noqa: PLC0415  (takes half a second, and `--json` draws nothing)
    from matplotlib.figure import Figure  # noqa: PLC0415

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, height))
        rows = -(-len(panels) // columns)
        for place, (panel, lines) in enumerate(zip(panels, curves, strict=True)):
            axes = figure.add_subplot(rows, columns, place + 1)
            _draw_panel(axes, panel, lines, letter=chr(ord("a") + place))
            if decorate is not None:
                decorate(place, axes)
        figure.subplots_adjust(**_layout(columns, rows, height, legend_lines=_legend(figure)))
        return png_of(figure)


def _draw_panel(axes: "Axes", panel: Panel, curves: Sequence[Curve], letter: str) -> None:
    """One panel."""
    axes.set_title(f"({letter}) {panel.title}")
    axes.set_xlabel(SAMPLE_LABEL)
    axes.set_ylabel(panel.ordinate)
    axes.set_xlim(0, panel.samples)
    axes.axhline(0, color=DESIRED, linewidth=0.8, zorder=1)
    for curve in curves:
        axes.plot(
            np.arange(len(curve.values)),
            curve.values,
            label=curve.name or None,
            clip_on=False,
            in_layout=False,
            **curve.look,
        )
    _set_ordinate(axes, panel, [curve.values for curve in curves])


def _set_ordinate(axes: "Axes", panel: Panel, values: Sequence[NDArray[np.float64]]) -> None:
    """The thesis' ordinate, or a longer one where our curves need it."""
    low = min([panel.low, *(float(np.nanmin(each)) for each in values)])
    high = max([panel.high, *(float(np.nanmax(each)) for each in values)])
    room = _ROOM * (high - low)
    axes.set_ylim(low - room * (low < panel.low), high + room * (high > panel.high))
    for end, is_left in ((panel.low, low < panel.low), (panel.high, high > panel.high)):
        if is_left:
            axes.axhline(end, color=INK, linewidth=1.0, linestyle=":", label="the thesis' axis ends here")


def _layout(columns: int, rows: int, height: float, *, legend_lines: int) -> dict[str, float]:
    """Where panels stand in a picture; matplotlib's own layouts take as long as all the drawing."""
    wide = (WIDTH - _LEFT - _RIGHT - (columns - 1) * _BESIDE) / columns
    top = _TOP + _LINE * max(legend_lines - 1, 0)
    high = (height - top - _BOTTOM - (rows - 1) * _BETWEEN) / rows
    return {
        "left": _LEFT / WIDTH,
        "right": 1.0 - _RIGHT / WIDTH,
        "top": 1.0 - top / height,
        "bottom": _BOTTOM / height,
        "wspace": _BESIDE / wide,
        "hspace": _BETWEEN / high,
    }


def _legend(figure: "Figure") -> int:
    """One legend for all panels, above them; returns its lines."""
    found: dict[str, Any] = {}
    for axes in figure.axes:
        handles, names = axes.get_legend_handles_labels()
        found |= dict(zip(names, handles, strict=True))
    if found:
        columns = min(len(found), _LEGEND_COLUMNS)
        figure.legend(found.values(), found.keys(), loc="upper left", ncols=columns, handlelength=2.4)
    return -(-len(found) // _LEGEND_COLUMNS)
