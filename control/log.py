"""What a run leaves behind: one preallocated array a quantity, one row a cycle."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from torquerig.control.reference import ReferenceTable
from torquerig.control.row import ROW
from torquerig.control.row import columns as columns_of_rows


class Quantity(NamedTuple):
    """What a field of the log is.

    Attributes:
        unit: Its unit, "1" for flags and counts.
        parts: Names of a vector's parts; none for a number.
        optional: Whether there are records that do not hold it yet; read back from them it is NaN.
    """

    unit: str
    parts: tuple[str, ...] = ()
    optional: bool = False


_JOINTS = ("1", "2", "3")
_PLANE = ("x", "y")
Flags = Annotated[NDArray[np.bool_], Quantity("1")]
Counts = Annotated[NDArray[np.int64], Quantity("1")]
Times = Annotated[NDArray[np.int64], Quantity("ns")]
LawTimes = Annotated[NDArray[np.float64], Quantity("ns", optional=True)]
AnswerTimes = Annotated[NDArray[np.float64], Quantity("ns", _JOINTS, optional=True)]
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
        work_ns: The cycle's own work by the stopwatch: estimator, kinematics, limits, law, log.
        law_ns: What of it stands between sample and command: estimator, kinematics, limits and law.
        tpdo_ns: When each axis answered, after the sample's instant.
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
        cells: What the loop writes, one row a cycle, shape (n, ROW) in the layout of `Row`, of which the measured and
            the torques' columns are views; None in a log that was read back.
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
    law_ns: LawTimes
    tpdo_ns: AnswerTimes
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
    cells: NDArray[np.float64] | None = None

    @classmethod
    def for_table(cls, table: ReferenceTable) -> Self:
        """An empty log with room for every cycle of a reference table."""
        n = len(table)
        cells = np.full((n, ROW), np.nan)
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
            law_ns=np.full(n, np.nan),
            cells=cells,
            **columns_of_rows(cells),
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

    def columns(self) -> Iterator[Column]:
        """Every quantity, part by part, the valid rows only, with its unit: a table as it may be written to a file."""
        for name, quantity in quantities().items():
            values = getattr(self, name)[: self.rows]
            if not quantity.parts:
                yield Column(name, quantity.unit, values)
            for i, part in enumerate(quantity.parts):
                yield Column(f"{name}_{part}", quantity.unit, values[:, i])

    @classmethod
    def from_columns(cls, columns: Mapping[str, NDArray[Any]], *, start_ns: int, period_ns: int) -> Self:
        """The log that gave these `columns`.

        Args:
            columns: Values by the column's name, shape (rows,) each; others than the log's are left alone.
            start_ns: When the first cycle was due.
            period_ns: Sampling period.

        Returns:
            The log, all its rows valid.

        Raises:
            KeyError: A column is missing that is not optional.
        """
        rows = len(columns["due_ns"])
        unknown = dict.fromkeys(column_units(optional=True), np.full(rows, np.nan))
        known = {**unknown, **columns}
        values = {
            name: np.column_stack([known[f"{name}_{part}"] for part in quantity.parts])
            if quantity.parts
            else known[name]
            for name, quantity in quantities().items()
        }
        return cls(rows=rows, start_ns=start_ns, period_ns=period_ns, **values)


def quantities() -> dict[str, Quantity]:
    """The log's quantities by the names of its fields."""
    return {
        column.name: quantity for column in fields(LoopLog) for quantity in getattr(column.type, "__metadata__", ())
    }


def column_units(*, optional: bool | None = None) -> dict[str, str]:
    """The unit of each of the log's columns by the column's name.

    Args:
        optional: Only those that are optional, or only those that are not; None: all.
    """
    return {
        f"{name}_{part}" if part else name: quantity.unit
        for name, quantity in quantities().items()
        for part in quantity.parts or ("",)
        if optional in {None, quantity.optional}
    }
