"""The truth, kept for the record: what the machine really did, beside what the drives have measured."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class TruthRows(NamedTuple):
    """Rows of the truth, one for each logged instant.

    Attributes:
        at_ns: Instants, shape (n,) [ns].
        position: shape (n, 2) [m].
        velocity: shape (n, 2) [m/s].
        theta: Active joints, shape (n, 3) [rad].
        motor_torque: After the current loop's lag, shape (n, 3) [N·m].
    """

    at_ns: npt.NDArray[np.int64]
    position: Array
    velocity: Array
    theta: Array
    motor_torque: Array


class TruthLog:
    """Rows at a fixed grid, or at each instant that anybody asks the machine about.

    Attributes:
        grid_ns: Distance of the grid's instants, counted from 0 [ns]; None: every instant asked for.
    """

    def __init__(self, *, grid_ns: int | None = None, capacity: int = 4096) -> None:
        if grid_ns is not None and grid_ns <= 0:
            raise ValueError(f"grid_ns is {grid_ns}: must be above 0")
        self.grid_ns = grid_ns
        self._at_ns = np.empty(capacity, dtype=np.int64)
        self._values = np.empty((capacity, 10))
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def append(self, at_ns: int, row: Array) -> None:
        """Adds a row; an instant that is already the last row replaces it.

        Args:
            at_ns: The instant.
            row: Position, velocity, theta and motor torque as in `TruthRows`, one behind the other, shape (10,).
        """
        if self._count and self._at_ns[self._count - 1] == at_ns:
            self._count -= 1
        elif self._count == len(self._at_ns):
            self._at_ns = np.concatenate([self._at_ns, np.empty_like(self._at_ns)])
            self._values = np.concatenate([self._values, np.empty_like(self._values)])
        self._values[self._count] = row
        self._at_ns[self._count] = at_ns
        self._count += 1

    def rows(self) -> TruthRows:
        """All rows so far, copied."""
        values = self._values[: self._count].copy()
        return TruthRows(
            self._at_ns[: self._count].copy(), values[:, 0:2], values[:, 2:4], values[:, 4:7], values[:, 7:10]
        )

    def take(self) -> TruthRows:
        """All rows since the last `take`, which are then forgotten: for a record written as it grows."""
        rows = self.rows()
        self._count = 0
        return rows
