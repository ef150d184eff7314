"""Several runs in one picture: their paths, errors and torques over each other."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from torquerig.control.log import LoopLog
from torquerig.picture import COLOURS, DESIRED, MARGIN, drawing, time_ms

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HUES: Final = (*COLOURS, "#7c3aed", "#be185d", "#a16207", "#0f766e", "#475569")
"""Colours of the runs; more runs than these begin again, with the next dashes."""
REFERENCE: Final = "#cbd2d9"
DASHES: Final = ("-", "--", ":")
IN_A_ROW: Final = 2
"""Names that fit beside each other below the picture."""


class Entry(NamedTuple):
    """A run to draw.

    Attributes:
        name: What it is called.
        log: Its cycles, at least one.
    """

    name: str
    log: LoopLog


def draw_comparison(entries: Sequence[Entry], title: str, path: Path) -> None:
    """Save a picture of several runs over each other, from each one's start of motion.

    Args:
        entries: The runs.
        title: What it is a picture of.
        path: The PNG file.

    Raises:
        OSError: If the file cannot be written.
    """
    with drawing(title, path, (12, 9)) as figure:
        grid = figure.add_gridspec(5, 2, width_ratios=(1, 1.25))
        plane = figure.add_subplot(grid[:, 0])
        panels = [figure.add_subplot(grid[row, 1]) for row in range(5)]
        _label(plane, panels)
        for number, entry in enumerate(entries):
            style: dict[str, Any] = {
                "color": HUES[number % len(HUES)],
                "linestyle": DASHES[number // len(HUES) % len(DASHES)],
            }
            _add(plane, panels, entry, style)
        plane.plot([], [], color=REFERENCE, linewidth=4, label="desired")
        begin = min(_span(entry.log)[0] for entry in entries)
        end = max(_span(entry.log)[1] for entry in entries)
        for panel in panels:
            if end > begin:
                panel.set_xlim(begin, end)
            panel.sharex(panels[-1])
            panel.axhline(0, color=DESIRED, linewidth=0.8, zorder=0)
        handles, names = plane.get_legend_handles_labels()
        figure.legend(handles, names, loc="outside lower left", ncols=IN_A_ROW)


def _label(plane: "Axes", panels: Sequence["Axes"]) -> None:
    """Say what each panel shows."""
    plane.set_title("Path of the end-effector")
    plane.set_aspect("equal", adjustable="datalim")
    plane.set_xlabel("x [mm]")
    plane.set_ylabel("y [mm]")
    titles = ("Distance from the desired position", "Velocity error", *(f"Torque of motor {n}" for n in (1, 2, 3)))
    units = ("distance [mm]", "error [m/s]", *["torque [N·m]"] * 3)
    for panel, title, unit in zip(panels, titles, units, strict=True):
        panel.set_title(title)
        panel.set_ylabel(unit)
        panel.tick_params(labelbottom=panel is panels[-1])
    panels[-1].set_xlabel("time from the motion's start [ms]")


def _add(plane: "Axes", panels: Sequence["Axes"], entry: Entry, style: dict[str, Any]) -> None:
    """Add one run to every panel; its reference lies under its path, as wide as all references."""
    log, rows = entry.log, slice(entry.log.rows)
    plane.plot(*(1e3 * log.desired_position[rows]).T, color=REFERENCE, linewidth=4, zorder=1, solid_capstyle="round")
    plane.plot(*(1e3 * log.position[rows]).T, linewidth=1.4, label=entry.name, **style)
    curves = (
        1e3 * np.linalg.norm(log.desired_position[rows] - log.position[rows], axis=1),
        np.linalg.norm(log.desired_velocity[rows] - log.velocity[rows], axis=1),
        *log.tau_actual[rows].T,
    )
    for panel, curve in zip(panels, curves, strict=True):
        panel.plot(time_ms(log), curve, linewidth=1.3, **style)


def _span(log: LoopLog) -> tuple[float, float]:
    """From a little before a run's motion to a little after it [ms]; the whole run where it has none."""
    times = time_ms(log)
    counted = times[log.in_motion[: log.rows]]
    if not counted.size:
        return float(times[0]), float(times[-1])
    margin = MARGIN * (counted[-1] - counted[0])
    return max(float(counted[0] - margin), float(times[0])), min(float(counted[-1] + margin), float(times[-1]))
