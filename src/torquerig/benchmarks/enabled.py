"""Simulated drives on bare rotors in lockstep, and a group of axes that has enabled them."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, NamedTuple

from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.drive.parameters import DriveParameters
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.device_sim.plant import BareRotor, RotorParameters
from torquerig.driver.bus.interface import Bus
from torquerig.driver.bus.lockstep import LockstepBus
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.master.profile import load_profile
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.master.settings import GroupSettings
from torquerig.driver.wire.frame import Arrival, Frame

ROTOR: Final = RotorParameters(inertia=0.098e-4, viscous=1e-4)
"""The rotor's inertia is Sanyo Denki P50B05010D's (thesis, Table A.1); the friction keeps it slow, our choice."""
BIT_RATE: Final = 1_000_000
PERIOD_NS: Final = 4_000_000
"""250 Hz (thesis, 6.4)."""


class LockstepSince:
    """A bus in lockstep whose time is another clock's; satisfies `Bus`. It stands still while nobody uses it."""

    def __init__(self, lockstep: LockstepBus, now_ns: int) -> None:
        """Let lockstep's present be a time of the other clock [ns]."""
        self._lockstep = lockstep
        self.go_on(now_ns)

    def go_on(self, now_ns: int) -> None:
        """Let lockstep's present be another time, now that it goes on [ns]."""
        self._origin_ns = now_ns - self._lockstep.now_ns()

    def now_ns(self) -> int:
        """The time [ns]."""
        return self._origin_ns + self._lockstep.now_ns()

    def wait_until(self, due_ns: int) -> None:
        """Advance the simulation."""
        self._lockstep.wait_until(due_ns - self._origin_ns)

    def send(self, frame: Frame) -> None:
        """Put a frame into the master's send queue."""
        self._lockstep.send(frame)

    def receive(self, until_ns: int) -> Arrival | None:
        """Advance to the next frame."""
        arrival = self._lockstep.receive(until_ns - self._origin_ns)
        return None if arrival is None else Arrival(arrival.at_ns + self._origin_ns, arrival.frame)

    def close(self) -> None:
        """End the simulation."""
        self._lockstep.close()


class EnabledRotors(NamedTuple):
    """A group that runs drives on rotors.

    Attributes:
        group: The group, enabled.
        bus: Its bus in lockstep.
    """

    group: AxisGroup
    bus: LockstepSince

    @contextmanager
    def moved_to(self, bus: Bus) -> Iterator[None]:
        """Have the enabled group on another bus for a while; its drives' time stands still meanwhile.

        Args:
            bus: Where somebody answers as the drives do.

        Yields:
            Nothing.
        """
        pump, exchange = self.group.session.pump, self.group.session.exchange
        pump.bus = bus
        exchange.open_port()
        try:
            yield
        finally:
            exchange.close_port()
            self.bus.go_on(bus.now_ns())
            pump.bus = self.bus


@contextmanager
def enabled_rotors(drives: int = 3, *, period_ns: int = PERIOD_NS, now_ns: int = 0) -> Iterator[EnabledRotors]:
    """Simulate drives, each with a rotor of its own, configure and enable them, and disable them at the end.

    Args:
        drives: How many; their node-ids are 1, 2, ...
        period_ns: Cycle of the group [ns].
        now_ns: What time it is at the beginning [ns].

    Yields:
        The group and its bus.
    """
    machine = BareRotor(ROTOR, axes=drives)
    nodes = [SimulatedDrive(axis + 1, axis, machine, DriveParameters()) for axis in range(drives)]
    bus = LockstepSince(LockstepBus(SimulatedNetwork(SimulatedDevices(nodes), BIT_RATE)), now_ns)
    profile = load_profile()
    axes = [AxisSettings(node.node_id, profile) for node in nodes]
    try:
        with AxisGroup(bus, axes, GroupSettings(period_ns=period_ns)) as group:
            group.home()
            group.enable()
            yield EnabledRotors(group, bus)
    finally:
        bus.close()
