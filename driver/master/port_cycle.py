"""A cycle through a bus's port (`bus.cyclic`): laid out once, led here, the frames moved by compiled code."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from torquerig.driver.bus.cyclic import (
    CHANGED,
    CYCLE,
    DONE,
    EARLY,
    NOBODY,
    NOT_A_NUMBER,
    ODD,
    OTHER,
    Cycle,
    CyclicPort,
)
from torquerig.driver.master.axis import Axis
from torquerig.driver.master.pump import Pump
from torquerig.driver.master.samples import CycleCounts
from torquerig.driver.master.watch import Watch
from torquerig.driver.wire.pdo import PdoLayout
from torquerig.driver.wire.sync import SYNC_FRAME


class CycleMap:
    """Lays out a cycle: which frames it has, and where in them the numbers stand.

    Attributes:
        block: The memory, one record of `bus.cyclic.CYCLE`.
    """

    def __init__(self, axes: int) -> None:
        """Begin with frames of nobody."""
        self.block = np.zeros(1, dtype=CYCLE)
        self._record = self.block[0]
        self._record["axes"] = axes
        self._record["row_of"] = NOBODY
        self._record["target"]["torque_frame"] = self._record["target"]["control_frame"] = NOBODY
        self._answer_ids: list[int] = []

    @property
    def is_blank(self) -> bool:
        """Whether no frame was added yet."""
        return not self._answer_ids

    def answer(self, can_id: int, axis: int, layout: PdoLayout, places: Sequence[int | None], *, answers: bool) -> None:
        """Add a TPDO.

        Args:
            can_id: Its COB-ID.
            axis: Whose it is.
            layout: Its layout.
            places: Which of its fields are statusword, position and actual torque; None: it has none.
            answers: Whether it is the answer to SYNC.
        """
        row = self._record["answer"][len(self._answer_ids)]
        row["size"], row["axis"], row["answers"] = layout.size, axis, answers
        for name, place in zip(("status", "position", "torque"), places, strict=True):
            if place is not None:
                row[name] = _place(layout, place)
        self._record["besides"] += not answers
        self._record["row_of"][can_id] = len(self._answer_ids)
        self._answer_ids.append(can_id)

    def command(self, can_id: int, length: int) -> int:
        """Add an RPDO; its number."""
        number = int(self._record["commands"])
        self._record["command"][number]["can_id"], self._record["command"][number]["length"] = can_id, length
        self._record["commands"] += 1
        return number

    def target(self, axis: int, torque: tuple[int, PdoLayout, int], control: tuple[int, PdoLayout, int]) -> None:
        """Say in which RPDO, by what layout and in which of its fields an axis' torque and controlword stand."""
        target = self._record["target"][axis]
        target["torque_frame"], target["torque"] = torque[0], _place(*torque[1:])
        target["control_frame"], target["control_at"] = control[0], _place(*control[1:])[0]

    def done(self, axes: Sequence[Axis]) -> Cycle:
        """The cycle, with the scales of its axes."""
        for record, axis in zip(self._record["scale"], axes, strict=False):
            scale = axis.scale
            assert scale is not None  # noqa: S101  (its drive was asked)
            record["rad_per_count"], record["zero"], record["sign"] = scale.rad_per_count, scale.zero, scale.sign
            record["positive"], record["negative"] = scale.positive, scale.negative
            record["low"], record["high"] = scale.limits
        return Cycle(self.block, SYNC_FRAME, tuple(self._answer_ids))


