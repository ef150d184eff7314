"""Joins simulator and driver: the machine, its drives, and the bus between them and their master."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import NamedTuple

from torquerig import schema_machines
from torquerig.axes import profile_of
from torquerig.building import period_ns
from torquerig.buses import FrameLog, bus_urls, homes_of, is_simulated
from torquerig.configuration import Configuration
from torquerig.device_sim.canopen.core import NodeTiming
from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.drive.parameters import DriveParameters
from torquerig.device_sim.machine import Machine
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.device_sim.plant import TruthLog, TruthRows
from torquerig.device_sim.plant.installation import Installation, InstalledMachine
from torquerig.device_sim.plant.locked import LockedRotors
from torquerig.driver.bus.interface import Bus, Tap
from torquerig.driver.bus.patient import PatientBus
from torquerig.driver.bus.several import SeveralBuses
from torquerig.driver.bus.url import LOCKSTEP, open_bus
from torquerig.driver.wire import cob
from torquerig.machines import SimulatedMachine, machine_of
from torquerig.schema import Rig as Settings
from torquerig.several_buses import PatientTaps, devices_by_bus, open_real_time, open_wires


class Simulation(NamedTuple):
    """The simulated side of a rig.

    Attributes:
        machine: What the motors turn.
        devices: The drives on it, and what else is on their bus.
    """

    machine: SimulatedMachine | LockedRotors
    devices: SimulatedDevices


Build = Callable[[Settings, TruthLog | None], Simulation]
"""Builds what is simulated, of the configuration and the log that is to keep the truth."""


@dataclass(frozen=True, slots=True)
class Rig:
    """A bus with drives on it.

    Attributes:
        bus: The bus, open.
        simulation: What is simulated in this process; None where the drives are elsewhere.
    """

    bus: Bus
    simulation: Simulation | None

    @property
    def is_simulated(self) -> bool:
        """Whether the drives are simulated in this process, in simulated time."""
        return self.simulation is not None

    @property
    def members(self) -> tuple[Bus, ...]:
        """Each bus of the rig on its own, in the order of `bus_urls`."""
        behind = self.bus.patient_with if isinstance(self.bus, PatientBus) else self.bus
        return behind.members if isinstance(behind, SeveralBuses) else (self.bus,)

    def truth(self) -> TruthRows | None:
        """What the simulated machine really did so far; None where nobody knows."""
        if self.simulation is None or self.simulation.machine.log is None:
            return None
        return self.simulation.machine.log.rows()


def build_simulation(settings: Settings, truth: TruthLog | None) -> Simulation:
    """The machine of `simulator.plant`, standing in the home fixture, and three drives that turn it.

    Args:
        settings: The configuration.
        truth: Where to keep what the machine really does.

    Returns:
        Both, at time 0, the drives about to be switched on.
    """
    plant = settings.plant[settings.simulator.plant]
    position = settings.simulator.stands_at or settings.model.home
    machine = machine_of(settings, plant, position=position, truth=truth)
    return Simulation(machine, SimulatedDevices(simulated_drives(settings, machine)))


def simulated_drives(settings: Settings, machine: Machine) -> list[SimulatedDrive]:
    """The three drives with what is true of them, wired and coupled to a machine as `simulator.installation` says."""
    plant = settings.plant[settings.simulator.plant]
    wiring = settings.simulator.installation
    installation = _installation(wiring)
    turned: Machine = InstalledMachine(machine, installation) if installation.shows(plant.torque_limit) else machine
    parameters = DriveParameters(
        gain_positive=settings.drive.gain_positive,
        gain_negative=settings.drive.gain_negative,
        rated_torque=settings.drive.rated_torque,
        peak_torque=plant.torque_limit,
        timing=node_timing(settings),
    )
    return [
        SimulatedDrive(axis.node_id, number, turned, replace(parameters, encoder_counts=wiring.encoder_counts[number]))
        for number, axis in enumerate(settings.axes.legs)
    ]


def node_timing(settings: Settings) -> NodeTiming:
    """How long simulated nodes take, as [drive] says."""
    return NodeTiming(
        boot_ns=nanoseconds(settings.drive.boot),
        answer_ns=nanoseconds(settings.drive.answer),
        sample_ns=nanoseconds(settings.drive.sample),
        reaction_ns=nanoseconds(settings.drive.reaction),
    )


def _installation(wiring: schema_machines.Installation) -> Installation:
    """How the drives are connected; legs count from 0 there."""
    m1, m2, m3 = (leg - 1 for leg in wiring.motors)
    e1, e2, e3 = (leg - 1 for leg in wiring.encoders)
    return Installation(
        (m1, m2, m3), (e1, e2, e3), wiring.torque_sign, wiring.encoder_sign, wiring.gear_factor, wiring.coupling
    )


@contextmanager
def open_rig(
    configuration: Configuration, tap: Tap | FrameLog | None = None, *, build: Build = build_simulation
) -> Iterator[Rig]:
    """Open the bus of `bus.url`, with simulated drives behind it if that is `lockstep:`; of several buses, all as one.

    Args:
        configuration: The configuration.
        tap: Is told every frame; where it keeps the frames of several buses apart, with its bus.
        build: Builds what `lockstep:` simulates.

    Yields:
        The rig; its bus is closed at the end.

    Raises:
        BusUrlError: The URL names nothing that can be opened.
        BusError: The interface is down.
    """
    settings = configuration.rig
    simulation: list[Simulation] = []

    def simulate() -> SimulatedDevices:
        simulation.append(build(configuration.simulated, TruthLog()))
        return simulation[0].devices

    bus = _open(settings, tap, simulate) if len(bus_urls(settings)) == 1 else _open_several(settings, tap, simulate)
    try:
        yield Rig(bus, simulation[0] if simulation else None)
    finally:
        bus.close()


def _open(settings: Settings, log: Tap | FrameLog | None, simulate: Callable[[], SimulatedDevices]) -> Bus:
    """The bus of a rig that has one."""
    bitrate, spin_ns = settings.bus.bitrate, spinning_ns(settings)
    tap = log.tap_of(0) if isinstance(log, FrameLog) else log

    def wire() -> SimulatedNetwork:
        return SimulatedNetwork(simulate(), bitrate)

    is_patient = settings.bus.patience > 0 and settings.bus.url.partition(":")[0] != LOCKSTEP
    inner_tap = None if is_patient else tap
    bus = open_bus(settings.bus.url, bitrate=bitrate, tap=inner_tap, wire=wire, spin_ns=spin_ns)
    return _patient(bus, settings, tap) if is_patient else bus


def _open_several(settings: Settings, log: Tap | FrameLog | None, simulate: Callable[[], SimulatedDevices]) -> Bus:
    """The buses of a rig that has several, as one."""
    urls, homes, bitrate = bus_urls(settings), homes_of(settings), settings.bus.bitrate

    def tap_of(place: int) -> Tap | None:
        return log.tap_of(place) if isinstance(log, FrameLog) else log

    if is_simulated(settings.bus.url):
        return open_wires(devices_by_bus(simulate(), homes, len(urls)), homes, bitrate, tap_of)
    taps = PatientTaps(tap_of)
    several = open_real_time(urls, homes, bitrate, taps.of, spin_ns=spinning_ns(settings))
    taps.bus = _patient(several, settings, None) if settings.bus.patience else None
    return taps.bus or several


def spinning_ns(settings: Settings) -> int:
    """How long before a deadline is spun: `loop.spin`, but never more than a quarter of the period [ns].

    A processor that a SCHED_FIFO thread never leaves is taken from it for 50 ms in every second, because others starve
    (Linux' fair server); seen at 4 kHz.
    """
    return min(nanoseconds(settings.loop.spin), period_ns(settings) // 4)


def _patient(bus: Bus, settings: Settings, tap: Tap | None) -> PatientBus:
    """The bus of a controller that waits for the answer of every drive, from when a quarter of the period is over."""
    answers = frozenset(cob.TPDO[profile_of(axis).tpdos[0].number] + axis.node_id for axis in settings.axes.legs)
    patience_ns = nanoseconds(settings.bus.patience)
    return PatientBus(bus, answers, within_ns=period_ns(settings) // 4, patience_ns=patience_ns, tap=tap)


def nanoseconds(seconds: float) -> int:
    """Seconds as whole nanoseconds."""
    return round(1e9 * seconds)
