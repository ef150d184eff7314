"""The laws as the loop runs them, beside the same equations in plain numpy; and the four inverse dynamics."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from time import perf_counter_ns
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from torquerig import building
from torquerig.benchmarks.harness import Turn, take_turns
from torquerig.benchmarks.plain import PlainManipulator
from torquerig.configuration import load_configuration
from torquerig.control.law import Desired
from torquerig.control.laws import load_laws
from torquerig.control.loop import Controller
from torquerig.control.reference import ReferenceTable
from torquerig.control.row import Row
from torquerig.dynamics_cost import Cost, compare, random_states
from torquerig.mechanism import Manipulator, warm_up
from torquerig.planning import plan_motion

Array = NDArray[np.float64]

INSTANTS: Final = 500
"""Ten times through test motion 1."""
ERROR: Final = 1e-4
"""How far each joint of the samples is off the reference [rad], so that the laws have something to do; our choice."""


class Sample(NamedTuple):
    """A sample that nobody took; satisfies `JointSample`."""

    at_ns: int
    q: Array
    torque: Array
    complete: bool = True
    answered_ns: Array | None = None


class Instant(NamedTuple):
    """What a cycle starts from.

    Attributes:
        k: Its place among the instants.
        sample: The joints.
        desired: What the reference asks for.
    """

    k: int
    sample: Sample
    desired: Desired


@dataclass(frozen=True, slots=True)
class LawCost:
    """What a law costs in a cycle, without the exchange with the drives.

    Attributes:
        loop_us: Estimator, kinematics, limits, law and clipping as in the loop, the median of the turns [us].
        loop_best_us: The same, the best turn [us].
        numpy_us: The same equations in plain numpy, the median of the turns [us].
        numpy_over_loop: How many times as long that takes: the median of the ratios in the same turn.
    """

    loop_us: float
    loop_best_us: float
    numpy_us: float
    numpy_over_loop: float


@dataclass(frozen=True, slots=True)
class LawCosts:
    """What the benchmark found.

    Attributes:
        laws: By the law's name.
        inverse_dynamics: Of the four ways.
    """

    laws: Mapping[str, LawCost]
    inverse_dynamics: tuple[Cost, ...]

    def as_json(self) -> dict[str, Any]:
        """The costs, times in microseconds."""
        ways = [
            {"method": way.method, "operations": way.operations, "us": way.total_ns / 1000.0}
            for way in self.inverse_dynamics
        ]
        return {"laws": {name: asdict(cost) for name, cost in self.laws.items()}, "inverse_dynamics": ways}


class Mathematics(Protocol):
    """A cycle's mathematics."""

    def reset(self) -> None:
        """Forget the sample before."""
        ...

    def torque(self, instant: Instant) -> Array:
        """Motor torques, cut to the limit, shape (3,) [N·m at the motor]."""
        ...


class PlainLoop:
    """A cycle's mathematics in plain numpy: backward difference, kinematics, limits, a law of the thesis."""

    def __init__(self, controller: Controller) -> None:
        """Take the numbers of a controller."""
        law, limits = controller.law, controller.limits
        self._plain = PlainManipulator.like(controller.model)
        self._direct = np.array(controller.model.direct_singularities).reshape(-1, 2)
        self._kp, self._kv, self._friction = law.kp, law.kv, law.friction
        self._force = {
            "coupled-pd": self._coupled,
            "augmented-pd": self._augmented,
            "computed-torque": self._computed,
        }.get(law.name)
        self._low, self._high = (np.array(bounds) for bounds in zip(limits.x, limits.y, strict=True))
        self._limits = limits
        self.reset()

    def reset(self) -> None:
        """Forget the sample before."""
        self._before: tuple[Array, int] | None = None

    def torque(self, instant: Instant) -> Array:
        """Motor torques, cut to the limit, shape (3,) [N·m at the motor].

        Raises:
            ValueError: A limit is violated.
        """
        _, sample, desired = instant
        before, at_ns = self._before or (sample.q, sample.at_ns - 1)
        qd = (sample.q - before) / ((sample.at_ns - at_ns) * 1e-9)
        self._before = (sample.q, sample.at_ns)
        position = self._plain.position(sample.q)
        velocity = self._plain.task_velocity(position, qd)
        self._check(position, qd, desired)
        if self._force is None:
            tau = self._kp * (desired.q - sample.q) + self._kv * (desired.qd - qd)
        else:
            tau = self._plain.distribute(position, self._force(position, velocity, desired))
        if not np.all(np.abs(tau) <= self._limits.torque_stop):
            raise ValueError(f"torques {tau}")
        return np.clip(tau, -self._limits.torque, self._limits.torque)

    def _check(self, position: Array, qd: Array, desired: Desired) -> None:
        limits, plain = self._limits, self._plain
        inside = np.all((self._low <= position) & (position <= self._high))
        slow = np.all(np.abs(qd) <= limits.joint_speed)
        near = np.linalg.norm(desired.position - position) <= limits.position_error
        clear = plain.singularity_distance(position, self._direct) >= limits.singularity_distance
        if not (inside and slow and near and clear and plain.conditioning(position) >= limits.conditioning):
            raise ValueError(f"limits at {position}")

    def _coupled(self, position: Array, velocity: Array, desired: Desired) -> Array:
        force: Array = self._kp * (desired.position - position) + self._kv * (desired.velocity - velocity)
        return force

    def _augmented(self, position: Array, velocity: Array, desired: Desired) -> Array:
        Mt, Ct, Ft, _ = self._plain.dynamics(position, velocity)
        force: Array = Mt @ desired.acceleration + Ct @ desired.velocity + self._coupled(position, velocity, desired)
        return force + Ft @ desired.velocity if self._friction else force

    def _computed(self, position: Array, velocity: Array, desired: Desired) -> Array:
        Mt, _, Ft, _ = self._plain.dynamics(position, velocity)
        force: Array = Mt @ (desired.acceleration + self._coupled(position, velocity, desired))
        return force + Ft @ desired.velocity if self._friction else force


