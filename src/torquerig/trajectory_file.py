"""Trajectory files of the user: CSV with the columns time, x, y in s and m."""

import csv
import math
import reprlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.errors import MotionError

COLUMNS: Final = ("time", "x", "y")
COMMENT: Final = "#"
LONGEST: Final = 600.0
"""[s] Longer is nearly always milliseconds taken for seconds; our choice."""
CLOSEST: Final = 1e-6
"""[s] Between two points: the drives count time in microseconds (object 1006), and closer ones overflow the spline."""
ROUNDING: Final = 0.999
"""Differences of decimal times are a little less than they say."""


class _Row(NamedTuple):
    """A line of the file.

    Attributes:
        line: Its number, from 1.
        values: time, x, y.
    """

    line: int
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryFile:
    """The points of a file.

    Attributes:
        path: The file.
        lines: The line of each point, shape (n,).
        times: When each is passed, since the first, shape (n,) [s].
        points: Shape (n, 2) [m].
    """

    path: Path
    lines: NDArray[np.int64]
    times: NDArray[np.float64]
    points: NDArray[np.float64]

    def place(self, t: float) -> str:
        """Where in the file a time is: a line, or the two that it lies between.

        Args:
            t: Time since the first point [s].

        Returns:
            As "my.csv:7" or "my.csv:7-8, on the curve between these points".
        """
        after = int(np.searchsorted(self.times, t - 1e-9))
        if after < len(self.times) and math.isclose(self.times[after], t, rel_tol=0, abs_tol=1e-9):
            return f"{self.path}:{self.lines[after]}"
        after = min(max(after, 1), len(self.times) - 1)
        return f"{self.path}:{self.lines[after - 1]}-{self.lines[after]}, on the curve between these points"


def read_trajectory(path: Path) -> TrajectoryFile:
    """Read a trajectory file.

    The first line that is neither empty nor a comment (#) is the header `time,x,y`; every other is a point. Times
    increase; the first need not be 0.

    Args:
        path: The file, UTF-8.

    Returns:
        Its points.

    Raises:
        MotionError: It cannot be read, or a line of it is no such line: names the line, and what would be right.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise MotionError(f"cannot read the trajectory {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise MotionError(f"the trajectory {path} is not UTF-8 text (byte {error.start})") from error
    rows = list(_rows(path, text))
    if len(rows) < 2:
        raise MotionError(f"{path}: a trajectory needs two points at least, and here is {len(rows) or 'none'}")
    values = np.array([row.values for row in rows])
    duration = values[-1, 0] - values[0, 0]
    if duration > LONGEST:
        raise MotionError(
            f"{path}:{rows[-1].line}: time = {values[-1, 0]:g} s ends a trajectory of {duration:g} s: {LONGEST:g} s at"
            " most; times are in seconds"
        )
    return TrajectoryFile(path, np.array([row.line for row in rows]), values[:, 0] - values[0, 0], values[:, 1:])


def _rows(path: Path, text: str) -> Iterator[_Row]:
    """The points, once the header is there; times increase."""
    header, before = None, None
    for line, content in enumerate(text.split("\n"), start=1):  # splitlines would count form feeds too
        if not content.strip() or content.lstrip().startswith(COMMENT):
            continue
        place = f"{path}:{line}"
        cells = _cells(place, content)
        if header is None:
            header = tuple(cell.lower() for cell in cells)
            if header != COLUMNS:
                raise MotionError(
                    f"{place}: the header is {reprlib.repr(content.strip())}, it must be {','.join(COLUMNS)}"
                )
            continue
        row = _Row(line, _numbers(place, cells))
        if before is not None and not row.values[0] > before.values[0]:
            raise MotionError(
                f"{place}: time = {row.values[0]:.9g} s does not come after the {before.values[0]:.9g} s of line"
                f" {before.line}: times must increase"
            )
        if before is not None and row.values[0] - before.values[0] < CLOSEST * ROUNDING:
            raise MotionError(
                f"{place}: time = {row.values[0]:.9g} s is only {row.values[0] - before.values[0]:.3g} s after line"
                f" {before.line}: {CLOSEST:g} s at least"
            )
        before = row
        yield row
    if header is None:
        raise MotionError(f"{path} is empty: its first line must be {','.join(COLUMNS)}")


def _cells(place: str, content: str) -> tuple[str, ...]:
    """The cells of a line."""
    try:
        return tuple(cell.strip() for cell in next(csv.reader([content])))
    except csv.Error as error:
        raise MotionError(f"{place}: this is no line of CSV: {error}") from error


def _numbers(place: str, cells: tuple[str, ...]) -> tuple[float, ...]:
    """The numbers of a line."""
    if len(cells) != len(COLUMNS):
        raise MotionError(f"{place}: {len(cells)} values, there must be {len(COLUMNS)}: {','.join(COLUMNS)}")
    return tuple(_number(place, name, cell) for name, cell in zip(COLUMNS, cells, strict=True))


def _number(place: str, name: str, cell: str) -> float:
    """One number of a line."""
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise MotionError(f"{place}: {name} = {reprlib.repr(cell)} cannot be: it must be a number, as 0.092")
    return value
