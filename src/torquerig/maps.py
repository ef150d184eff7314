"""What redundancy gives, as pictures over the workspace (thesis, Figures 2.2 and 2.3), and where the singularities lie.

Figures come without a canvas of a window: `figure.savefig(path)` writes them.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from torquerig.mechanism import HOME, Manipulator, ReachError
from torquerig.mechanism.redundancy import ALL_LEGS, PAIRS, alignment, stiffness_norm, transmission
from torquerig.picture import COLOURS, INK, STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.contour import QuadContourSet
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]
Span = tuple[float, float]

REGION: Final[tuple[Span, Span]] = ((0.08, 0.13), (0.04, 0.09))
"""x and y of the maps [m], for a machine that reaches all of it: the region of Figure 2.2."""
POINTS: Final = 101
"""Of a map along each axis."""
MILLIMETRES: Final = 1e3
STIFFNESS_LEVELS: Final = (200, 300, 400, 500, 600, 700, 800, 900, 1200, 1500, 1900)
"""[N/m]; the thesis' axis goes from 300 to 900."""
RATIO_LEVELS: Final = (1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0)
TENTHS: Final = tuple(k / 10 for k in range(11))
LOCI: Final = ("#ffffff", COLOURS[1], COLOURS[0])
"""Colours of the pairs' singular loci."""
ROOM_FOR_LEGEND: Final = 0.55
"""Left of the workspace, as a share of its width."""
EDGE: Final = 0.04
"""Right of it."""


def stiffness_figure(model: Manipulator) -> "Figure":
    """Figure 2.2: the norm of the Cartesian stiffness with three actuators, with legs 1 and 3, and their ratio."""
    import matplotlib as mpl  # noqa: PLC0415  (takes half a second, and most commands draw nothing)
    from matplotlib.colors import BoundaryNorm  # noqa: PLC0415

    points = grid(*region(model))
    redundant, pair = stiffness_norm(model, points), stiffness_norm(model, points, PAIRS[1])
    with mpl.rc_context(STYLE):
        figure, panels = _figure("Cartesian stiffness, Euclidean norm of k S'S at k = 1 N·m/rad (Figure 2.2)", 1, 3)
        norm = BoundaryNorm(STIFFNESS_LEVELS, mpl.colormaps["viridis"].N, extend="both")
        shared = {"levels": STIFFNESS_LEVELS, "norm": norm, "extend": "both"}
        _map(panels[0], points, redundant, _name(ALL_LEGS), **shared)
        filled = _map(panels[1], points, pair, _name(PAIRS[1]), **shared)
        _scale(filled, panels[:2], "stiffness [N/m]", ticks=STIFFNESS_LEVELS)
        filled = _map(panels[2], points, redundant / pair, "Ratio", cmap="cividis", levels=RATIO_LEVELS, extend="max")
        _scale(filled, panels[2:], "three actuators / legs 1 and 3 [1]", ticks=RATIO_LEVELS[::2])
    return figure


def transmission_figure(model: Manipulator) -> "Figure":
    """Figure 2.3: sigma_min / sigma_max of the force transmission, with three actuators and with any two."""
    import matplotlib as mpl  # noqa: PLC0415

    points = grid(*region(model))
    with mpl.rc_context(STYLE):
        figure, panels = _figure("Evenness of the force transmission, sigma_min / sigma_max of S (Figure 2.3)", 2, 2)
        for axes, legs in zip(panels, (ALL_LEGS, *PAIRS), strict=True):
            values = transmission(model, points, legs)
            filled = _map(axes, points, values, f"{_name(legs)}: mean {np.nanmean(values):.2f}", levels=TENTHS)
        figure.colorbar(filled, ax=panels, label="1: the same force in all directions, 0: singular", ticks=TENTHS)
    return figure


def singularity_figure(model: Manipulator) -> "Figure":
    """Where the singularities of two and of three legs lie in the workspace, and how far the nearest of three is."""
    import matplotlib as mpl  # noqa: PLC0415

    points = grid(*workspace(model), 2 * POINTS)
    spare = _spare_reach(model, points)
    reached = spare > 0.0
    distances = [model.singularity_distance(point) for point in points.reshape(-1, 2)]
    distances_mm = np.where(reached, MILLIMETRES * np.reshape(distances, reached.shape), np.nan)
    with mpl.rc_context(STYLE):
        figure, panels = _figure("Singularities over all that three legs can reach", 1, 2)
        conditioning = np.where(reached, transmission(model, points), np.nan)
        filled = _map(panels[0], points, conditioning, "Singular poses", levels=TENTHS)
        _scale(filled, panels[:1], "sigma_min / sigma_max with three actuators [1]", ticks=TENTHS)
        _loci(panels[0], model, points, reached)
        filled = _map(panels[1], points, distances_mm, "Distance to the nearest, three actuators", cmap="cividis")
        _scale(filled, panels[1:], "straight-line distance [mm]")
        for axes in panels:
            axes.contour(*_millimetres(points), spare, levels=[0.0], colors=[INK], linewidths=2.0)
            left, right = axes.get_xlim()
            axes.set_xlim(left - ROOM_FOR_LEGEND * (right - left), right + EDGE * (right - left))
    return figure


