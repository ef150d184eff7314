"""What a simulated machine really did as one picture: its path, speed and torques."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from torquerig.device_sim.plant import TruthRows
from torquerig.picture import COLOURS, MARGIN, drawing, lines


def draw_truth(truth: TruthRows, title: str, path: Path) -> None:
    """Save a picture of what a simulated machine really did.

    Args:
        truth: Its log, with at least two rows.
        title: What it is a picture of.
        path: The PNG file.

    Raises:
        OSError: If the file cannot be written.
    """
    seconds = (truth.at_ns - truth.at_ns[0]) / 1e9
    with drawing(title, path, (11, 7)) as figure:
        grid = figure.add_gridspec(3, 2, width_ratios=(1, 1.25))
        plane = figure.add_subplot(grid[:, 0])
        plane.set_title("True path of the end-effector")
        plane.plot(*(1e3 * truth.position).T, color=COLOURS[0], linewidth=1.4)
        plane.plot(*(1e3 * truth.position[:1]).T, color=COLOURS[1], marker="o", linestyle="none", label="start")
        plane.set_aspect("equal", adjustable="datalim")
        plane.set_xlabel("x [mm]")
        plane.set_ylabel("y [mm]")
        plane.legend(loc="upper left")
        speed, angle, torque = (figure.add_subplot(grid[row, 1]) for row in range(3))
        speed.set_title("True velocity")
        lines(speed, seconds, truth.velocity, ("x", "y"))
        speed.set_ylabel("velocity [m/s]")
        angle.set_title("Joint angles from the start")
        lines(angle, seconds, np.degrees(truth.theta - truth.theta[0]), ("joint 1", "joint 2", "joint 3"))
        angle.set_ylabel("angle [°]")
        torque.set_title("True torque")
        lines(torque, seconds, truth.motor_torque, ("motor 1", "motor 2", "motor 3"))
        torque.set_ylabel("torque [N·m]")
        torque.set_xlabel("time from the record's start [s]")
        for axes in (speed, angle):
            axes.sharex(torque)
            axes.tick_params(labelbottom=False)
        torque.set_xlim(*_span(seconds, truth))


def _span(seconds: NDArray[np.float64], truth: TruthRows) -> tuple[float, float]:
    """When something happened, and a little around it [s]: drives wait long for their master."""
    busy = seconds[np.any(truth.motor_torque != 0, axis=1) | np.any(truth.velocity != 0, axis=1)]
    begin, end = (busy[0], busy[-1]) if busy.size else (seconds[0], seconds[-1])
    margin = MARGIN * max(end - begin, seconds[-1] / len(seconds))
    return float(begin - margin), float(end + margin)
