"""A machine that is advanced when somebody asks about it, and notes in a log what it really does."""

from abc import ABC, abstractmethod
from typing import Final

import numpy as np
import numpy.typing as npt

from torquerig.device_sim.plant.truth_log import TruthLog

NANOSECOND: Final = 1e-9  # [s]


class LoggedMachine(ABC):
    """Three motors, and the instant up to which they have been advanced.

    Attributes:
        axes: Number of motors.
        log: The truth's log, if one is kept.
    """

    axes = 3

    def __init__(self, start_ns: int, log: TruthLog | None) -> None:
        """The machine at its first instant [ns]; `_begin` is to be called when its state is there."""
        self.log = log
        self._now_ns = start_ns

    @property
    def now_ns(self) -> int:
        """The instant up to which the machine has been advanced [ns]."""
        return self._now_ns

    def advance(self, to_ns: int) -> None:
        """Advances to an instant that nobody asks about.

        Raises:
            ValueError: The time has passed.
        """
        self._advance(0, to_ns)

    @abstractmethod
    def _integrate(self, duration: float) -> None:
        """Carries the state over a duration [s], which may be 0; then `_row` is of its end."""

    @abstractmethod
    def _row(self) -> npt.NDArray[np.float64]:
        """A row for the log, as `TruthLog.append` takes it."""

    def _begin(self) -> None:
        """Compiles the integrator here and now, and notes the first row."""
        self._integrate(0.0)
        self._note()

    def _advance(self, axis: int, to_ns: int) -> None:
        """Advances to an instant at which somebody asks about an axis."""
        if not 0 <= axis < self.axes:
            raise ValueError(f"axis is {axis}: the machine has axes 0 to {self.axes - 1}")
        if to_ns == self._now_ns:
            return
        if to_ns < self._now_ns:
            raise ValueError(f"time {to_ns} ns has passed: the machine stands at {self._now_ns} ns")
        if self.log is None:
            self._integrate_to(to_ns)
        elif self.log.grid_ns is None:
            self._integrate_to(to_ns)
            self._note()
        else:
            grid = self.log.grid_ns
            for due_ns in range((self._now_ns // grid + 1) * grid, to_ns + 1, grid):
                self._integrate_to(due_ns)
                self._note()
            self._integrate_to(to_ns)

    def _integrate_to(self, to_ns: int) -> None:
        self._integrate((to_ns - self._now_ns) * NANOSECOND)
        self._now_ns = to_ns

    def _note(self) -> None:
        if self.log is not None:
            self.log.append(self._now_ns, self._row())
