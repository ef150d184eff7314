"""The simulated machine of a plant: rigid, or behind gears that give."""

from torquerig.building import manipulator
from torquerig.device_sim.plant import ElasticManipulatorMachine, Friction, PlanarManipulatorMachine, TruthLog
from torquerig.device_sim.plant.elastic import STIFFEST
from torquerig.schema import Rig
from torquerig.schema_machines import Plant

NS_PER_S = 1_000_000_000
SimulatedMachine = PlanarManipulatorMachine | ElasticManipulatorMachine


def machine_of(
    settings: Rig, plant: Plant, *, position: tuple[float, float], truth: TruthLog | None = None
) -> SimulatedMachine:
    """A plant's machine at rest at time 0.

    Args:
        settings: The rig: geometry, and how finely it is simulated.
        plant: The true machine.
        position: Where the end-effector stands [m].
        truth: Where to keep what the machine really does.

    Returns:
        The machine.

    Raises:
        ReachError, ValueError: It cannot stand there.
    """
    true = manipulator(settings.model, plant)
    friction = Friction(plant.coulomb, plant.breakaway)
    step_ns = round(settings.simulator.step * NS_PER_S)
    if plant.gear_compliance < STIFFEST:
        return PlanarManipulatorMachine(
            true, friction, lag=plant.current_lag, position=position, step_ns=step_ns, log=truth
        )
    return ElasticManipulatorMachine(
        true, friction, plant.gear_compliance, lag=plant.current_lag, position=position, step_ns=step_ns, log=truth
    )
