"""What a cycle tells: all axes at one SYNC, and what happened in the cycles so far."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class RawSample(NamedTuple):
    """All axes at one SYNC, in the drives' own units.

    Attributes:
        at_ns: When the SYNC was sent [ns].
        positions: Position actual values, shape (n,) [count].
        torques: Actual torques, shape (n,) [count of the profile's torque reference].
        complete: Whether all axes answered in time; what is missing repeats the sample before.
        answered_ns: When each axis' answer arrived, after the SYNC, shape (n,) [ns]; NaN where it did not in time.
    """

    at_ns: int
    positions: NDArray[np.int64]
    torques: NDArray[np.int64]
    complete: bool
    answered_ns: NDArray[np.float64]


class AxisSample(NamedTuple):
    """All axes at one SYNC.

    Attributes:
        at_ns: When the SYNC was sent, on the bus clock [ns].
        q: Joint angles, shape (n,) [rad].
        torque: Actual motor torques, shape (n,) [N·m at the motor].
        complete: Whether all axes answered in time; what is missing repeats the sample before.
        answered_ns: When each axis' answer arrived, after the SYNC, shape (n,) [ns]; NaN where it did not in time;
            None where nobody looked.
    """

    at_ns: int
    q: NDArray[np.float64]
    torque: NDArray[np.float64]
    complete: bool
    answered_ns: NDArray[np.float64] | None = None


@dataclass(slots=True)
class CycleCounts:
    """What happened in the cycles so far.

    Attributes:
        syncs: SYNCs sent.
        skipped: SYNCs that were too late to be sent at all.
        late: TPDOs that came after their cycle's deadline.
        missed: TPDOs that did not come in time, by axis.
    """

    syncs: int = 0
    skipped: int = 0
    late: int = 0
    missed: list[int] = field(default_factory=list)
