"""Simulated drives in real time whose regular cycle is compiled: for loops of several kilohertz."""

from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.drive import SimulatedDrive
from torquerig.device_sim.drive.steady import SteadyDrives
from torquerig.device_sim.plant.logged import LoggedMachine
from torquerig.driver.bus.interface import Bus
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Arrival, Frame
from torquerig.realtime import WAKE_NS, RealTimeDevices


def steady_drives(devices: SimulatedDevices) -> SteadyDrives | None:
    """Devices as steady operation sees them; None unless they are the drives of one machine, one for each motor."""
    nodes = list(devices.nodes.values())
    drives = [node for node in nodes if isinstance(node, SimulatedDrive)]
    machine = drives[0].machine if drives else None
    whole = [(drive.axis, drive.machine) for drive in drives] == [(axis, machine) for axis in range(len(nodes))]
    return SteadyDrives(drives, machine) if whole and isinstance(machine, LoggedMachine) else None


def joined_to(bus: Bus, devices: SimulatedDevices) -> RealTimeDevices:
    """Devices as members of a bus in real time, by the quickest way that they have."""
    steady = steady_drives(devices)
    return RealTimeDevices(bus, devices) if steady is None else SteadyRealTimeDevices(bus, devices, steady)


class SteadyRealTimeDevices(RealTimeDevices):
    """Simulated drives as members of a bus, which leave frame by frame whenever they are steady."""

    def __init__(self, bus: Bus, devices: SimulatedDevices, steady: SteadyDrives, wake_ns: int = WAKE_NS) -> None:
        """Join the drives to a bus; their time 0 is now.

        Args:
            bus: The bus, which must be in real time.
            devices: The drives, not advanced yet.
            steady: The same drives, as steady operation sees them.
            wake_ns: As for `RealTimeDevices` [ns].
        """
        super().__init__(bus, devices, wake_ns)
        self._steady = steady

    def step(self, until_ns: int) -> None:
        """Live steadily as long as that goes on; then as `RealTimeDevices`."""
        left = None
        if not len(self._queues) and self._steady.borrow(self._latest_ns):
            left = self._live_steadily(until_ns)
        if left is not None:
            self._queue(self._devices.receive(left.frame, self._latest_ns))
        elif self._latest_ns < until_ns:
            super().step(until_ns)

    def _live_steadily(self, until_ns: int) -> Arrival | None:
        """Take frames and let happen what is due while that is regular; a frame that is not comes back."""
        bus, steady = self._bus, self._steady
        arrival: Arrival | None = None
        try:
            regular = steady.advance(self._latest_ns)
            while regular and self._latest_ns < until_ns:
                due_ns = min(until_ns, steady.next_event_ns)
                arrival = bus.receive(self._origin_ns + due_ns)
                if arrival is None:
                    self._latest_ns = due_ns
                    regular = steady.advance(due_ns)
                elif not self._echoes.is_echo(arrival):
                    self._latest_ns = max(self._latest_ns, arrival.at_ns - self._origin_ns)
                    regular = steady.receive(arrival.frame, self._latest_ns)
                if frames := steady.take():
                    self._say(frames)
        finally:
            steady.give_back()
        return None if regular else arrival

    def _say(self, frames: list[Frame]) -> None:
        """Send what the drives have said; no sibling listens to it."""
        while frames:
            try:
                count = self._send_all(frames)
            except BusError:
                self.lost += 1
                count = 1
            else:
                for frame in frames[:count]:
                    self._echoes.sent(frame, self._origin_ns + self._latest_ns)
            frames = frames[count:]
