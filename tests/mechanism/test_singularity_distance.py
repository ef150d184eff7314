"""How far the machine is from being singular, in metres."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.mechanism import HOME, Manipulator

THESIS = Manipulator.thesis()
MODES = list(product((1, -1), repeat=3))

positions = st.tuples(st.floats(0.06, 0.139), st.floats(0.0, 0.125))


def test_home_is_29_mm_from_the_nearest_stretched_leg() -> None:
    reach = min(0.14 - np.hypot(0.092 - x, 0.062 - y) for x, y in THESIS.bases)
    assert THESIS.singularity_distance(HOME) == pytest.approx(reach, abs=1e-15)
    assert THESIS.singularity_distance(HOME) == pytest.approx(0.0291, abs=1e-4)


def test_the_thesis_working_mode_has_no_direct_singularity() -> None:
    assert THESIS.direct_singularities == []


def test_two_other_working_modes_have_one_direct_singularity_each() -> None:
    found = {mode: replace(THESIS, branches=mode).direct_singularities for mode in MODES}
    places = {mode: points for mode, points in found.items() if points}
    assert places[1, -1, 1] == [pytest.approx((0.0893711, 0.0942416), abs=1e-7)]
    assert places[-1, -1, 1] == [pytest.approx((0.0893711, 0.0297584), abs=1e-7)]
    assert len(places) == 2


@pytest.mark.parametrize("mode", [(1, -1, 1), (-1, -1, 1)])
def test_at_a_direct_singularity_the_machine_cannot_push_in_one_direction(mode: tuple[int, int, int]) -> None:
    machine = replace(THESIS, branches=mode)
    place = np.array(machine.direct_singularities[0])
    assert machine.conditioning(place) < 1e-12
    assert machine.singularity_distance(place) == pytest.approx(0.0, abs=1e-15)
    assert machine.singularity_distance(np.add(place, (0.003, -0.004))) == pytest.approx(0.005, abs=1e-15)


@pytest.mark.parametrize("mode", MODES)
def test_no_direct_singularity_is_missed(mode: tuple[int, int, int]) -> None:
    """A search over the workspace: wherever conditioning has a deep valley, a listed singularity is near."""
    machine = replace(THESIS, branches=mode)
    xs, ys = np.linspace(0.062, 0.137, 76), np.linspace(0.002, 0.122, 121)
    for point in product(xs, ys):
        distance = machine.singularity_distance(point)
        if distance > 0.004:  # off the stretched legs, where conditioning is small as well
            assert machine.conditioning(point) > 0.01


@given(positions, st.floats(0.0, 2.0 * np.pi), st.floats(0.0, 0.999))
def test_within_the_distance_every_way_is_free(position: tuple[float, float], direction: float, share: float) -> None:
    distance = THESIS.singularity_distance(position)
    if distance > 1e-6:
        step = share * distance * np.array((np.cos(direction), np.sin(direction)))
        assert THESIS.conditioning(np.add(position, step)) > 0.0


def test_the_distance_is_below_zero_out_of_reach_and_nan_for_nan() -> None:
    assert THESIS.singularity_distance((0.150, 0.062)) == pytest.approx(-0.01, abs=1e-15)
    assert np.isnan(THESIS.singularity_distance((np.nan, 0.062)))


def test_a_folded_leg_counts_as_singular() -> None:
    long = replace(THESIS, link_length=0.2)
    assert long.singularity_distance((0.003, 0.066)) == pytest.approx(0.005, abs=1e-15)
