"""Chapter 2: what the third actuator gives, and what it does not."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.mechanism import HOME, Manipulator
from torquerig.mechanism.redundancy import (
    ALL_LEGS,
    PAIRS,
    active_jacobian,
    alignment,
    force_bounds,
    singular_values,
    stiffness,
    stiffness_norm,
    transmission,
)

THESIS = Manipulator.thesis()
GRID = np.stack(np.meshgrid(np.linspace(0.08, 0.13, 51), np.linspace(0.04, 0.09, 51)), axis=-1)
COARSE = np.stack(np.meshgrid(np.linspace(0.08, 0.13, 21), np.linspace(0.04, 0.09, 21)), axis=-1)

positions = st.tuples(st.floats(0.08, 0.13), st.floats(0.04, 0.09))
leg_sets = st.sampled_from([ALL_LEGS, *PAIRS])


@given(positions, leg_sets)
def test_singular_values_are_those_of_the_compiled_jacobian(position: tuple[float, float], legs: tuple[int]) -> None:
    S = THESIS.jacobians(position)[1][list(legs)]
    assert active_jacobian(THESIS, position, legs) == pytest.approx(S, rel=1e-12)
    expected = np.linalg.svd(S, compute_uv=False)
    assert singular_values(THESIS, position, legs) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_stiffness_spans_the_thesis_figure() -> None:
    redundant, pair = stiffness_norm(THESIS, GRID), stiffness_norm(THESIS, GRID, (0, 2))
    assert (redundant.min(), redundant.max()) == pytest.approx((428, 1885), abs=1)
    assert np.median(redundant) == pytest.approx(510, abs=1)
    assert (pair.min(), pair.max()) == pytest.approx((316, 852), abs=1)


def test_force_transmission_spans_the_thesis_figure() -> None:
    redundant, pair = transmission(THESIS, COARSE), transmission(THESIS, COARSE, (0, 1))
    assert (redundant.min(), redundant.max()) == pytest.approx((0.185, 0.875), abs=5e-4)
    assert redundant.mean() == pytest.approx(0.58, abs=1e-3)
    assert (pair.min(), pair.max()) == pytest.approx((0.002, 0.77), abs=5e-4)


@pytest.mark.parametrize("legs", PAIRS)
def test_a_third_leg_makes_the_machine_stiffer_everywhere_in_every_direction(legs: tuple[int, int]) -> None:
    gain = stiffness(THESIS, GRID) - stiffness(THESIS, GRID, legs)
    assert np.linalg.eigvalsh(gain).min() > -1e-9
    assert (stiffness_norm(THESIS, GRID) > stiffness_norm(THESIS, GRID, legs)).all()


def test_a_third_leg_evens_the_force_of_two_pairs_but_not_of_the_third() -> None:
    redundant = transmission(THESIS, GRID)
    means = {legs: transmission(THESIS, GRID, legs).mean() for legs in PAIRS}
    assert means[0, 1] < means[0, 2] + 0.1 < redundant.mean() < means[1, 2]
    assert redundant.min() > max(transmission(THESIS, GRID, legs).min() for legs in PAIRS)


def test_stiffness_grows_with_the_joints() -> None:
    assert stiffness(THESIS, HOME, joint_stiffness=250.0) == pytest.approx(250.0 * stiffness(THESIS, HOME))


@given(positions, leg_sets, st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_no_torque_gives_more_force_than_the_bounds(
    position: tuple[float, float], legs: tuple[int], torque: tuple[float, float, float]
) -> None:
    S = THESIS.jacobians(position)[1][list(legs)]
    strongest, weakest = force_bounds(THESIS, position, legs)
    tau = np.array(torque[: len(legs)])
    felt = S @ np.linalg.lstsq(S, tau, rcond=None)[0]  # without its internal preload
    force = np.linalg.norm(THESIS.gear_ratio * S.T @ felt)
    size = np.linalg.norm(felt)
    assert weakest * size * (1 - 1e-9) - 1e-9 <= force <= strongest * size * (1 + 1e-9) + 1e-9


def test_aligned_distal_links_are_singular_for_their_two_legs_only() -> None:
    row = np.stack((np.linspace(0.08, 0.13, 2001), np.full(2001, 0.08)), axis=-1)
    sine = alignment(THESIS, row, (0, 2))
    place = int(np.argmin(np.abs(sine)))
    assert 0 < place < 2000
    assert sine[place - 1] * sine[place + 1] < 0.0
    assert transmission(THESIS, row[place], (0, 2)) < 1e-3
    assert transmission(THESIS, row[place]) > 0.3


def test_out_of_reach_is_nan_for_the_driven_legs_only() -> None:
    behind = (0.2, 0.062)  # leg 1 is too short
    assert np.isnan(transmission(THESIS, behind))
    assert np.isfinite(transmission(THESIS, behind, (1, 2)))