class PortCycle:
    """A cycle that goes through a port.

    Attributes:
        sync_ns: When the last SYNC was sent [ns].
        answered: Who has answered the last SYNC, shape (n,).
        heard: Returns what the axes told, as of their last answers, shape (3, n); the caller's own. Its rows are joint
            angle [rad], actual motor torque [N·m at the motor], and how long after SYNC it came [ns] (NaN: it has not).
        send: The port's `command`; what it returns is for `checked`.
    """

    def __init__(
        self, pump: Pump, port: CyclicPort, cycle: Cycle, axes: Sequence[Axis], *, watch: Watch, counts: CycleCounts
    ) -> None:
        """Take a port that was opened for a cycle.

        Args:
            pump: Serves the bus; takes what is no process data.
            port: The port.
            cycle: The cycle.
            axes: The axes, n of them.
            watch: Is told when a drive changes its state.
            counts: Counts late answers.
        """
        count = len(axes)
        self.sync_ns = 0
        heard: NDArray[np.float64] = cycle.block["told"][0, : 3 * count].reshape(3, count)
        self.heard = heard.copy
        self.send = port.command
        self.answered: NDArray[np.int64] = cycle.field("answered", count)
        self._wanted: NDArray[np.float64] = cycle.field("wanted", count)
        self._room: Any = memoryview(cast("Any", self._wanted))  # to mypy arrays are no buffers
        self._counts = counts
        self._pump = pump
        self._port = port
        self._axes = tuple(axes)
        self._watch = watch
        self._statuswords = cycle.field("statusword", count)
        self._news = cycle.field("news", count)
        controlwords: NDArray[np.int64] = cycle.field("controlword", count)
        for place, axis in enumerate(axes):
            axis.write_to(controlwords[place : place + 1])
        self._sync_ns = cycle.field("sync_ns").item
        self._open, self._changed = cycle.field("open"), cycle.field("changed")
        self._late, self._malformed = cycle.field("late"), cycle.field("malformed")

    def exchange(self, due_ns: int, patience_ns: int) -> bool:
        """Wait until a time, send the SYNC, and take answers until all are there, serving the bus all the while.

        Args:
            due_ns: When to send it [ns].
            patience_ns: How long to wait for answers [ns].

        Returns:
            Whether all are there.

        Raises:
            BusError: The bus is gone.
        """
        port = self._port
        if flags := port.sync(due_ns, True):  # noqa: FBT003  (compiled code knows no keywords)
            self._sync_after(flags, due_ns)
        self.sync_ns = sync_ns = self._sync_ns()
        if (next_ns := self._pump.quiet_ns) <= sync_ns:
            next_ns = self._pump.fire(sync_ns)
        until_ns = sync_ns + patience_ns
        flags = port.take(until_ns if until_ns < next_ns else next_ns)
        return flags == DONE or self._collect(flags, until_ns)

    def _sync_after(self, flags: int, due_ns: int) -> None:
        """Send the SYNC after what kept it from being sent; what waits then holds it up no more."""
        if flags & EARLY:
            self._pump.serve(due_ns)
            flags = self._port.sync(due_ns, True)  # noqa: FBT003
        if flags > 0:
            self.hand_out()
            flags = self._port.sync(due_ns, False)  # noqa: FBT003
        if flags < 0:
            raise self._port.error(flags)

    def _collect(self, flags: int, until_ns: int) -> bool:
        """Go on taking answers until a time; whether all are there."""
        port, pump = self._port, self._pump
        while True:
            if flags < 0:
                raise port.error(flags)
            if flags & (CHANGED | ODD):
                self._note()
            if flags & OTHER:
                self.hand_out()
            if flags & DONE:
                return True
            now_ns = pump.now_ns()
            next_ns = pump.fire(now_ns)
            if now_ns >= until_ns:
                self._open[0] = 0
                return False
            flags = port.take(min(until_ns, next_ns))

    def want(self, tau_m: NDArray[np.float64]) -> None:
        """Take the motor torques that are to be commanded.

        Args:
            tau_m: Motor torques, shape (n,) [N·m at the motor].

        Raises:
            ValueError: They are not n.
        """
        try:
            self._room[:] = tau_m  # half of what numpy takes, and sees that kind and shape are the same
        except (TypeError, ValueError, BufferError):
            if tau_m.shape != self._wanted.shape:
                raise ValueError(f"{len(self._axes)} torques are needed, not {tau_m.shape}") from None
            self._wanted[:] = tau_m

    def checked(self, flags: int) -> int:
        """Take note of what `send` returned; OTHER if that was why nothing was sent, else 0.

        Raises:
            ValueError: A wanted torque is not a number; nothing was sent.
            BusError: The bus is gone.
        """
        if flags < 0:
            raise self._port.error(flags)
        if flags & NOT_A_NUMBER:
            raise ValueError(f"{self._wanted.tolist()} [N·m] are no torques")
        if flags & (CHANGED | ODD):
            self._note()
        return flags & OTHER

    def hand_out(self) -> None:
        """Hand out what was found waiting and is no process data; what has come since is found by the next look."""
        hand_out = self._pump.hand_out
        for arrival in self._port.others():
            hand_out(arrival)

    def _note(self) -> None:
        """Tell axes and counts what is new."""
        self._counts.late += self._late.item()
        self._pump.counts.malformed += self._malformed.item()
        self._late[0] = self._malformed[0] = 0
        if self._changed[0]:
            self._changed[0] = 0
            news = zip(self._axes, self._news.tolist(), self._statuswords.tolist(), strict=True)
            self._news[:] = 0
            for axis, is_new, statusword in news:
                if is_new and axis.hear(statusword):
                    self._watch.report_state(axis)


def _place(layout: PdoLayout, number: int) -> tuple[int, int, bool]:
    """Where a field of a layout stands: its first byte, its bytes, whether it has a sign."""
    sizes = [(entry & 0xFF) // 8 for entry in layout.mapping]
    return sum(sizes[:number]), sizes[number], layout.fields[number].struct_code.islower()
