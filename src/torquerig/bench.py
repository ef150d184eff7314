"""The torque calibration bench: the three drives with locked rotors, and a torque transducer on their bus."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from torquerig.assembly import Rig, Simulation, nanoseconds, node_timing, open_rig, simulated_drives
from torquerig.buses import FrameLog
from torquerig.configuration import Configuration
from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.plant import TruthLog
from torquerig.device_sim.plant.locked import LockedRotors, LockParameters
from torquerig.device_sim.plant.rotor import BareRotor, RotorParameters
from torquerig.device_sim.transducer import SensorFault, SensorParameters, SimulatedTransducer
from torquerig.device_sim.transducer.objects import SAMPLE_RATE
from torquerig.driver.bus.interface import Tap
from torquerig.driver.master.transducer import TransducerSettings
from torquerig.driver.wire.measuring import TRANSDUCER_EDS
from torquerig.schema import Rig as Settings

ALL: Final = (1, 2, 3)
_ROTOR: Final = RotorParameters(inertia=0.098e-4)  # the motor's own [kg·m²] (thesis, Table A.1)
_US_PER_SECOND: Final = 1e6


def build_bench(settings: Settings, _truth: TruthLog | None = None, *, axes: tuple[int, ...] = ALL) -> Simulation:
    """Three drives on motors without a mechanism, rotors locked, and the transducer on the shaft of the loaded one.

    The transducer feels the sum of the locked shafts' torques. As only one axis is calibrated at a time, that is what
    moving it from axis to axis would do.

    Args:
        settings: The configuration.
        axes: Which rotors are locked, from 1; the others turn freely.

    Returns:
        The bench at time 0, its nodes about to be switched on.
    """
    bench, plant = settings.bench, settings.plant[settings.simulator.plant]
    machine = LockedRotors(
        BareRotor(_ROTOR, axes=len(ALL)),
        [axis - 1 for axis in axes],
        LockParameters(bench.friction, plant.current_lag),
    )
    sensor = SensorParameters(
        range=bench.range, noise=bench.noise, offset=bench.offset, fault=SensorFault(bench.fault), seed=bench.seed
    )
    transducer = SimulatedTransducer(
        bench.node_id, machine.shaft_torque, sensor, timing=node_timing(settings), eds=_eds(settings)
    )
    transducer.store.personalise(round(_US_PER_SECOND / bench.rate_hz), *SAMPLE_RATE)
    return Simulation(machine, SimulatedDevices([*simulated_drives(settings, machine), transducer]))


@contextmanager
def open_bench(configuration: Configuration, tap: Tap | FrameLog | None = None) -> Iterator[Rig]:
    """As `assembly.open_rig`, with the bench behind `lockstep:`.

    Args:
        configuration: The configuration.
        tap: Is told every frame.

    Yields:
        The rig; its bus is closed at the end.
    """
    with open_rig(configuration, tap, build=build_bench) as rig:
        yield rig


def transducer_settings(settings: Settings) -> TransducerSettings:
    """Which transducer the driver is to read, as [bench] says."""
    bench = settings.bench
    return TransducerSettings(bench.node_id, _eds(settings), bench.sign, nanoseconds(bench.stale))


def _eds(settings: Settings) -> Path:
    return Path(settings.bench.eds) if settings.bench.eds else TRANSDUCER_EDS