def grid(xs: Span, ys: Span, count: int = POINTS) -> Array:
    """Points over a region, shape (count, count, 2) [m]: rows along y, columns along x."""
    return np.stack(np.meshgrid(np.linspace(*xs, count), np.linspace(*ys, count)), axis=-1)


def region(model: Manipulator) -> tuple[Span, Span]:
    """The x and y of the maps [m]: the thesis' region, or all of the workspace of a machine that is another.

    Raises:
        ReachError: No place is in reach of all three legs.
    """
    corners = [(x, y) for x in REGION[0] for y in REGION[1]]
    return REGION if all(model.singularity_distance(corner) >= 0.0 for corner in corners) else workspace(model)


def workspace(model: Manipulator) -> tuple[Span, Span]:
    """The x and y that all three legs may reach [m]: the common part of the squares about their circles.

    Raises:
        ReachError: No place is in reach of all three legs.
    """
    reach, bases = 2.0 * model.link_length, np.array(model.bases)
    low, high = (bases - reach).max(axis=0), (bases + reach).min(axis=0)
    spans = (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))
    if (low >= high).any() or _spare_reach(model, grid(*spans)).max() <= 0.0:
        raise ReachError(f"no place is in reach of all three legs: bases {model.bases} m, reach {reach:g} m")
    return spans


def _spare_reach(model: Manipulator, points: Array) -> Array:
    """What the leg that is nearest to stretched has left, shape (...) [m]; below 0 out of reach."""
    r = np.linalg.norm(points[..., np.newaxis, :] - np.array(model.bases), axis=-1)
    spare: Array = 2.0 * model.link_length - r.max(axis=-1)
    return spare


def _loci(axes: "Axes", model: Manipulator, points: Array, reached: npt.NDArray[np.bool_]) -> None:
    """The direct singularities: a line for each pair of legs alone, points for all three; and the edge's name."""
    axes.plot([], [], color=INK, linewidth=2.0, label="a leg stretched")
    for legs, colour in zip(PAIRS, LOCI, strict=True):
        values = np.where(reached, alignment(model, points, legs), np.nan)
        if np.nanmin(values) < 0.0 < np.nanmax(values):
            axes.contour(*_millimetres(points), values, levels=[0.0], colors=[colour], linewidths=2.2)
            axes.plot([], [], color=colour, linewidth=2.2, label=_name(legs))
        else:
            axes.plot([], [], color="none", label=f"{_name(legs)}: nowhere")
    places = MILLIMETRES * np.array(model.direct_singularities).reshape(-1, 2)
    name = f"{_name(ALL_LEGS)}{'' if len(places) else ': nowhere'}"
    axes.plot(*places.T, "X", color=LOCI[0] if len(places) else "none", markeredgecolor="none", label=name)
    axes.legend(loc="upper left", fontsize=9, facecolor="#9aa5b1", frameon=True, framealpha=1.0, handlelength=1.2)


def _figure(title: str, rows: int, columns: int) -> "tuple[Figure, list[Axes]]":
    """A figure with its title and panels, row by row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=(11, {(1, 3): 5.0, (2, 2): 9.0, (1, 2): 6.9}[rows, columns]), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, x=0.01, ha="left", fontsize=14, fontweight="bold", color=INK)
    return figure, list(figure.subplots(rows, columns, squeeze=False).ravel())


def _map(axes: "Axes", points: Array, values: Array, title: str, **style: Any) -> "QuadContourSet":  # noqa: ANN401  (matplotlib's own)
    """One quantity over the plane as filled contours, home marked."""
    from matplotlib.patheffects import withStroke  # noqa: PLC0415

    chosen: dict[str, Any] = {"cmap": "viridis", "levels": 12} | style
    filled = axes.contourf(*_millimetres(points), values, **chosen)
    axes.set_title(title)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    if (points.min(axis=(0, 1)) <= HOME).all() and (points.max(axis=(0, 1)) >= HOME).all():
        home = (MILLIMETRES * HOME[0], MILLIMETRES * HOME[1])
        axes.plot(*home, "o", color="#ffffff", markeredgecolor=INK, markersize=7)
        name = axes.annotate("home", home, (6, 5), textcoords="offset points", color="#ffffff")
        name.set_path_effects([withStroke(linewidth=2.5, foreground=INK)])
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    return filled


def _scale(filled: "QuadContourSet", panels: "list[Axes]", label: str, **style: Any) -> None:  # noqa: ANN401
    """The colours' meaning, below the panels that share them."""
    panels[0].figure.colorbar(filled, ax=panels, label=label, location="bottom", aspect=22 * len(panels), **style)


def _millimetres(points: Array) -> tuple[Array, Array]:
    """The x and y of a grid [mm]."""
    return MILLIMETRES * points[..., 0], MILLIMETRES * points[..., 1]


def _name(legs: Sequence[int]) -> str:
    """Legs as a reader counts them."""
    if len(legs) == len(ALL_LEGS):
        return "Three actuators"
    return "Legs {} and {} alone".format(*(leg + 1 for leg in legs))
