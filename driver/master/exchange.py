"""The cycle: SYNC, every drive's TPDO, every drive's RPDO.

A loop leads it through `sample` and `command`. Whenever no loop does (while drives are enabled, homed, asked or
stopped) it goes on by itself with zero torque, RPDOs half a period after SYNC, so that no watchdog trips meanwhile.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.driver.master.axis import Axis
from torquerig.driver.master.pump import FAR_NS, Handler, Pump
from torquerig.driver.master.watch import TroubleKind, Watch
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sync import SYNC_FRAME


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


class CyclicExchange:
    """Exchanges process data with all axes once a period.

    Attributes:
        due_ns: When the cycle, led by nobody, does its next thing [ns].
        counts: What happened so far.
    """

    def __init__(self, pump: Pump, axes: Sequence[Axis], watch: Watch, period_ns: int, tolerated_misses: int) -> None:
        """Lay out the buffers; nothing is sent before `start`.

        Args:
            pump: Serves the bus.
            axes: The drives, n of them; arrays keep their order.
            watch: Is told when a drive falls silent or changes its state.
            period_ns: From SYNC to SYNC [ns].
            tolerated_misses: SYNCs in a row that a drive may leave unanswered.
        """
        self.due_ns = FAR_NS
        self.counts = CycleCounts(missed=[0] * len(axes))
        self._pump = pump
        self._axes = tuple(axes)
        self._watch = watch
        self._period_ns = period_ns
        self._half_ns = period_ns // 2
        self._tolerated = tolerated_misses
        self._sync_ns = 0
        self._rpdo_ns = 0
        self._next_sync_ns = FAR_NS
        self._next_rpdo_ns = FAR_NS
        self._open = False
        self._unanswered = 0
        self._answered = [True] * len(axes)
        self._silence = [0] * len(axes)
        self._positions = np.zeros(len(axes), dtype=np.int64)
        self._torques = np.zeros(len(axes), dtype=np.int64)
        self._unheard_ns = np.full(len(axes), np.nan)
        self._answered_ns = self._unheard_ns.copy()
        self._values = [[0] * len(axis.rpdo.fields) for axis in axes]
        self._zeros = (0,) * len(axes)
        for place, axis in enumerate(axes):
            self._listen(place, axis)
        pump.add_timed(self)

    @property
    def running(self) -> bool:
        """Whether the cycle goes on."""
        return self._next_sync_ns < FAR_NS

    def position(self, axis: Axis) -> int:
        """The last position heard of an axis [count]."""
        return int(self._positions[self._axes.index(axis)])

    def start(self, at_ns: int) -> None:
        """Let the cycle go on by itself, with its first SYNC at `at_ns`."""
        self._next_sync_ns = at_ns
        self._plan()

    def stop(self) -> None:
        """Send nothing more."""
        self._next_sync_ns = self._next_rpdo_ns = FAR_NS
        self._open = False
        self._plan()

    def fire(self, now_ns: int) -> None:
        """Do what is due while nobody leads: SYNC, or half a period later RPDOs with zero torque."""
        if self._next_sync_ns <= now_ns:
            late_ns = now_ns - self._next_sync_ns
            skipped = (late_ns + self._half_ns) // self._period_ns
            self.counts.skipped += skipped
            self._next_sync_ns += (skipped + 1) * self._period_ns
            self._next_rpdo_ns = now_ns + self._half_ns
            self._sync(now_ns)
        elif self._next_rpdo_ns <= now_ns:
            self._next_rpdo_ns = FAR_NS
            self.send_torques(self._zeros)
        self._plan()

    def sample(self, due_ns: int) -> RawSample:
        """Wait until `due_ns`, SYNC, and return when all axes answered or half a period has passed.

        If the next SYNC was due more than half a period before, the cycle goes on by itself until then.

        Raises:
            BusError: The bus is gone.
        """
        if self._next_sync_ns < due_ns - self._half_ns:
            self._pump.serve(due_ns - self._half_ns)
        self._next_sync_ns = self._next_rpdo_ns = FAR_NS
        self._plan()
        self._pump.serve(due_ns)
        self._sync(self._pump.now_ns())
        self._pump.serve(self._sync_ns + self._half_ns, self._is_answered)
        complete = self._is_answered()
        self._close()
        self._next_sync_ns = self._sync_ns + self._period_ns
        self._plan()
        return RawSample(self._sync_ns, self._positions.copy(), self._torques.copy(), complete, self._answered_ns)

    def send_torques(self, counts: Sequence[int]) -> None:
        """Send every axis its controlword and torque now.

        Args:
            counts: Target torques, n of them [count].

        Raises:
            ValueError: A torque does not fit its object; then nothing was sent.
            BusError: The bus is gone.
        """
        frames = self._frames(counts)
        self._rpdo_ns = self._pump.now_ns()
        for frame in frames:
            self._pump.send(frame)

    def send_zero(self) -> None:
        """Send every axis its controlword and no torque, now."""
        self.send_torques(self._zeros)

    def feed_watchdogs(self) -> None:
        """Send RPDOs with no torque unless some have just gone out, so that the watchdogs' time begins anew."""
        if self._pump.now_ns() - self._rpdo_ns > self._half_ns:
            self.send_torques(self._zeros)

    def _sync(self, now_ns: int) -> None:
        if self._open:
            self._close()
        self._open = True
        self._sync_ns = now_ns
        self._unanswered = len(self._axes)
        for place in range(len(self._axes)):
            self._answered[place] = False
        self._answered_ns = self._unheard_ns.copy()  # the sample before keeps its own
        self.counts.syncs += 1
        self._pump.send(SYNC_FRAME)

    def _close(self) -> None:
        """End a cycle: count who did not answer."""
        self._open = False
        for place, axis in enumerate(self._axes):
            if self._answered[place]:
                self._silence[place] = 0
                continue
            self.counts.missed[place] += 1
            self._silence[place] += 1
            if self._silence[place] > self._tolerated:
                silence = self._silence[place]
                self._watch.report(TroubleKind.SILENT, axis.node_id, f"left {silence} SYNCs in a row unanswered")

    def _is_answered(self) -> bool:
        return self._unanswered == 0

    def _plan(self) -> None:
        self.due_ns = min(self._next_sync_ns, self._next_rpdo_ns)

    def _frames(self, counts: Sequence[int]) -> list[Frame]:
        """The RPDOs that give every axis its controlword and torque; ValueError when a torque does not fit."""
        frames = []
        for axis, values, torque in zip(self._axes, self._values, counts, strict=True):
            at_controlword, at_torque = axis.rpdo_places
            values[at_controlword] = axis.controlword
            values[at_torque] = torque
            frames.append(Frame(axis.rpdo_cob, axis.rpdo.pack(values)))
        return frames

    def _listen(self, place: int, axis: Axis) -> None:
        """Have the axis' process data handed to us."""
        self._pump.handlers[axis.tpdo_cob] = self._tpdo_handler(place, axis)

    def _tpdo_handler(self, place: int, axis: Axis) -> Handler:
        unpack_from, size = axis.tpdo.codec.unpack_from, axis.tpdo.size
        at_statusword, at_position, at_torque = axis.tpdo_places
        pump_counts, watch = self._pump.counts, self._watch

        def hear(at_ns: int, data: bytes) -> None:
            if len(data) < size:
                pump_counts.malformed += 1
                return
            values = unpack_from(data)
            self._positions[place] = values[at_position]
            self._torques[place] = values[at_torque]
            if axis.hear(values[at_statusword]):
                watch.report_state(axis)
            self._note_answer(place, at_ns)

        return hear

    def _note_answer(self, place: int, at_ns: int) -> None:
        """Note that an axis has answered this cycle's SYNC."""
        if not self._open:
            self.counts.late += 1
        elif not self._answered[place]:
            self._answered[place] = True
            self._answered_ns[place] = at_ns - self._sync_ns
            self._unanswered -= 1
