"""A plan tried on the simulated wire: nodes that only answer SYNC, and a master that only commands."""

from typing import Final, NamedTuple

from torquerig.busload import Plan, group_frames
from torquerig.device_sim.devices import NEVER_NS, Emission, SimulatedDevices
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sync import SYNC_FRAME

ANSWER_NS: Final = 20_000
"""A drive has its TPDO ready so long after SYNC (`drive.sample` of the shipped configuration)."""
NS_PER_S: Final = 10**9


class Answerer:
    """A node that answers each SYNC with a TPDO1, and knows nothing else; satisfies `Node`."""

    def __init__(self, node_id: int, length: int) -> None:
        self.node_id = node_id
        self._answer = Frame(cob.TPDO[1] + node_id, bytes(length))
        self._emissions: list[Emission] = []

    def next_event_ns(self) -> int:
        """Never."""
        return NEVER_NS

    def advance(self, to_ns: int) -> None:
        """Let time pass."""

    def receive(self, frame: Frame, at_ns: int) -> None:
        """Answer, if it is a SYNC."""
        if frame.can_id == cob.SYNC:
            self._emissions.append(Emission(at_ns + ANSWER_NS, self.node_id, self._answer))

    def take(self) -> list[Emission]:
        """What it wants to send."""
        emissions, self._emissions = self._emissions, []
        return emissions


class Trial(NamedTuple):
    """What came of a plan on the wire.

    Attributes:
        cycles: How many were tried.
        late: In how many the last RPDO was not through when the next SYNC was due.
        tpdo_us: From when SYNC was due to the last TPDO's end, at worst [us]; None if none came in time.
        rpdo_us: To the last RPDO's end, at worst [us].
        waiting: Frames that still wait at the end: those of an overloaded bus wait for ever.
    """

    cycles: int
    late: int
    tpdo_us: float | None
    rpdo_us: float | None
    waiting: int


def attempt(plan: Plan, cycles: int = 200) -> Trial:
    """Try a plan on the fullest bus: RPDOs go out when the last TPDO is there, or half a period after SYNC.

    Args:
        plan: The plan; heartbeats and slow TPDOs are left out.
        cycles: How many to try.
    """
    return _Attempt(plan).run(cycles)


class _Attempt:
    def __init__(self, plan: Plan) -> None:
        drives = range(1, plan.drives_on_fullest + 1)
        self._tpdos = len(drives)
        self._period_ns = round(NS_PER_S / plan.rate_hz)
        if plan.group_rpdo:
            commands = [(0x200, length) for length in group_frames(len(drives))]
        else:
            commands = [(cob.RPDO[1] + node_id, plan.rpdo_bytes) for node_id in drives]
        self._commands = [Frame(can_id, bytes(length)) for can_id, length in commands]
        nodes = [Answerer(node_id, plan.tpdo_bytes) for node_id in drives]
        self._network = SimulatedNetwork(SimulatedDevices(nodes), plan.bit_rate, self._hear)
        self._said = self._heard = self._commanded = 0
        self._rpdo_end_ns = 0

    def run(self, cycles: int) -> Trial:
        late, tpdos, rpdos = 0, [0], [0]
        for cycle in range(1, cycles + 1):
            due_ns = cycle * self._period_ns
            while self._network.run_until(due_ns) is not None:
                pass
            late += self._commanded > 0
            self._submit(SYNC_FRAME)
            tpdo_ns = self._await_tpdos(due_ns + self._period_ns // 2)
            if tpdo_ns is not None:
                tpdos.append(tpdo_ns - due_ns)
            for frame in self._commands:
                self._submit(frame)
            self._commanded += len(self._commands)
            while self._commanded and self._network.now_ns() < due_ns + self._period_ns:
                self._network.run_until(min(self._network.now_ns() + ANSWER_NS, due_ns + self._period_ns))
            if not self._commanded:
                rpdos.append(self._rpdo_end_ns - due_ns)
        waiting = self._said - self._heard
        return Trial(cycles, late, max(tpdos) / 1000 or None, max(rpdos) / 1000 or None, waiting)

    def _submit(self, frame: Frame) -> None:
        self._said += 1
        self._network.submit(frame)

    def _await_tpdos(self, until_ns: int) -> int | None:
        """When the last TPDO of this cycle was through [ns]; None if it was not until the deadline."""
        for _ in range(self._tpdos):
            arrival = self._network.run_until(until_ns)
            if arrival is None:
                return None
        return self._network.now_ns()

    def _hear(self, at_ns: int, frame: Frame) -> None:
        if frame.can_id == cob.SYNC:
            self._said += self._tpdos
        self._heard += 1
        if frame in self._commands:
            self._commanded -= 1
            self._rpdo_end_ns = at_ns