class LoopsOwn:
    """A cycle's mathematics as the loop has it from its controller."""

    def __init__(self, controller: Controller, instants: Sequence[Instant]) -> None:
        """Take a controller, and lay the instants out as the loop's reference."""
        self._controller = controller
        self._row = Row()
        parts = map(np.array, zip(*(instant.desired for instant in instants), strict=True))
        position, velocity, acceleration, q, qd = parts
        period_ns, moving = instants[0].sample.at_ns, np.ones(len(instants), dtype=np.bool_)
        table = ReferenceTable(period_ns, position, velocity, acceleration, q, qd, moving)
        self._compute = controller.along(table, None, self._row)

    def reset(self) -> None:
        """Forget the sample before."""
        self._controller.estimator.reset()

    def torque(self, instant: Instant) -> Array:
        """Motor torques, cut to the limit, shape (3,) [N·m at the motor]; the same array each time.

        Raises:
            LimitExceeded: A limit is violated.
        """
        self._compute(instant.k, instant.sample)
        return self._row.tau


def controller_of(law: str) -> Controller:
    """The shipped controller with a law and its gains for test motion 1."""
    return building.controller(load_configuration(None, {"loop.law": law}, origin="benchmark").rig)


def instants_of(controller: Controller, count: int) -> list[Instant]:
    """Samples along test motion 1, again and again, each joint a little off the reference.

    Args:
        controller: Its model and limits.
        count: How many samples.
    """
    configuration = load_configuration(None, {"loop.motion": 1}, origin="benchmark")
    table = plan_motion(configuration.rig, controller)
    rows, still = np.flatnonzero(table.in_motion).tolist(), np.zeros(3)
    return [
        Instant(k, Sample((k + 1) * table.period_ns, table.q[row] + ERROR, still), table.row(row))
        for k, row in enumerate(rows[k % len(rows)] for k in range(count))
    ]


def measure(*, turns: int, turn_s: float) -> LawCosts:
    """Time all laws both ways, in turns.

    Args:
        turns: How many turns each has.
        turn_s: How long a turn lasts, about [s].
    """
    warm_up()
    variants: dict[str, Turn] = {}
    laws = list(load_laws())
    for law in laws:
        controller = controller_of(law)
        instants = instants_of(controller, INSTANTS)
        variants[f"{law} loop"] = _along(LoopsOwn(controller, instants), instants)
        variants[f"{law} numpy"] = _along(PlainLoop(controller), instants)
    timings = take_turns(variants, turns=turns, turn_s=turn_s)
    costs = {
        law: LawCost(
            loop_us=timings.median_us(f"{law} loop"),
            loop_best_us=timings.best_us(f"{law} loop"),
            numpy_us=timings.median_us(f"{law} numpy"),
            numpy_over_loop=timings.ratio(f"{law} numpy", f"{law} loop"),
        )
        for law in laws
    }
    return LawCosts(costs, compare(Manipulator.thesis(), random_states(), turns))


def _along(mathematics: Mathematics, instants: Sequence[Instant]) -> Turn:
    """A turn that goes through instants, one a cycle, and from the first again."""

    def turn(cycles: int) -> int:
        took_ns = 0
        for done in range(0, cycles, len(instants)):
            mathematics.reset()
            torque, chosen = mathematics.torque, instants[: cycles - done]
            began = perf_counter_ns()
            for instant in chosen:
                torque(instant)
            took_ns += perf_counter_ns() - began
        return took_ns

    return turn
