"""Kernels that are called without a look at their arguments' types."""

import numpy as np
import pytest

from torquerig.mechanism import HOME, Manipulator, kernels, solvers
from torquerig.mechanism.compiled import bind, entry

THESIS = Manipulator.thesis()


def test_a_bound_kernel_writes_into_its_arrays_what_the_kernel_would() -> None:
    position, force, tau, again = np.array(HOME), np.array((1.0, -2.0)), np.zeros(3), np.zeros(3)
    bound = bind(solvers.distribute, THESIS.constants, position, force, tau)
    assert bound() == solvers.distribute(THESIS.constants, position, force, again) == kernels.OK
    assert np.array_equal(tau, again)
    force *= 2.0
    assert bound() == kernels.OK
    assert np.array_equal(tau, 2.0 * again)


def test_scalars_follow_the_arrays() -> None:
    bound = bind(kernels.reach_status, THESIS.constants, scalars=("float64", "float64"))
    assert bound(*HOME) == kernels.OK
    assert bound(0.0, 0.2) == kernels.OUT_OF_REACH + 1


def test_without_machine_code_the_kernel_itself_is_called(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("torquerig.mechanism.compiled._CONFIG.DISABLE_JIT", 1)
    assert entry(solvers.gram, np.zeros(1), scalars=("float64", "float64")) is solvers.gram


def test_a_legs_force_is_that_of_the_matrices() -> None:
    """Mt a + Ct c + Ft f, each leg's part by itself, beside Mt, Ct, Ft as a whole."""
    velocity, a, c, f = (np.array(pair) for pair in ((0.2, -0.1), (5.0, -3.0), (0.3, 0.7), (-0.4, 0.2)))
    M, C, F, _ = THESIS.dynamics(HOME, velocity)
    legs = kernels.legs_at(THESIS.constants, *HOME)
    rows = kernels.rows_at(THESIS.constants, legs)
    pairs = [tuple(each.tolist()) for each in (velocity, a, c, f)]
    forces = [kernels.leg_force(THESIS.constants, i, legs[i], rows[i], *pairs) for i in range(3)]
    assert np.sum(forces, axis=0) == pytest.approx(M @ a + C @ c + F @ f, rel=1e-12)
