"""The cycle with one RPDO for all drives: see `process_data` for what is in which frame."""

from collections.abc import Sequence
from struct import Struct
from struct import error as StructError  # noqa: N812  (the module's own name for it says nothing here)

from torquerig.driver.bus.cyclic import OTHER
from torquerig.driver.master.axis import Axis
from torquerig.driver.master.exchange import CyclicExchange
from torquerig.driver.master.port_cycle import CycleMap, PortCycle
from torquerig.driver.master.process_data import GROUP_COB, STATUS_CYCLES
from torquerig.driver.master.profile import CONTROLWORD, POSITION, STATUSWORD
from torquerig.driver.master.pump import Handler, Pump
from torquerig.driver.master.watch import Watch
from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.pdo import PdoLayout


class GroupExchange(CyclicExchange):
    """Exchanges positions and torques once a period, statuswords and actual torques once in ten."""

    def __init__(self, pump: Pump, axes: Sequence[Axis], watch: Watch, period_ns: int, tolerated_misses: int) -> None:
        """As `CyclicExchange`."""
        super().__init__(pump, axes, watch, period_ns, tolerated_misses)
        self._torque_codec = Struct(f"<{len(axes)}h")
        self._controlwords = [axis.objects.layout((CONTROLWORD,)) for axis in axes]
        self._told: list[int | None] = [None] * len(axes)
        self._cycle = 0
        pump.handlers[GROUP_COB] = watch.master_handler("it commands all drives")

    def _frames(self, counts: Sequence[int]) -> list[Frame]:
        """Controlwords that are new, all of them in every tenth cycle; then all torques in one frame."""
        try:
            torques = self._torque_codec.pack(*counts)
        except StructError:
            raise ValueError(f"{len(self._axes)} torques of 16 bits are needed, which {list(counts)} are not") from None
        frames = []
        self._cycle = (self._cycle + 1) % STATUS_CYCLES
        for place, axis in enumerate(self._axes):
            if self._cycle == 0 or self._told[place] != axis.controlword:
                self._told[place] = axis.controlword
                frames.append(Frame(axis.rpdo_cob, self._controlwords[place].pack((axis.controlword,))))
        frames.append(Frame(GROUP_COB, torques))
        return frames

    def command(self, port: PortCycle, look: bool) -> int:  # noqa: FBT001
        """As `CyclicExchange`: the torques of all, behind their controlwords when these are new or it is their turn."""
        cycle = (self._cycle + 1) % STATUS_CYCLES
        controlwords: list[int | None] = [axis.controlword for axis in self._axes]
        tell_all = cycle == 0 or controlwords != self._told
        flags = port.send(0 if tell_all else len(self._axes), look)
        if flags and port.checked(flags):
            return OTHER
        self._cycle, self._told = cycle, controlwords
        return 0

    def _lay_out(self, plan: CycleMap) -> None:
        for place, axis in enumerate(self._axes):
            position = axis.objects.layout((POSITION,))
            status = axis.objects.layout((STATUSWORD, axis.settings.profile.torque.actual))
            plan.answer(cob.TPDO[1] + axis.node_id, place, position, (None, 0, None), answers=True)
            plan.answer(cob.TPDO[2] + axis.node_id, place, status, (0, None, 1), answers=False)
            plan.command(axis.rpdo_cob, self._controlwords[place].size)
        number = plan.command(GROUP_COB, self._torque_codec.size)
        torques = PdoLayout(
            field for axis in self._axes for field in axis.objects.layout((axis.settings.profile.torque.target,)).fields
        )
        for place, controlword in enumerate(self._controlwords):
            plan.target(place, (number, torques, place), (place, controlword, 0))

    def _listen(self, place: int, axis: Axis) -> None:
        self._pump.handlers[cob.TPDO[1] + axis.node_id] = self._position_handler(place, axis)
        self._pump.handlers[cob.TPDO[2] + axis.node_id] = self._status_handler(place, axis)

    def _position_handler(self, place: int, axis: Axis) -> Handler:
        layout, counts = axis.objects.layout((POSITION,)), self._pump.counts

        def hear(at_ns: int, data: bytes) -> None:
            values = layout.unpack(data)
            if values is None:
                counts.malformed += 1
                return
            self._positions[place] = values[0]
            self._note_answer(place, at_ns)

        return hear

    def _status_handler(self, place: int, axis: Axis) -> Handler:
        layout = axis.objects.layout((STATUSWORD, axis.settings.profile.torque.actual))
        counts, watch = self._pump.counts, self._watch

        def hear(_at_ns: int, data: bytes) -> None:
            values = layout.unpack(data)
            if values is None:
                counts.malformed += 1
                return
            statusword, self._torques[place] = values
            if axis.hear(statusword):
                watch.report_state(axis)

        return hear
