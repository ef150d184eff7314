"""What the four ways to the inverse dynamics cost: is the thesis' own the cheapest, as it claims?

    python -m torquerig.dynamics_cost

Operations are counted. Times are of compiled code against compiled code: each way runs many times over the same
motions, in turns with the others, and its best turn counts; so a busy machine disturbs all alike, and the least.
"""

from dataclasses import dataclass
from time import perf_counter_ns
from typing import Final

import numpy as np
import numpy.typing as npt

from torquerig.mechanism import Manipulator, multipliers, reductions
from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.inverse_dynamics import METHODS
from torquerig.operations import count

Array = npt.NDArray[np.float64]

STATES: Final = 2000
TURNS: Final = 15


@dataclass(frozen=True, slots=True)
class Cost:
    """What one way costs.

    Attributes:
        method: Its name in `inverse_dynamics.METHODS`.
        operations: Arithmetic operations of one evaluation from position, velocity and acceleration to torques.
        reduction: Of them, those after the open chains' torques, which all ways compute alike.
        total_ns: Time of one evaluation.
    """

    method: str
    operations: int
    reduction: int
    total_ns: float


def compare(model: Manipulator, states: Array, turns: int = TURNS) -> tuple[Cost, ...]:
    """The four ways' costs, in the order of `inverse_dynamics.METHODS`.

    Args:
        model: The machine.
        states: Positions [m], velocities [m/s] and accelerations [m/s²], shape (n, 6); within reach.
        turns: How often each is timed.
    """
    torques = np.empty((len(states), 3))
    for way in range(len(METHODS)):
        sweep(way, model.constants, states[:1], torques)
    best = [float("inf")] * len(METHODS)
    for _ in range(turns):
        for way in range(len(METHODS)):
            began = perf_counter_ns()
            sweep(way, model.constants, states, torques)
            best[way] = min(best[way], (perf_counter_ns() - began) / len(states))
    tree, reduced = operations(model, states[0])
    return tuple(Cost(name, tree + n, n, ns) for name, n, ns in zip(METHODS, reduced, best, strict=True))


def operations(model: Manipulator, state: Array) -> tuple[int, list[int]]:
    """Arithmetic operations of the open chains' torques, and of each way from there, in the order of the methods.

    Args:
        model: The machine.
        state: Position [m], velocity [m/s] and acceleration [m/s²], shape (6,).
    """
    W, links, tau_t, tau_a = np.zeros((6, 2)), np.zeros((3, 4)), np.zeros(6), np.zeros(3)
    motion = (state[:2].copy(), state[2:4].copy(), state[4:].copy())
    tree = count(reductions.open_chain, model.packed, *motion, W, links, tau_t)
    ways = (reductions.lagrange_dalembert, reductions.nakamura, reductions.ropponen)
    reduced = [count(way, W, tau_t, tau_a).all for way in ways]
    return tree.all, [*reduced, count(multipliers.lagrange_multipliers, links, tau_t, tau_a, np.zeros(4)).all]


def random_states(count: int = STATES, seed: int = 1) -> Array:
    """Motions as fast as the thesis' all over the region of its maps, shape (count, 6)."""
    low = np.array((0.08, 0.04, -0.3, -0.3, -15.0, -15.0))
    high = np.array((0.13, 0.09, 0.3, 0.3, 15.0, 15.0))
    return np.random.default_rng(seed).uniform(low, high, (count, 6))


@compiled
def sweep(way: int, p: Array, states: Array, torques: Array) -> None:
    """The method of this number over all states; joint torques into `torques`, shape (n, 3) [N·m]."""
    W = np.empty((6, 2))
    links = np.empty((3, 4))
    tau_t = np.empty(6)
    forces = np.empty(4)
    for k in range(states.shape[0]):
        state = states[k]
        reductions.open_chain(p, state[:2], state[2:4], state[4:], W, links, tau_t)
        if way == 0:
            reductions.lagrange_dalembert(W, tau_t, torques[k])
        elif way == 1:
            reductions.nakamura(W, tau_t, torques[k])
        elif way == 2:
            reductions.ropponen(W, tau_t, torques[k])
        else:
            multipliers.lagrange_multipliers(links, tau_t, torques[k], forces)


def table(costs: tuple[Cost, ...]) -> str:
    """The costs as a table, one row a way."""
    rows = [f"{cost.method:<22}{cost.operations:>12}{cost.reduction:>15}{cost.total_ns:>12.0f}" for cost in costs]
    return "\n".join([f"{'inverse dynamics by':<22}{'operations':>12}{'the reduction':>15}{'time [ns]':>12}", *rows])


if __name__ == "__main__":
    import click

    click.echo(table(compare(Manipulator.thesis(), random_states())))
