"""How the loop writes its log: a row in one piece, single numbers through memoryviews, nothing allocated."""

from typing import Any, Final

from torquerig.control.joints import JointSample
from torquerig.control.log import LoopLog
from torquerig.control.row import ROW, Row

_ROW_BYTES: Final = ROW * 8


class LogWriter:
    """Writes what the loop knows of a cycle after its command has left."""

    __slots__ = (
        "_cells",
        "_clipped",
        "_command",
        "_complete",
        "_lateness",
        "_law",
        "_log",
        "_row",
        "_sample",
        "_source",
        "_work",
    )

    def __init__(self, log: LoopLog, row: Row) -> None:
        """Take hold of the log's memory.

        Args:
            log: With room for a table.
            row: Where a cycle's numbers stand.

        Raises:
            ValueError: The log was read back from a record, and cannot be written.
        """
        if log.cells is None:
            raise ValueError("a log that was read back cannot be run into: LoopLog.for_table makes one that can")
        self._log, self._row = log, row
        self._cells = log.cells.data.cast("B")
        self._source = row.numbers.data.cast("B")
        # numpy's own way to set one number takes half as long again
        self._lateness, self._sample = log.lateness_ns.data, log.sample_ns.data
        self._complete, self._clipped = log.complete.data, log.clipped.data
        self._command, self._work = log.command_ns.data, log.work_ns.data
        self._law: Final[Any] = log.law_ns.data  # type checkers take all memoryviews for bytes

    def write(self, k: int, sample: JointSample, sample_ns: int, lateness_ns: int) -> None:
        """Row `k` has its sample, taken `lateness_ns`, there `sample_ns` after the due time, and what came of it."""
        self._row.report(sample)
        self._cells[k * _ROW_BYTES : (k + 1) * _ROW_BYTES] = self._source
        self._lateness[k] = lateness_ns
        self._sample[k] = sample_ns
        self._complete[k] = sample.complete
        self._log.rows = k + 1

    def finish(self, k: int, clipped: int, command_ns: int, law_ns: int, work_ns: int) -> None:
        """Row `k` has commanded: torques left `command_ns` after the due time, `clipped` of them cut."""
        if clipped:
            self._clipped[k] = clipped
        self._command[k] = command_ns
        self._law[k] = law_ns
        self._work[k] = work_ns
