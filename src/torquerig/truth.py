"""The simulator's own state as a table, and at the instants of the control loop."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.device_sim.plant import TruthRows


class Column(NamedTuple):
    """One number a row.

    Attributes:
        name: Its name.
        unit: Its unit.
        values: One value a row, shape (rows,).
    """

    name: str
    unit: str
    values: NDArray[Any]


_VECTORS = (
    ("position", "m", "xy"),
    ("velocity", "m/s", "xy"),
    ("theta", "rad", "123"),
    ("motor_torque", "N·m", "123"),
)


def columns_of(truth: TruthRows) -> Iterator[Column]:
    """Every quantity, part by part, with its unit.

    Args:
        truth: The simulator's log.

    Yields:
        The time on the simulator's clock first.
    """
    yield Column("at_ns", "ns", truth.at_ns)
    for name, unit, parts in _VECTORS:
        for part, values in zip(parts, getattr(truth, name).T, strict=True):
            yield Column(f"{name}_{part}", unit, values)


def rows_of(columns: Mapping[str, NDArray[Any]]) -> TruthRows:
    """The simulator's log that gave these columns.

    Args:
        columns: Values by the column's name, shape (rows,) each.

    Returns:
        The log.

    Raises:
        KeyError: A column is missing.
    """
    vectors = {name: np.column_stack([columns[f"{name}_{part}"] for part in parts]) for name, _, parts in _VECTORS}
    return TruthRows(columns["at_ns"], **vectors)


def column_units() -> dict[str, str]:
    """The unit of each column by its name."""
    return {"at_ns": "ns"} | {f"{name}_{part}": unit for name, unit, parts in _VECTORS for part in parts}


def at_instants(truth: TruthRows, instants_ns: NDArray[np.int64]) -> NDArray[np.float64]:
    """True positions at given instants, linear between the log's rows.

    The rows are those at which a drive looked at the machine, some of them within 0.1 ms of every SYNC.

    Args:
        truth: The simulator's log.
        instants_ns: When, shape (n,) [ns].

    Returns:
        Positions, shape (n, 2) [m].
    """
    return np.column_stack([np.interp(instants_ns, truth.at_ns, values) for values in truth.position.T])
