"""Three simulated drives on a wire, to which anybody may say anything."""

from collections import deque
from collections.abc import Sequence
from functools import cache
from typing import Final

from fuzz_frames import NODE_IDS
from fuzz_judge import TorqueJudge, unaccounted
from fuzz_log import Timed
from fuzz_memory import footprint

from torquerig.device_sim.devices import Emission, SimulatedDevices
from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.machine import Machine
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.device_sim.plant.rotor import BareRotor, RotorParameters
from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import MAX_DATA_LENGTH, Frame

LOUDEST: Final = 20_000  # frames of all in a session: what follows is a storm that teaches nothing more
BACKLOG: Final = 32  # frames that the speaker's controller holds before it waits
GROWTH: Final = 20_000  # elements that the drives together may hold more than at power-on
LARGEST: Final = 5_000  # elements of one container: an SDO buffer holds 4096 bytes
LOOK: Final = 5_000  # frames from one look at the memory to the next
_BIT_RATE: Final = 1_000_000
_PATIENCE_NS: Final = 100_000_000  # for whatever a node answers
ROTOR: Final = RotorParameters(inertia=2e-5, viscous=1e-4, coulomb=0.01, breakaway=0.012)


class JudgedMachine:
    """A machine whose torques are judged before they are made; satisfies `Machine`."""

    def __init__(self, machine: Machine) -> None:
        self.axes = machine.axes
        self.torques = [0.0] * machine.axes
        self.judges: list[TorqueJudge] = []
        self.motor_angle = machine.motor_angle
        self.motor_velocity = machine.motor_velocity
        self.motor_torque = machine.motor_torque
        self._machine = machine

    def set_torque_demand(self, axis: int, torque: float, at_ns: int) -> None:
        """Judge, then pass on."""
        self.torques[axis] = torque
        self.judges[axis].check(torque)
        self._machine.set_torque_demand(axis, torque, at_ns)


class JudgedDrive(SimulatedDrive):
    """A simulated drive that is judged at every frame and every event."""

    def __init__(self, node_id: int, axis: int, machine: JudgedMachine) -> None:
        self._machine = machine
        super().__init__(node_id, axis, machine)
        self._judge = TorqueJudge(self)
        machine.judges.append(self._judge)

    def advance(self, to_ns: int) -> None:
        """Let time pass, and judge the torque that stands then."""
        super().advance(to_ns)
        self._judge.settle(self._machine.torques[self.axis])

    def receive(self, frame: Frame, at_ns: int) -> None:
        """Hear a frame, and judge what became of it."""
        self._judge.witness.hear(frame)
        state, in_block = self.nmt.state, self._sdo.receiving
        said, counted = len(self._outbox), sum(self.counters().values())
        super().receive(frame, at_ns)
        self._judge.settle(self._machine.torques[self.axis])
        silent = len(self._outbox) == said and sum(self.counters().values()) == counted
        owed = unaccounted(self, frame, state) if silent else None
        assert owed is None or (in_block and frame.can_id == cob.SDO_REQUEST + self.node_id), (
            f"drive {self.node_id} in NMT {state.name} neither answered nor counted {owed}: {frame}"
        )

    def take(self) -> list[Emission]:
        """What the drive wants to say, which must be frames of CANopen."""
        emissions = super().take()
        for _, _, frame in emissions:
            assert 0 < frame.can_id <= 0x7FF, frame
            assert len(frame.data) <= MAX_DATA_LENGTH, frame
            assert not frame.remote, frame
            assert not frame.extended, frame
        return emissions


class DeviceTarget:
    """Three drives on a wire of 1 Mbit/s, and one who says what he likes.

    Attributes:
        network: The wire.
        drives: The drives.
        machine: What they turn.
        log: What was said, to be replayed.
        choked: Drives that answer each other without an end (one's PDO is another's SYNC) leave no room on the wire:
            only a reset, which has the highest priority of all, still comes through.
    """

    def __init__(self) -> None:
        self.machine = JudgedMachine(BareRotor(ROTOR, axes=len(NODE_IDS)))
        self.drives = [JudgedDrive(node_id, axis, self.machine) for axis, node_id in enumerate(NODE_IDS)]
        self.network = SimulatedNetwork(SimulatedDevices(self.drives), _BIT_RATE, self._hear)
        self.log: list[Timed] = []
        self.choked = False
        self._unsent: list[Frame] = []
        self._heard: deque[Frame] = deque(maxlen=64)
        self._wait_until(0)

    def say(self, frame: Frame, pause_ns: int = 0) -> None:
        """Hand a frame to the wire after a pause, or later if too many wait already."""
        self._wait_until(self.network.now_ns() + pause_ns)
        patient_until_ns = self.network.now_ns() + _PATIENCE_NS
        while len(self._unsent) >= BACKLOG and not self.choked:
            self._wait_until(self.network.now_ns() + 1_000_000)
            self.choked = self.network.now_ns() > patient_until_ns
        self.choked = self.choked or self.network.statistics.frames > LOUDEST
        self.log.append(Timed(self.network.now_ns(), frame))
        self._unsent.append(frame)
        self.network.submit(frame)
        if len(self.log) % LOOK == 0:
            self.check_memory()

    def replay(self, log: Sequence[Timed]) -> None:
        """Say what a log holds, at its times, and see it out."""
        for at_ns, frame in log:
            self.say(frame, max(0, at_ns - self.network.now_ns()))
        self.finish()

    def finish(self) -> None:
        """Let what was said take effect; then every drive still has to boot and to answer.

        That too is said on the wire, so that a replay does it as well; it is not part of the log.
        """
        said = len(self.log)
        self._wait_until(self.network.now_ns() + _PATIENCE_NS)
        self.check_memory()
        self.say(Frame(cob.NMT, b"\x81\x00"))
        self._wait_until(self.network.now_ns() + _PATIENCE_NS)
        assert not any(self.machine.torques), f"torques after a reset: {self.machine.torques}"
        for node_id in NODE_IDS:
            self._heard.clear()
            self.say(Frame(cob.SDO_REQUEST + node_id, b"\x40\x00\x10\x00".ljust(8, b"\0")))
            self._wait_until(self.network.now_ns() + _PATIENCE_NS)
            answer = Frame(cob.SDO_RESPONSE + node_id, bytes.fromhex("4300100092010200"))
            assert answer in self._heard, f"drive {node_id} does not answer after a reset"
        del self.log[said:]

    def check_memory(self) -> None:
        """See that nothing has grown beyond its bounds."""
        held = footprint(self.network)
        grown = held.elements - _at_power_on()
        assert grown <= GROWTH, f"the drives hold {grown} elements more than at power-on"
        assert held.largest <= LARGEST, f"a container holds {held.largest} elements"

    def refusals(self) -> dict[str, int]:
        """What the drives refused, ignored or could not read, all together."""
        totals: dict[str, int] = {}
        for drive in self.drives:
            for name, count in drive.counters().items():
                totals[name] = totals.get(name, 0) + count
        return totals

    def _wait_until(self, due_ns: int) -> None:
        while self.network.run_until(due_ns) is not None:
            pass

    def _hear(self, _at_ns: int, frame: Frame) -> None:
        for place, unsent in enumerate(self._unsent):
            if unsent is frame:  # that very frame, for a drive may say an equal one
                del self._unsent[place]
                return
        self._heard.append(frame)


@cache
def _at_power_on() -> int:
    """What drives hold that have heard nothing yet."""
    return footprint(DeviceTarget().network).elements
