"""Plants: what the simulated motors turn. Integrated lazily, compiled, with friction that really sticks."""

from torquerig.device_sim.plant.elastic import ElasticManipulatorMachine
from torquerig.device_sim.plant.friction import Friction
from torquerig.device_sim.plant.manipulator import PlanarManipulatorMachine
from torquerig.device_sim.plant.rotor import BareRotor, RotorParameters
from torquerig.device_sim.plant.truth_log import TruthLog, TruthRows

__all__ = [
    "BareRotor",
    "ElasticManipulatorMachine",
    "Friction",
    "PlanarManipulatorMachine",
    "RotorParameters",
    "TruthLog",
    "TruthRows",
]
