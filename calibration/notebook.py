"""Every cycle of a procedure: what was sampled and what was commanded, stretch by stretch."""

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.procedure import Column, Table

CYCLES: Final = "cycles"


class Sampled(Protocol):
    """A sample of the joints, as `driver.master.group.AxisSample` is one."""

    @property
    def at_ns(self) -> int:
        """When the SYNC was sent [ns]."""
        ...

    @property
    def q(self) -> NDArray[np.float64]:
        """Joint angles, shape (n,) [rad]."""
        ...

    @property
    def torque(self) -> NDArray[np.float64]:
        """Actual motor torques, shape (n,) [N·m at the motor]."""
        ...

    @property
    def complete(self) -> bool:
        """Whether all axes answered in time."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """A stretch of cycles.

    Attributes:
        at_ns: SYNC of each cycle, shape (m,) [ns].
        q: Joint angles at it, shape (m, n) [rad].
        torque: Actual motor torques at it, shape (m, n) [N·m at the motor].
        complete: Whether all axes answered in time, shape (m,).
        sent_ns: When the cycle's command left, shape (m,) [ns]; 0 where none did.
        command: Motor torques that were commanded after it, shape (m, n) [N·m at the motor].
    """

    at_ns: NDArray[np.int64]
    q: NDArray[np.float64]
    torque: NDArray[np.float64]
    complete: NDArray[np.bool_]
    sent_ns: NDArray[np.int64]
    command: NDArray[np.float64]

    @property
    def t(self) -> NDArray[np.float64]:
        """Time since the first sample, shape (m,) [s]."""
        seconds: NDArray[np.float64] = (self.at_ns - self.at_ns[:1]) / 1e9
        return seconds

    def __len__(self) -> int:
        return len(self.at_ns)


class Notebook:
    """The cycles so far, kept as flat lists: a cycle costs microseconds.

    Attributes:
        stretches: What was done in each stretch, in words.
    """

    def __init__(self, axes: int) -> None:
        """Begin empty, with so many axes."""
        self.stretches: list[str] = []
        self._axes = axes
        self._stretch: list[int] = []
        self._at_ns: list[int] = []
        self._q: list[NDArray[np.float64]] = []
        self._torque: list[NDArray[np.float64]] = []
        self._complete: list[bool] = []
        self._sent_ns: list[int] = []
        self._command: list[NDArray[np.float64]] = []
        self._nothing = np.zeros(axes)

    def __len__(self) -> int:
        return len(self._at_ns)

    @property
    def last_q(self) -> NDArray[np.float64]:
        """The last sample's joint angles, shape (n,) [rad].

        Raises:
            IndexError: There is no sample yet.
        """
        return self._q[-1]

    def begin(self, words: str) -> "Stretch":
        """Begin a stretch."""
        self.stretches.append(words)
        return Stretch(self, len(self))

    def sampled(self, sample: Sampled) -> None:
        """Write a cycle down."""
        if not self.stretches:
            self.stretches.append("")
        self._stretch.append(len(self.stretches) - 1)
        self._at_ns.append(sample.at_ns)
        self._q.append(sample.q)
        self._torque.append(sample.torque)
        self._complete.append(sample.complete)
        self._sent_ns.append(0)
        self._command.append(self._nothing)

    def commanded(self, sent_ns: int, tau_m: NDArray[np.float64]) -> None:
        """Write down what the last cycle's command was; of several the last."""
        if self._at_ns:
            self._sent_ns[-1] = sent_ns
            self._command[-1] = tau_m.copy()

    def trace(self, begin: int = 0) -> Trace:
        """The cycles from one on."""
        return Trace(
            np.array(self._at_ns[begin:], dtype=np.int64),
            self._vectors(self._q, begin),
            self._vectors(self._torque, begin),
            np.array(self._complete[begin:], dtype=np.bool_),
            np.array(self._sent_ns[begin:], dtype=np.int64),
            self._vectors(self._command, begin),
        )

    def table(self) -> Table:
        """All cycles as raw data."""
        trace = self.trace()
        columns = [
            Column("at_ns", "ns", trace.at_ns),
            Column("stretch", "1", np.array(self._stretch, dtype=np.int16)),
            Column("complete", "1", trace.complete),
            Column("sent_ns", "ns", trace.sent_ns),
        ]
        for name, unit, values in (
            ("q", "rad", trace.q),
            ("torque", "N·m", trace.torque),
            ("command", "N·m", trace.command),
        ):
            columns += [Column(f"{name}_{axis}", unit, part) for axis, part in enumerate(values.T, start=1)]
        return Table(CYCLES, tuple(columns))

    def _vectors(self, rows: list[NDArray[np.float64]], begin: int) -> NDArray[np.float64]:
        return np.array(rows[begin:], dtype=np.float64).reshape(-1, self._axes)


@dataclass(frozen=True, slots=True)
class Stretch:
    """A part of a notebook that is being written.

    Attributes:
        notebook: The notebook.
        begin: Its first cycle's row.
    """

    notebook: Notebook
    begin: int

    def trace(self) -> Trace:
        """What it holds so far."""
        return self.notebook.trace(self.begin)
