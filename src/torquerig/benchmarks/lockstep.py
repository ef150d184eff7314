"""How fast simulated time passes: drives of every detail on a full wire, and the whole of `torquerig run`."""

import struct
from collections.abc import Sequence
from contextlib import ExitStack
from time import perf_counter_ns
from typing import Final, NamedTuple

from torquerig.benchmarks.enabled import ROTOR
from torquerig.benchmarks.harness import Turn, take_turns
from torquerig.configuration import load_configuration
from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.drive.parameters import DriveParameters
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.device_sim.plant import BareRotor
from torquerig.driver.bus.lockstep import LockstepBus
from torquerig.driver.wire import cob, nmt
from torquerig.driver.wire.frame import Frame, worst_case_bits
from torquerig.driver.wire.nmt import NmtCommand
from torquerig.driver.wire.sync import SYNC_FRAME
from torquerig.experiment import run_experiment

NS_PER_S: Final = 10**9
US_PER_S: Final = 1e6
RATES_HZ: Final = (250.0, 1000.0)
DRIVES: Final = (3, 12, 30)
ROTORS: Final = "rotors"
MANIPULATOR: Final = "manipulator"
BIT_RATE: Final = 1_000_000
FAST_BIT_RATE: Final = 10_000_000
"""For cycles that no CAN carries: what is measured is the simulator's work, not the wire's limit."""
HIGHEST_LOAD: Final = 0.8  # of cyclic frames, as in `torquerig busload`
SHORTEST_HOLD: Final = 0.1  # [s] of a run's end, so that there is something to take the time of
TORQUE_COUNTS: Final = 20  # 1 mN·m
_WALK: Final = (0x06, 0x07, 0x0F)  # shutdown, switch on, enable operation (CiA 402, controlword)
_TPDO: Final = struct.Struct("<Hih")
_RPDO: Final = struct.Struct("<Hh")


class Row(NamedTuple):
    """How fast one simulation was.

    Attributes:
        rate_hz: Cycles a second of simulated time [Hz].
        drives: Drives on the wire.
        machine: What they turn: "rotors", exchanged with by the least of masters; or "manipulator", all of a run.
        bit_rate: Of the wire [bit/s].
        times_real_time: Simulated time over the time it took: the median of the turns.
        best: The same in the best turn.
    """

    rate_hz: float
    drives: int
    machine: str
    bit_rate: int
    times_real_time: float
    best: float


class RotorRig:
    """Drives on rotors, enabled, and a master that knows nothing but the cycle.

    Attributes:
        drives: How many.
        bit_rate: Of the wire [bit/s].
        period_ns: From SYNC to SYNC [ns].
        statuswords: What the drives said once they were enabled.
    """

    def __init__(self, drives: int, rate_hz: float) -> None:
        """Switch on, start and enable the drives."""
        machine = BareRotor(ROTOR, axes=drives)
        nodes = [SimulatedDrive(axis + 1, axis, machine, DriveParameters()) for axis in range(drives)]
        self.drives = drives
        self.bit_rate = BIT_RATE if _load(drives, rate_hz) <= HIGHEST_LOAD else FAST_BIT_RATE
        self.period_ns = round(NS_PER_S / rate_hz)
        self._node_ids = range(1, drives + 1)
        self._bus = LockstepBus(SimulatedNetwork(SimulatedDevices(nodes), self.bit_rate))
        self._due_ns = 10 * self.period_ns
        self._sign = 1
        self._bus.wait_until(self._due_ns)
        self._bus.send(nmt.encode_command(NmtCommand.START, 0))
        for controlword in _WALK:
            self._cycle(controlword, 0)
        self.turn(2)
        self.statuswords = self._cycle(_WALK[-1], 0)

    def turn(self, cycles: int) -> int:
        """Simulate some cycles; how long that took [ns]."""
        began = perf_counter_ns()
        for _ in range(cycles):
            self._sign = -self._sign
            self._cycle(_WALK[-1], self._sign * TORQUE_COUNTS)
        return perf_counter_ns() - began

    def close(self) -> None:
        """Let go of the bus."""
        self._bus.close()

    def _cycle(self, controlword: int, counts: int) -> list[int]:
        """SYNC, all TPDOs, all RPDOs; the statuswords."""
        bus = self._bus
        bus.wait_until(self._due_ns)
        while bus.receive(self._due_ns) is not None:
            pass  # heartbeats, boot-up messages
        self._due_ns += self.period_ns
        bus.send(SYNC_FRAME)
        statuswords: list[int] = []
        while len(statuswords) < len(self._node_ids):
            arrival = bus.receive(self._due_ns)
            if arrival is None:
                raise RuntimeError(f"{len(statuswords)} of {len(self._node_ids)} simulated drives answered SYNC")
            if cob.TPDO[1] < arrival.frame.can_id <= cob.TPDO[1] + len(self._node_ids):
                statuswords.append(_TPDO.unpack(arrival.frame.data)[0])
        for node_id in self._node_ids:
            bus.send(Frame(cob.RPDO[1] + node_id, _RPDO.pack(controlword, counts)))
        return statuswords


