"""What a run leaves behind: one preallocated array a quantity, one row a cycle."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from torquerig.control.joints import JointSample
from torquerig.control.law import State
from torquerig.control.reference import ReferenceTable


class Quantity(NamedTuple):
    """What a field of the log is.

    Attributes:
        unit: Its unit, "1" for flags and counts.
        parts: Names of a vector's parts; none for a number.
    """

    unit: str
    parts: tuple[str, ...] = ()


_JOINTS = ("1", "2", "3")
_PLANE = ("x", "y")
Flags = Annotated[NDArray[np.bool_], Quantity("1")]
Counts = Annotated[NDArray[np.int64], Quantity("1")]
Times = Annotated[NDArray[np.int64], Quantity("ns")]
JointAngles = Annotated[NDArray[np.float64], Quantity("rad", _JOINTS)]
JointRates = Annotated[NDArray[np.float64], Quantity("rad/s", _JOINTS)]
Torques = Annotated[NDArray[np.float64], Quantity("N·m", _JOINTS)]
Positions = Annotated[NDArray[np.float64], Quantity("m", _PLANE)]
Velocities = Annotated[NDArray[np.float64], Quantity("m/s", _PLANE)]
Accelerations = Annotated[NDArray[np.float64], Quantity("m/s²", _PLANE)]


class Column(NamedTuple):
    """One number a cycle.

    Attributes:
        name: Its name; parts of a vector end in _1 _2 _3 (joints) or _x _y (the plane).
        unit: Its unit, "1" for flags.
        values: One value a row, shape (rows,).
    """

    name: str
    unit: str
    values: NDArray[Any]


@dataclass(slots=True)
class LoopLog:
    """The loop's record: row k belongs to the cycle due at start + k periods.

    Attributes:
        rows: Rows that are valid, counted from the first; a run that is stopped leaves the rest unwritten.
        start_ns: When the first cycle was due.
        period_ns: Sampling period.
        due_ns: When the cycle was due, after `start_ns`.
        in_motion: Whether the cycle belongs to the motion, not to approach or hold.
        skipped: Whether the cycle came too late and was left out; its measured values are NaN.
        complete: Whether all axes answered.
        clipped: Number of axes whose torque was cut to the limit.
        lateness_ns: The sample's instant after its due time.
        sample_ns: When the sample was there, after the due time.
        command_ns: When the command had left, after the due time.
        work_ns: The cycle's own work by the stopwatch: estimator, kinematics, law, limits, log.
        q: Measured joint angles.
        qd: Estimated joint rates.
        position: Measured position of the end-effector.
        velocity: Its estimated velocity.
        tau_law: Motor torques that the law asked for.
        tau: Motor torques that were commanded.
        tau_actual: Motor torques that the drives reported.
        desired_position: The reference's position; this and the following are the reference table's own arrays.
        desired_velocity: The reference's velocity.
        desired_acceleration: The reference's acceleration.
        desired_q: The reference's joint angles.
        desired_qd: The reference's joint rates.
    """

    rows: int
    start_ns: int
    period_ns: int
    due_ns: Times
    in_motion: Flags
    skipped: Flags
    complete: Flags
    clipped: Counts
    lateness_ns: Times
    sample_ns: Times
    command_ns: Times
    work_ns: Times
    q: JointAngles
    qd: JointRates
    position: Positions
    velocity: Velocities
    tau_law: Torques
    tau: Torques
    tau_actual: Torques
    desired_position: Positions
    desired_velocity: Velocities
    desired_acceleration: Accelerations
    desired_q: JointAngles
    desired_qd: JointRates

    @classmethod
    def for_table(cls, table: ReferenceTable) -> Self:
        """An empty log with room for every cycle of a reference table."""
        n = len(table)
        return cls(
            rows=0,
            start_ns=0,
            period_ns=table.period_ns,
            due_ns=np.arange(n, dtype=np.int64) * table.period_ns,
            in_motion=table.in_motion,
            skipped=np.zeros(n, dtype=np.bool_),
            complete=np.zeros(n, dtype=np.bool_),
            clipped=np.zeros(n, dtype=np.int64),
            lateness_ns=np.zeros(n, dtype=np.int64),
            sample_ns=np.zeros(n, dtype=np.int64),
            command_ns=np.zeros(n, dtype=np.int64),
            work_ns=np.zeros(n, dtype=np.int64),
            q=np.full((n, 3), np.nan),
            qd=np.full((n, 3), np.nan),
            position=np.full((n, 2), np.nan),
            velocity=np.full((n, 2), np.nan),
            tau_law=np.full((n, 3), np.nan),
            tau=np.full((n, 3), np.nan),
            tau_actual=np.full((n, 3), np.nan),
            desired_position=table.position,
            desired_velocity=table.velocity,
            desired_acceleration=table.acceleration,
            desired_q=table.q,
            desired_qd=table.qd,
        )

    def skip(self, k: int, lateness_ns: int) -> None:
        """Row `k` was left out: it would have begun `lateness_ns` after its due time."""
        self.skipped[k] = True
        self.lateness_ns[k] = lateness_ns
        self.rows = k + 1

    def begin(self, k: int, sample: JointSample, sample_ns: int, lateness_ns: int) -> None:
        """Row `k` has its sample: taken `lateness_ns`, there `sample_ns` after the due time."""
        self.lateness_ns[k] = lateness_ns
        self.sample_ns[k] = sample_ns
        self.complete[k] = sample.complete
        self.q[k] = sample.q
        self.tau_actual[k] = sample.torque
        self.rows = k + 1

    def observe(self, k: int, state: State) -> None:
        """Row `k` has its estimated state."""
        self.qd[k] = state.qd
        self.position[k] = state.position
        self.velocity[k] = state.velocity

    def finish(self, k: int, tau: NDArray[np.float64], command_ns: int, work_ns: int) -> None:
        """Row `k` has commanded: torques of shape (3,) [N·m] left `command_ns` after the due time, after `work_ns`."""
        self.tau[k] = tau
        self.command_ns[k] = command_ns
        self.work_ns[k] = work_ns

    def columns(self) -> Iterator[Column]:
        """Every quantity, part by part, the valid rows only, with its unit: a table as it may be written to a file."""
        for column in fields(self):
            for quantity in getattr(column.type, "__metadata__", ()):
                values = getattr(self, column.name)[: self.rows]
                if not quantity.parts:
                    yield Column(column.name, quantity.unit, values)
                for i, part in enumerate(quantity.parts):
                    yield Column(f"{column.name}_{part}", quantity.unit, values[:, i])
