import math
from typing import ClassVar

import numpy as np
import pytest

from torquerig.control.comparison import published_runs, typical_factor
from torquerig.control.law import Published
from torquerig.control.laws import law_named, load_laws

LAWS = {"decoupled-pd", "coupled-pd", "augmented-pd", "computed-torque"}


def test_the_thesis_has_four_laws_in_two_motions():
    runs = published_runs()
    assert len(runs) == 8
    assert {(run.law, run.motion) for run in runs} == {(law, motion) for law in LAWS for motion in (1, 2)}
    assert [run.motion for run in runs] == [1] * 4 + [2] * 4


def test_a_published_run_is_what_its_law_carries():
    for run in published_runs():
        published = law_named(run.law).published[run.motion]
        assert (run.position_rmse_mm, run.velocity_rmse_m_s) == published[:2]


def test_somebody_elses_result_is_none_of_the_thesis(monkeypatch):
    class Newer(law_named("coupled-pd")):
        published: ClassVar = {1: Published(1.0, 0.1, "a paper of 2010, Table 1")}

    monkeypatch.setattr("torquerig.control.comparison.load_laws", lambda: {**load_laws(), "newer": Newer})
    assert {run.law for run in published_runs()} == LAWS


def test_equal_numbers_have_the_factor_one():
    assert typical_factor([1.2, 0.07], [1.2, 0.07]) == 1.0


def test_twice_and_half_as_large_are_equally_far():
    assert typical_factor([2.0, 1.0], [1.0, 2.0]) == pytest.approx(2.0)
    assert typical_factor([2.0, 1.0], [1.0, 1.0]) == pytest.approx(2.0 ** math.sqrt(0.5))


def test_arrays_are_numbers_too():
    assert typical_factor(np.array([3.0]).tolist(), [1.0]) == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("simulated", "thesis"), [([], []), ([1.0], [1.0, 2.0]), ([0.0], [1.0]), ([math.nan], [1.0]), ([1.0], [-1.0])]
)
def test_numbers_without_a_ratio_are_refused(simulated, thesis):
    with pytest.raises(ValueError, match=r"numbers"):
        typical_factor(simulated, thesis)
