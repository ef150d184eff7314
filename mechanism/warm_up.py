"""`warm_up`: all compiling done, before a deadline counts."""

from torquerig.mechanism.manipulator import HOME, Manipulator


def warm_up() -> None:
    """Compiles every method of Manipulator, or loads it from the disk cache."""
    machine = Manipulator.thesis()
    rest = (0.0, 0.0)
    machine.forward_kinematics(machine.inverse_kinematics(HOME).theta)
    machine.jacobian_rates(HOME, rest)
    machine.dynamics(HOME, rest)
    machine.distribute(HOME, rest)
    machine.task_velocity(HOME, (0.0, 0.0, 0.0))
    machine.forward_dynamics(HOME, rest, machine.inverse_dynamics(HOME, rest, rest))
