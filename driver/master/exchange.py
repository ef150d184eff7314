"""The cycle: SYNC, every drive's TPDO, every drive's RPDO.

A loop leads it through `sample` and `command`. Whenever no loop does (while drives are enabled, homed, asked or
stopped) it goes on by itself with zero torque, RPDOs half a period after SYNC, so that no watchdog trips meanwhile.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from torquerig.driver.bus.cyclic import ANSWERED_NS, CyclicBus
from torquerig.driver.master.axis import Axis
from torquerig.driver.master.port_cycle import CycleMap, PortCycle
from torquerig.driver.master.pump import FAR_NS, Handler, Pump
from torquerig.driver.master.samples import CycleCounts, RawSample
from torquerig.driver.master.watch import TroubleKind, Watch
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sync import SYNC_FRAME


class CyclicExchange:
    """Exchanges process data with all axes once a period.

    Attributes:
        due_ns: When the cycle, led by nobody, does its next thing [ns].
        counts: What happened so far.
        sync_ns: When the last SYNC was sent [ns].
        port: What the cycle goes through when a loop leads it, where the bus offers that.
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
        self.port: PortCycle | None = None
        self.counts = CycleCounts(missed=[0] * len(axes))
        self._pump = pump
        self._axes = tuple(axes)
        self._watch = watch
        self._period_ns = period_ns
        self._half_ns = period_ns // 2
        self._tolerated = tolerated_misses
        self.sync_ns = 0
        self._rpdo_ns = 0
        self._next_sync_ns = FAR_NS
        self._next_rpdo_ns = FAR_NS
        self._open = False
        self._silent = False  # whether somebody left the last SYNC unanswered
        self._unanswered = 0
        self._answered = [True] * len(axes)
        self._silence = [0] * len(axes)
        self._map = CycleMap(len(axes))
        self._positions: NDArray[np.int64] = self._map.block["position"][0, : len(axes)]
        self._torques: NDArray[np.int64] = self._map.block["torque"][0, : len(axes)]
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

    def open_port(self) -> None:
        """Go through the bus's port from the next `sample` on, if it offers one.

        Raises:
            BusError: The bus is gone.
        """
        bus, axes = self._pump.bus, self._axes
        self.port = None
        if isinstance(bus, CyclicBus) and not self._pump.echoes:
            if self._map.is_blank:
                self._lay_out(self._map)
            cycle = self._map.done(axes)
            opened = bus.open_cyclic(cycle)
            if opened is not None:
                self.port = PortCycle(self._pump, opened, cycle, axes, watch=self._watch, counts=self.counts)

    def close_port(self) -> None:
        """Go through frames again."""
        self.port = None
        bus = self._pump.bus
        if isinstance(bus, CyclicBus):
            bus.close_cyclic()

    def start(self, at_ns: int) -> None:
        """Let the cycle go on by itself, with its first SYNC at `at_ns`; the axes' scales must be known."""
        self.open_port()
        self._next_sync_ns = at_ns
        self._plan()

    def stop(self) -> None:
        """Send nothing more, and leave the port."""
        self.close_port()
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
        """As `ask`; what the axes then said."""
        complete = self.ask(due_ns)
        answered_ns = self._answered_ns if self.port is None else self.port.heard()[ANSWERED_NS]
        return RawSample(self.sync_ns, self._positions.copy(), self._torques.copy(), complete, answered_ns)

    def ask(self, due_ns: int) -> bool:
        """Wait until `due_ns`, SYNC, and return when all axes answered or half a period has passed; whether all did.

        If the next SYNC was due more than half a period before, the cycle goes on by itself until then; half a period
        after a SYNC that nobody led is the soonest.

        Raises:
            BusError: The bus is gone.
        """
        if self._next_sync_ns < due_ns - self._half_ns:
            self._pump.serve(due_ns - self._half_ns)
        if self._next_rpdo_ns < FAR_NS:  # of a cycle that nobody led: its answers would be taken for those to this SYNC
            due_ns = max(due_ns, self._next_rpdo_ns)
            self._next_rpdo_ns = FAR_NS
        self._next_sync_ns = self.due_ns = FAR_NS
        port = self.port
        try:
            if self._open and port is not None:
                self._pump.serve(due_ns)
                self._close()
            complete = self._ask_by_frames(due_ns) if port is None else port.exchange(due_ns, self._half_ns)
        except BaseException:
            self._next_sync_ns = self.due_ns = due_ns + self._period_ns  # whoever stops the drives needs the cycle
            raise
        if port is not None:
            self.sync_ns = port.sync_ns
            self.counts.syncs += 1
            if not complete or self._silent:
                self._answered = [bool(answered) for answered in port.answered.tolist()]
                self._close()
        self._next_sync_ns = self.due_ns = self.sync_ns + self._period_ns
        return complete

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

    def command(self, port: PortCycle, look: bool) -> int:  # noqa: FBT001  (compiled code knows no keywords)
        """Send every axis its controlword and the port's wanted torque; returns and raises as `PortCycle.checked`.

        Nothing is sent, and OTHER returned, if frames wait and `look` is set.
        """
        flags = port.send(0, look)
        return port.checked(flags) if flags else 0

    def _ask_by_frames(self, due_ns: int) -> bool:
        self._pump.serve(due_ns)
        self._sync(self._pump.now_ns())
        self._pump.serve(self.sync_ns + self._half_ns, self._is_answered)
        complete = self._is_answered()
        self._close()
        return complete

    def _sync(self, now_ns: int) -> None:
        if self._open:
            self._close()
        self._open = True
        self.sync_ns = now_ns
        self._unanswered = len(self._axes)
        for place in range(len(self._axes)):
            self._answered[place] = False
        self._answered_ns = self._unheard_ns.copy()  # the sample before keeps its own
        self.counts.syncs += 1
        self._pump.send(SYNC_FRAME)

    def _close(self) -> None:
        """End a cycle: count who did not answer."""
        self._open = self._silent = False
        for place, axis in enumerate(self._axes):
            if self._answered[place]:
                self._silence[place] = 0
                continue
            self.counts.missed[place] += 1
            self._silence[place] += 1
            self._silent = True
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
        return sorted(frames)  # as arbitration has it: then an adapter that keeps their order changes nothing

    def _lay_out(self, plan: CycleMap) -> None:
        """Say which frames the cycle has, commands by rising identifier as in `_frames`."""
        for place, axis in sorted(enumerate(self._axes), key=lambda each: each[1].rpdo_cob):
            plan.answer(axis.tpdo_cob, place, axis.tpdo, axis.tpdo_places, answers=True)
            at_controlword, at_torque = axis.rpdo_places
            number = plan.command(axis.rpdo_cob, axis.rpdo.size)
            plan.target(place, (number, axis.rpdo, at_torque), (number, axis.rpdo, at_controlword))

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
            self._answered_ns[place] = at_ns - self.sync_ns
            self._unanswered -= 1
