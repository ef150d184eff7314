"""A run as one picture: the path, the errors, the torques."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.log import LoopLog
from torquerig.errors import PictureError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, FigureBase

INK: Final = "#1f2933"
DESIRED: Final = "#9aa5b1"
COLOURS: Final = ("#0b6e99", "#c2410c", "#4d7c0f")
SHADE: Final = "#f1f5f9"
MARGIN: Final = 0.2
"""What is shown before and after the motion, as a share of its duration."""
STYLE: Final[dict[Any, Any]] = {
    "axes.edgecolor": DESIRED,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "font.size": 10,
    "grid.color": "#e4e7eb",
    "grid.linewidth": 0.8,
    "legend.frameon": False,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
}


def draw(log: LoopLog, title: str, path: Path, truth: NDArray[np.float64] | None = None) -> None:
    """Save a picture of a run.

    Args:
        log: The run's log, with at least one row.
        title: What it is a picture of.
        path: The file: .png, .svg or .pdf.
        truth: True positions of the end-effector at the log's rows, shape (rows, 2) [m], where they are known.

    Raises:
        PictureError: If the file cannot be written.
    """
    with drawing(title, path, (11, 7)) as figure:
        draw_on(figure, log, truth)


def draw_on(figure: "FigureBase", log: LoopLog, truth: NDArray[np.float64] | None = None) -> None:
    """Draw a run on a figure, or on a part of one; arguments as `draw`'s."""
    grid = figure.add_gridspec(3, 2, width_ratios=(1, 1.25))
    _path(figure.add_subplot(grid[:, 0]), log, truth)
    times = time_ms(log)
    position = figure.add_subplot(grid[0, 1])
    _errors(position, times, 1e3 * (log.desired_position - log.position)[: log.rows], "Position error", "mm")
    velocity = figure.add_subplot(grid[1, 1], sharex=position)
    _errors(velocity, times, (log.desired_velocity - log.velocity)[: log.rows], "Velocity error", "m/s")
    torque = figure.add_subplot(grid[2, 1], sharex=position)
    _torques(torque, times, log)
    for axes in (position, velocity, torque):
        show_motion(axes, times, log)
    position.tick_params(labelbottom=False)
    velocity.tick_params(labelbottom=False)
    torque.set_xlabel("time from the motion's start [ms]")


@contextmanager
def drawing(title: str, path: Path, size: tuple[float, float]) -> Iterator["Figure"]:
    """A figure in the house's style, saved at the end.

    Args:
        title: What it is a picture of.
        path: The file: .png, .svg or .pdf.
        size: Width and height [inch of 150 pixels].

    Yields:
        The figure, empty below its title.

    Raises:
        PictureError: If the file cannot be written.
    """
    import matplotlib as mpl  # noqa: PLC0415  (takes half a second, and most commands draw nothing)
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=size, dpi=150, layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(title, x=0.01, ha="left", fontsize=14, fontweight="bold", color=INK)
        yield figure
        save(figure, path)


def save(figure: "Figure", path: Path) -> None:
    """Write a figure, in the place of what is there.

    Args:
        figure: The figure.
        path: The file; its suffix says what it is written as.

    Raises:
        PictureError: If it cannot be written.
    """
    try:
        figure.savefig(path, facecolor="white")
    except OSError as error:
        raise PictureError(f"{path} cannot be written: {error.strerror}") from error


def time_ms(log: LoopLog) -> NDArray[np.float64]:
    """Time of each of a log's rows from the first of the motion, shape (rows,) [ms]."""
    due = log.due_ns[: log.rows]
    first = int(np.argmax(log.in_motion)) if log.in_motion.any() else 0
    since: NDArray[np.float64] = (due - log.due_ns[first]) / 1e6
    return since


def _path(axes: "Axes", log: LoopLog, truth: NDArray[np.float64] | None) -> None:
    """The end-effector in the plane: desired, measured, and true where it is known."""
    desired, measured = 1e3 * log.desired_position[: log.rows], 1e3 * log.position[: log.rows]
    axes.set_title("Path of the end-effector")
    axes.plot(*desired.T, color=DESIRED, linewidth=4, label="desired", solid_capstyle="round")
    axes.plot(*measured.T, color=COLOURS[0], linewidth=1.4, marker=".", markersize=5, label="measured")
    if truth is not None:
        axes.plot(*(1e3 * truth).T, color=COLOURS[1], linewidth=0.8, label="true")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    axes.legend(loc="upper left")


def _errors(axes: "Axes", times: NDArray[np.float64], errors: NDArray[np.float64], title: str, unit: str) -> None:
    """Desired less measured, along x and y."""
    axes.set_title(title)
    lines(axes, times, errors, ("x", "y"))
    axes.set_ylabel(f"desired - measured [{unit}]")


def _torques(axes: "Axes", times: NDArray[np.float64], log: LoopLog) -> None:
    """Motor torques as the drives report them, over what was commanded."""
    axes.set_title("Torque (pale: command)")
    for column, colour in zip(log.tau[: log.rows].T, COLOURS, strict=True):
        axes.plot(times, column, color=colour, linewidth=1.2, alpha=0.35, drawstyle="steps-post")
    lines(axes, times, log.tau_actual[: log.rows], ("motor 1", "motor 2", "motor 3"))
    axes.set_ylabel("torque [N·m]")


def lines(axes: "Axes", times: NDArray[np.float64], values: NDArray[np.float64], names: Sequence[str]) -> None:
    """One line a column, its name in the legend above the plot."""
    for column, name, colour in zip(values.T, names, COLOURS, strict=False):
        axes.plot(times, column, color=colour, linewidth=1.4, label=name)
    axes.axhline(0, color=DESIRED, linewidth=0.8)
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=len(names),
        borderaxespad=0.1,
        handlelength=1.2,
        columnspacing=1.2,
    )


def show_motion(axes: "Axes", times: NDArray[np.float64], log: LoopLog) -> None:
    """Show the motion and a little of what surrounds it; shade the samples that the errors are taken over."""
    counted = np.flatnonzero(log.in_motion[: log.rows])
    if not counted.size:
        return
    for run in np.split(counted, np.flatnonzero(np.diff(counted) > 1) + 1):
        axes.axvspan(times[run[0]], times[run[-1]], color=SHADE, zorder=0)
    begin, end = times[counted[0]], times[counted[-1]]
    margin = MARGIN * (end - begin)
    if margin:
        axes.set_xlim(max(begin - margin, times[0]), min(end + margin, times[-1]))
