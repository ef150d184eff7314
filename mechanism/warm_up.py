"""`warm_up`: all compiling done, before a deadline counts."""

from torquerig.mechanism.manipulator import HOME, Manipulator


def warm_up() -> None:
    """Compiles what a control loop calls, or loads it from the disk cache.

    That is Manipulator but for forward_dynamics and inverse_dynamics: those wait for their first call.
    """
    machine = Manipulator.thesis()
    rest = (0.0, 0.0)
    machine.forward_kinematics(machine.inverse_kinematics(HOME).theta)
    machine.jacobian_rates(HOME, rest)
    machine.dynamics(HOME, rest)
    machine.distribute(HOME, rest)
    machine.task_velocity(HOME, (0.0, 0.0, 0.0))
    machine.conditioning(HOME)
    machine.singularity_distance(HOME)
