"""Whether the machine can follow a motion of the user, found out before anything moves.

Every instant of the loop is held against the workspace, singularities, the joints' speed and, by inverse dynamics, the
motors' torque. What is wrong is told with its place, value, bound, and what would be right.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.motions import Motion
from torquerig.control.reference import NANOSECONDS_PER_SECOND, samples_in
from torquerig.errors import MotionError
from torquerig.mechanism import Manipulator, ReachError
from torquerig.schema import Limits

LEGS: Final = 3
MILLI: Final = 1e-3
SLOWEST: Final = 2.0**20
"""Times slower than asked: more than any remedy needs."""
PRECISELY: Final = 1.001
"""How close a remedy is to the least that fits."""

Place = Callable[[float], str]


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """A motion at instants.

    Attributes:
        times: Shape (n,) [s].
        position: Shape (n, 2) [m].
        velocity: Shape (n, 2) [m/s].
        acceleration: Shape (n, 2) [m/s²].
    """

    times: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]

    @classmethod
    def of(cls, motion: Motion, period_ns: int) -> "Samples":
        """A motion at the loop's instants, and at its end."""
        steps = range(samples_in(motion.duration, period_ns))
        times = np.array([*(k * period_ns / NANOSECONDS_PER_SECOND for k in steps), motion.duration])
        return cls(times, *(np.array(column) for column in zip(*map(motion.at, times.tolist()), strict=True)))


def check_motion(motion: Motion, model: Manipulator, limits: Limits, period_ns: int, place: Place) -> None:
    """Hold a whole motion against the limits.

    Args:
        motion: The motion.
        model: The machine as the controller knows it: its torque is that of the links, motors and viscous friction.
        limits: The limits of the configuration.
        period_ns: Sampling period of the loop.
        place: Names what the user wrote that asks for an instant of the motion [s].

    Raises:
        MotionError: It leaves what the machine may do: names place, value, bound, and what would be right.
    """
    samples = Samples.of(motion, period_ns)
    check_points(samples.times, samples.position, model, limits, place)
    demand = _Demand.of(samples, model)
    rates, torques = demand.slower(1.0)
    k, joint = _worst(rates)
    if not abs(rates[k, joint]) <= limits.joint_speed:
        raise MotionError(
            f"{place(samples.times[k])}: joint {joint + 1} would turn at {rates[k, joint]:.4g} rad/s,"
            f" limits.joint_speed is {limits.joint_speed:g} rad/s: {_remedy(demand, limits)}"
        )
    k, motor = _worst(torques)
    if not abs(torques[k, motor]) <= limits.torque:
        raise MotionError(
            f"{place(samples.times[k])}: motor {motor + 1} would need {torques[k, motor]:.4g} N·m, limits.torque is"
            f" {limits.torque:g} N·m: {_remedy(demand, limits)}"
        )


def check_points(
    times: NDArray[np.float64], points: NDArray[np.float64], model: Manipulator, limits: Limits, place: Place
) -> None:
    """Hold points against workspace and singularities.

    Args:
        times: When each is passed, shape (n,) [s].
        points: The points, shape (n, 2) [m].
        model: The machine as the controller knows it.
        limits: The limits of the configuration.
        place: Names what the user wrote that asks for a time [s].

    Raises:
        MotionError: A point is outside the workspace, out of reach, or too near to a singularity.
    """
    bounds = (limits.workspace_x, limits.workspace_y)
    for t, point in zip(times.tolist(), points.tolist(), strict=True):
        for name, value, (low, high) in zip("xy", point, bounds, strict=True):
            if not low <= value <= high:
                hint = "; positions are in metres" if low <= value * MILLI <= high else ""
                raise MotionError(
                    f"{place(t)}: {name} = {value:.6g} m cannot be: limits.workspace_{name} allows {low:g} to"
                    f" {high:g} m{hint}"
                )
        try:
            ratio = model.conditioning(point)
        except ReachError as error:
            raise MotionError(f"{place(t)}: {error}") from error
        if not ratio >= limits.conditioning:
            raise MotionError(
                f"{place(t)}: ({point[0]:.6g}, {point[1]:.6g}) m is too near to a singularity: its conditioning is"
                f" {ratio:.3g}, limits.conditioning asks for {limits.conditioning:g} at least; stay nearer to the"
                " middle of the legs"
            )
        distance = model.singularity_distance(point)
        if not distance >= limits.singularity_distance:
            raise MotionError(
                f"{place(t)}: ({point[0]:.6g}, {point[1]:.6g}) m is too near to a singularity: {distance:.3g} m away,"
                f" limits.singularity_distance asks for {limits.singularity_distance:g} m at least; stay nearer to the"
                " middle of the legs"
            )


@dataclass(frozen=True, slots=True, eq=False)
class _Demand:
    """What a motion asks of the joints.

    Made c times slower, its rates are 1/c of these, its torques inertia/c² + friction/c.

    Attributes:
        rates: Joint rates, shape (n, 3) [rad/s].
        inertia: Motor torques of inertia, Coriolis and centrifugal forces, shape (n, 3) [N·m].
        friction: Motor torques of viscous friction, shape (n, 3) [N·m].
    """

    rates: NDArray[np.float64]
    inertia: NDArray[np.float64]
    friction: NDArray[np.float64]

    @classmethod
    def of(cls, samples: Samples, model: Manipulator) -> "_Demand":
        """The demand of a motion; its parts come from the whole torques as it is, and at half the speed."""
        states = list(zip(samples.position, samples.velocity, samples.acceleration, strict=True))
        rates = np.array([model.joint_rates(x, v)[:LEGS] for x, v, _ in states])
        whole = np.array([model.inverse_dynamics(x, v, a) for x, v, a in states])
        halved = np.array([model.inverse_dynamics(x, v / 2, a / 4) for x, v, a in states])
        return cls(rates, inertia=2 * whole - 4 * halved, friction=4 * halved - whole)

    def slower(self, c: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rates and torques of the motion made c times slower."""
        return self.rates / c, self.inertia / c**2 + self.friction / c


def _remedy(demand: _Demand, limits: Limits) -> str:
    """What would be right, where a motion is too quick: how much slower it fits speed and torque."""

    def fits(c: float) -> bool:
        rates, torques = demand.slower(c)
        return bool(np.max(np.abs(rates)) <= limits.joint_speed and np.max(np.abs(torques)) <= limits.torque)

    low, high = 1.0, SLOWEST
    while high / low > PRECISELY:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if fits(middle) else (middle, high)
    return f"it fits if it takes {math.ceil(100 * high) / 100:.2f} times as long"


def _worst(values: NDArray[np.float64]) -> tuple[int, int]:
    """Row and column of the greatest size."""
    row, column = np.unravel_index(np.argmax(np.abs(values)), values.shape)
    return int(row), int(column)
