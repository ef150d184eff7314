"""Joins simulator and driver: the machine, its drives, and the bus between them and their master."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import NamedTuple

from torquerig import schema
from torquerig.building import manipulator
from torquerig.configuration import Configuration
from torquerig.device_sim.canopen.core import NodeTiming
from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.drive.parameters import DriveParameters
from torquerig.device_sim.machine import Machine
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.device_sim.plant import Friction, PlanarManipulatorMachine, TruthLog, TruthRows
from torquerig.device_sim.plant.installation import Installation, InstalledMachine
from torquerig.device_sim.plant.locked import LockedRotors
from torquerig.driver.bus.interface import Bus, Tap
from torquerig.driver.bus.url import open_bus
from torquerig.schema import Rig as Settings


class Simulation(NamedTuple):
    """The simulated side of a rig.

    Attributes:
        machine: What the motors turn.
        devices: The drives on it, and what else is on their bus.
    """

    machine: PlanarManipulatorMachine | LockedRotors
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
    machine = PlanarManipulatorMachine(
        manipulator(settings.model, plant),
        Friction(plant.coulomb, plant.breakaway),
        lag=plant.current_lag,
        position=settings.simulator.stands_at or settings.model.home,
        step_ns=nanoseconds(settings.simulator.step),
        log=truth,
    )
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


def _installation(wiring: schema.Installation) -> Installation:
    """How the drives are connected; legs count from 0 there."""
    m1, m2, m3 = (leg - 1 for leg in wiring.motors)
    e1, e2, e3 = (leg - 1 for leg in wiring.encoders)
    return Installation(
        (m1, m2, m3), (e1, e2, e3), wiring.torque_sign, wiring.encoder_sign, wiring.gear_factor, wiring.coupling
    )


@contextmanager
def open_rig(configuration: Configuration, tap: Tap | None = None, *, build: Build = build_simulation) -> Iterator[Rig]:
    """Open the bus of `bus.url`, with simulated drives behind it if that is `lockstep:`.

    Args:
        configuration: The configuration.
        tap: Is told every frame.
        build: Builds what `lockstep:` simulates.

    Yields:
        The rig; its bus is closed at the end.

    Raises:
        BusUrlError: The URL names nothing that can be opened.
        BusError: The interface is down.
    """
    settings = configuration.rig
    simulation: list[Simulation] = []

    def wire() -> SimulatedNetwork:
        simulation.append(build(settings, TruthLog()))
        return SimulatedNetwork(simulation[0].devices, settings.bus.bitrate)

    spin_ns = nanoseconds(settings.loop.spin)
    bus = open_bus(settings.bus.url, bitrate=settings.bus.bitrate, tap=tap, wire=wire, spin_ns=spin_ns)
    try:
        yield Rig(bus, simulation[0] if simulation else None)
    finally:
        bus.close()


def nanoseconds(seconds: float) -> int:
    """Seconds as whole nanoseconds."""
    return round(1e9 * seconds)
