"""One integration step of the plant, beside plain numpy's and MuJoCo's on the same trajectory."""

import math
from dataclasses import asdict, dataclass
from time import perf_counter_ns
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.benchmarks import plant_mujoco
from torquerig.benchmarks.harness import Turn, take_turns
from torquerig.benchmarks.plain import PlainManipulator
from torquerig.benchmarks.plant_mujoco import MuJoCoPlant
from torquerig.device_sim.plant import Friction, PlanarManipulatorMachine
from torquerig.mechanism import HOME, Manipulator

Array = NDArray[np.float64]

NANOSECOND: Final = 1e-9  # [s]
STEP_NS: Final = 50_000
"""`simulator.step` of the shipped configuration."""
SEGMENT_STEPS: Final = 80
"""Torques are constant for so many steps: 4 ms, a period of the loop."""
SEGMENTS: Final = 10
"""The trajectory on which accuracies are compared lasts 40 ms."""
FINER: Final = 10
"""The reference has steps so much shorter: by RK4's fourth order its error is ten thousand times smaller."""
AMPLITUDE: Final = 0.1  # [N·m] at the motor; moves the end-effector by a few millimetres, our choice
FREQUENCY: Final = 20.0  # [Hz], our choice


@dataclass(frozen=True, slots=True)
class PlantCost:
    """What a step costs, and how far it goes astray.

    Attributes:
        step_ns: The step of all [ns].
        ours_us: A step of the simulator's machine, called from Python, the median of the turns [us].
        numpy_us: A step of the same Runge-Kutta method in plain numpy [us].
        mujoco_us: A step of MuJoCo's RK4 [us]; None without MuJoCo.
        numpy_over_ours: How many times as long: the median of the ratios in the same turn.
        mujoco_over_ours: Likewise; None without MuJoCo.
        ours_error_m: Greatest distance from the reference trajectory [m].
        numpy_error_m: Likewise.
        mujoco_error_m: Likewise; None without MuJoCo.
        mujoco_gap_m: How far apart MuJoCo lets the tips of the legs come, at most [m]; ours cannot.
    """

    step_ns: int
    ours_us: float
    numpy_us: float
    mujoco_us: float | None
    numpy_over_ours: float
    mujoco_over_ours: float | None
    ours_error_m: float
    numpy_error_m: float
    mujoco_error_m: float | None
    mujoco_gap_m: float | None

    def as_json(self) -> dict[str, Any]:
        """The figures."""
        return asdict(self)


class Ours:
    """The simulator's own machine, without dry friction and lag, as MuJoCo's and numpy's have none."""

    def __init__(self, step_ns: int) -> None:
        self._machine = PlanarManipulatorMachine(Manipulator.thesis(), Friction.none(), lag=0.0, step_ns=step_ns)
        self._step_ns = step_ns

    @property
    def position(self) -> Array:
        """The end-effector, shape (2,) [m]."""
        return self._machine.position

    def command(self, tau_m: Array) -> None:
        """From now on these motor torques, shape (3,) [N·m]."""
        for axis, torque in enumerate(tau_m.tolist()):
            self._machine.set_torque_demand(axis, torque, self._machine.now_ns)

    def step(self) -> None:
        """One step."""
        self._machine.advance(self._machine.now_ns + self._step_ns)


class Numpy:
    """Runge-Kutta of the same order in plain numpy."""

    def __init__(self, step_ns: int) -> None:
        self._plain = PlainManipulator.like(Manipulator.thesis())
        self._h = step_ns * NANOSECOND
        self.position: Array = np.array(HOME)
        self._velocity = np.zeros(2)
        self._tau_m = np.zeros(3)

    def command(self, tau_m: Array) -> None:
        """From now on these motor torques, shape (3,) [N·m]."""
        self._tau_m = tau_m

    def step(self) -> None:
        """One step."""
        self.position, self._velocity = self._plain.step(self.position, self._velocity, self._tau_m, self._h)


Plant = Ours | Numpy | MuJoCoPlant


def measure(*, turns: int, turn_s: float, step_ns: int = STEP_NS) -> PlantCost:
    """Time a step of each, in turns, and compare their trajectories.

    Args:
        turns: How many turns each has.
        turn_s: How long a turn lasts, about [s].
        step_ns: The step [ns].
    """
    model, step = Manipulator.thesis(), step_ns * NANOSECOND
    mujoco = plant_mujoco.find()
    plants: dict[str, Plant] = {"ours": Ours(step_ns), "numpy": Numpy(step_ns)}
    if mujoco is not None:
        plants["mujoco"] = MuJoCoPlant(mujoco, model, step)
    reference = trajectory(Ours(step_ns // FINER), FINER)[0]
    errors, gaps = {}, {}
    for name, plant in plants.items():
        places, gaps[name] = trajectory(plant)
        errors[name] = float(np.max(np.linalg.norm(places - reference, axis=1)))
    timings = take_turns({name: _along(plant) for name, plant in plants.items()}, turns=turns, turn_s=turn_s)
    return PlantCost(
        step_ns=step_ns,
        ours_us=timings.median_us("ours"),
        numpy_us=timings.median_us("numpy"),
        mujoco_us=timings.median_us("mujoco") if mujoco else None,
        numpy_over_ours=timings.ratio("numpy", "ours"),
        mujoco_over_ours=timings.ratio("mujoco", "ours") if mujoco else None,
        ours_error_m=errors["ours"],
        numpy_error_m=errors["numpy"],
        mujoco_error_m=errors.get("mujoco"),
        mujoco_gap_m=gaps.get("mujoco"),
    )


def trajectory(plant: Plant, finer: int = 1) -> tuple[Array, float]:
    """Where a plant goes from home, segment by segment, shape (SEGMENTS, 2) [m]; and the greatest gap of its tips [m].

    Args:
        plant: It ends without torque.
        finer: How many of its steps make a usual one.

    Returns:
        Places and gap.
    """
    places, gap = np.empty((SEGMENTS, 2)), 0.0
    for segment in range(SEGMENTS):
        plant.command(_torques(segment))
        for _ in range(SEGMENT_STEPS * finer):
            plant.step()
        places[segment] = plant.position
        gap = max(gap, plant.gap if isinstance(plant, MuJoCoPlant) else 0.0)
    plant.command(np.zeros(3))
    return places, gap


def _along(plant: Plant) -> Turn:
    """A turn that goes on along the trajectory; setting the torques is not timed."""

    def turn(steps: int) -> int:
        took_ns = 0
        for segment in range(-(-steps // SEGMENT_STEPS)):
            plant.command(_torques(segment))
            left = min(SEGMENT_STEPS, steps - segment * SEGMENT_STEPS)
            began = perf_counter_ns()
            for _ in range(left):
                plant.step()
            took_ns += perf_counter_ns() - began
        return took_ns

    return turn


def _torques(segment: int) -> Array:
    """Motor torques of a segment, shape (3,) [N·m]."""
    time = segment * SEGMENT_STEPS * STEP_NS * NANOSECOND
    phase = 2.0 * math.pi * FREQUENCY * time
    torques: Array = AMPLITUDE * np.sin(phase + 2.0 * math.pi / 3.0 * np.arange(3))
    return torques