class RunClock:
    """Watches a run and takes the time from the first to the last part of the loop that it is told of."""

    def __init__(self) -> None:
        self._told: list[tuple[int, int]] = []

    def phase(self, words: str) -> None:
        """Something new begins."""

    def prepare(self, words: str, cycles: int) -> None:
        """The loop will begin."""

    def cycles_done(self, done: int) -> None:
        """So many cycles are done."""
        self._told.append((done, perf_counter_ns()))

    def of_cycles(self, cycles: int) -> int:
        """How long so many cycles took [ns]."""
        (first, began), (last, ended) = self._told[0], self._told[-1]
        return (ended - began) * cycles // (last - first)


def run_turn(rate_hz: float) -> Turn:
    """A turn that is a lockstep run of the thesis' experiment: drives, wire, manipulator, driver, loop, law and log."""

    def turn(cycles: int) -> int:
        hold = max(cycles / rate_hz, SHORTEST_HOLD)
        options = {"loop.rate_hz": rate_hz, "bus.url": "lockstep:", "approach.hold_after": hold}
        clock = RunClock()
        run_experiment(load_configuration(None, options, origin="benchmark"), watcher=clock)
        return clock.of_cycles(cycles)

    return turn


def measure(
    *,
    turns: int,
    turn_s: float,
    rates_hz: Sequence[float] = RATES_HZ,
    drives: Sequence[int] = DRIVES,
) -> list[Row]:
    """How many times faster than real time the simulations are, taken in turns.

    Args:
        turns: How many turns each has.
        turn_s: How long a turn lasts, about [s].
        rates_hz: Cycles a second.
        drives: How many drives on rotors; the manipulator always has three.
    """
    rows = []
    for rate_hz in rates_hz:
        with ExitStack() as stack:
            rigs = [RotorRig(count, rate_hz) for count in drives]
            for rig in rigs:
                stack.callback(rig.close)
            variants: dict[str, Turn] = {f"{rig.drives}": rig.turn for rig in rigs}
            timings = take_turns({**variants, MANIPULATOR: run_turn(rate_hz)}, turns=turns, turn_s=turn_s)
        wires = [(f"{rig.drives}", rig.drives, ROTORS, rig.bit_rate) for rig in rigs]
        for name, count, machine, bit_rate in [*wires, (MANIPULATOR, 3, MANIPULATOR, BIT_RATE)]:
            period_us = US_PER_S / rate_hz
            times, best = period_us / timings.median_us(name), period_us / timings.best_us(name)
            rows.append(Row(rate_hz, count, machine, bit_rate, times, best))
    return rows


def _load(drives: int, rate_hz: float) -> float:
    """Load of the usual wire by the cycle's frames."""
    bits = worst_case_bits(0) + drives * (worst_case_bits(_TPDO.size) + worst_case_bits(_RPDO.size))
    return bits * rate_hz / BIT_RATE
