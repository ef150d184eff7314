"""The four ways to the inverse dynamics, compared by what they cost."""

import numpy as np
import pytest

from torquerig.dynamics_cost import compare, operations, random_states, sweep, table
from torquerig.mechanism import Manipulator, solvers
from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.inverse_dynamics import METHODS
from torquerig.operations import Operations, count

THESIS = Manipulator.thesis()


@compiled
def halved(a, out):
    for i in range(2):
        out[i] = -a[i] / 2.0


@compiled
def sample(a, out):
    """Three additions, two multiplications, two divisions, one root."""
    halved(a, out)
    out[0] += a[0] * 3.0 - abs(a[1])
    out[1] += (2.0 * a[0]) ** 0.5 if a[1] > 100.0 else np.zeros(1)[0] * a[1]


def test_operations_are_counted_in_callees_too_and_the_result_is_the_kernels_own():
    a, out, again = np.array((4.0, 6.0)), np.zeros(2), np.zeros(2)
    sample(a, again)
    assert count(sample, a, out) == Operations(additions=3, multiplications=2, divisions=2)
    assert out.tolist() == again.tolist()


def test_counting_a_whole_kernel_does_not_change_what_it_computes():
    x, v, a, force, tau = (
        np.array(part) for part in ((0.1, 0.07), (0.1, 0.2), (3.0, -2.0), (0.0, 0.0), (0.0, 0.0, 0.0))
    )
    counted = count(solvers.inverse_dynamics, THESIS.packed, x, v, a, force, tau)
    assert tau == pytest.approx(THESIS.inverse_dynamics(x, v, a), rel=1e-14)
    assert counted.all > 300


def test_the_thesis_way_needs_the_fewest_operations_and_multipliers_the_most():
    for state in random_states(20):
        _, (dalembert, nakamura, ropponen, multipliers) = operations(THESIS, state)
        assert dalembert < ropponen < nakamura < multipliers


def test_what_all_four_share_is_most_of_the_work():
    tree, reduced = operations(THESIS, random_states(1)[0])
    assert tree > 5 * reduced[0]
    assert (tree + reduced[2]) / (tree + reduced[0]) < 1.12


@pytest.mark.parametrize("way", range(4))
def test_the_timed_sweep_computes_the_torques(way):
    states = random_states(3)
    torques = np.empty((3, 3))
    sweep(way, THESIS.packed, states, torques)
    method = list(METHODS.values())[way]
    expected = [THESIS.gear_ratio * method(THESIS, *np.split(state, 3)) for state in states]
    assert torques == pytest.approx(np.array(expected), rel=1e-9)


def test_the_table_has_a_row_a_way():
    costs = compare(THESIS, random_states(50), turns=2)
    assert [cost.method for cost in costs] == list(METHODS)
    assert all(cost.total_ns > 0 for cost in costs)
    assert len(table(costs).splitlines()) == 5
