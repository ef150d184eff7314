"""A plan tried on simulated wires: nodes that only answer SYNC, and a master that only commands."""

from collections.abc import Sequence
from functools import partial
from typing import Final, NamedTuple

from torquerig.busload import ANSWER_S, Plan, group_frames
from torquerig.device_sim.devices import NEVER_NS, Emission, SimulatedDevices
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.device_sim.wires import SimulatedWires
from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sync import SYNC_FRAME

NS_PER_S: Final = 10**9
ANSWER_NS: Final = round(ANSWER_S * NS_PER_S)


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
    """Try a plan: RPDOs go out when the last TPDO of all buses is there, or half a period after SYNC.

    Args:
        plan: The plan; heartbeats and slow TPDOs are left out.
        cycles: How many to try.
    """
    return _Attempt(plan).run(cycles)


class _Attempt:
    def __init__(self, plan: Plan) -> None:
        self._tpdos = plan.drives
        self._period_ns = round(NS_PER_S / plan.rate_hz)
        spread = [range(place, plan.drives + 1, plan.buses) for place in range(1, plan.buses + 1)]
        self._commands = [_commands(plan, drives) for drives in spread]
        networks = [
            SimulatedNetwork(
                SimulatedDevices(Answerer(node_id, plan.tpdo_bytes) for node_id in drives),
                plan.bit_rate,
                partial(self._hear, len(drives), commands),
            )
            for drives, commands in zip(spread, self._commands, strict=True)
        ]
        self._wires = SimulatedWires(networks)
        self._said = self._heard = self._commanded = 0
        self._rpdo_end_ns = 0

    def run(self, cycles: int) -> Trial:
        late, tpdos, rpdos = 0, [0], [0]
        for cycle in range(1, cycles + 1):
            due_ns = cycle * self._period_ns
            while self._arrivals(due_ns):
                pass
            late += self._commanded > 0
            self._submit([[SYNC_FRAME]] * len(self._commands))
            tpdo_ns = self._await_tpdos(due_ns + self._period_ns // 2)
            if tpdo_ns is not None:
                tpdos.append(tpdo_ns - due_ns)
            self._submit(self._commands)
            self._commanded += sum(map(len, self._commands))
            while self._commanded and self._wires.now_ns() < due_ns + self._period_ns:
                self._arrivals(min(self._wires.now_ns() + ANSWER_NS, due_ns + self._period_ns))
            if not self._commanded:
                rpdos.append(self._rpdo_end_ns - due_ns)
        waiting = self._said - self._heard
        return Trial(cycles, late, max(tpdos) / 1000 or None, max(rpdos) / 1000 or None, waiting)

    def _submit(self, frames: Sequence[Sequence[Frame]]) -> None:
        """Put frames into the send queue of each wire."""
        for end, ours in zip(self._wires.ends, frames, strict=True):
            self._said += len(ours)
            for frame in ours:
                end.submit(frame)

    def _arrivals(self, until_ns: int) -> int:
        """Advance to the first frames that come no later than a time; how many those are."""
        if not self._wires.advance(until_ns):
            return 0
        return sum(len(list(iter(partial(end.run_until, 0), None))) for end in self._wires.ends)

    def _await_tpdos(self, until_ns: int) -> int | None:
        """When the last TPDO of this cycle was through [ns]; None if it was not until the deadline."""
        missing = self._tpdos
        while missing > 0:
            came = self._arrivals(until_ns)
            if not came:
                return None
            missing -= came
        return self._wires.now_ns()

    def _hear(self, answers: int, commands: Sequence[Frame], at_ns: int, frame: Frame) -> None:
        if frame.can_id == cob.SYNC:
            self._said += answers
        self._heard += 1
        if frame in commands:
            self._commanded -= 1
            self._rpdo_end_ns = at_ns


def _commands(plan: Plan, drives: Sequence[int]) -> list[Frame]:
    """The RPDOs of a cycle on the bus of some drives."""
    if plan.group_rpdo:
        return [Frame(cob.GROUP_RPDO, bytes(length)) for length in group_frames(plan.drives)]
    return [Frame(cob.RPDO[1] + node_id, bytes(plan.rpdo_bytes)) for node_id in drives]
