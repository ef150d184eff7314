"""The search on a landscape that is known: errors by a formula instead of by closed loops."""

import numpy as np
import pytest

from torquerig.configuration import load_configuration
from torquerig.control.comparison import published_runs
from torquerig.plant_fit.fit import PlantFit, carry_out
from torquerig.plant_fit.flatness import flatness
from torquerig.plant_fit.parameters import chosen_parameters, from_unit, to_unit
from torquerig.plant_fit.problem import Problem, factor_of, thesis_target
from torquerig.plant_fit.report import as_json, verdict
from torquerig.plant_fit.search import Effort, optima, screen
from torquerig.stopping import Stopped

RUNS = published_runs()
TARGET = thesis_target(RUNS)
NAMES = ("coulomb", "active_viscous", "torque_limit")
EFFORT = Effort(screened=16, starts=2, iterations=8)
TRUTH = np.array([0.4, 0.3, 0.6])
SLOPES = np.random.default_rng(5).normal(size=(2 * len(RUNS), len(NAMES)))


class Formula:
    """Errors whose logarithms are linear in the shares, rough by `roughness`, and never below `misfit`."""

    def __init__(self, *, slopes=SLOPES, roughness=0.0, misfit=0.0, stop_after=None):
        self.slopes, self.roughness, self.misfit, self.stop_after = slopes, roughness, misfit, stop_after
        self.wired = 0

    def errors(self, tasks):
        return [self.one(*task) for task in tasks]

    def one(self, plant, which, wired):
        self.wired += wired
        if self.stop_after is not None:
            self.stop_after -= 1
            if self.stop_after < 0:
                raise Stopped(2)
        values = (plant.coulomb[0], plant.active_viscous, plant.torque_limit)
        off = to_unit(chosen_parameters(NAMES), values) - TRUTH
        logs = self.slopes @ off + self.roughness * np.sin(4e3 * off.sum()) + self.misfit * np.resize([1, -1], 16)
        return (TARGET * np.exp(logs).reshape(TARGET.shape))[list(which)]


class Nobody:
    def phase(self, words):
        pass

    def prepare(self, words, cycles):
        pass

    def cycles_done(self, done):
        pass


@pytest.fixture(scope="module")
def plant():
    return load_configuration().rig.plant["fitted"]


@pytest.fixture
def problem_of(plant):
    return lambda workers: Problem(chosen_parameters(NAMES), plant, RUNS, workers, TARGET)


def test_a_descent_finds_the_truth(problem_of):
    problem = problem_of(Formula())
    best = optima(problem, screen(problem, EFFORT, 1), problem.all_runs(), EFFORT)[0]
    np.testing.assert_allclose(best.point, TRUTH, atol=1e-6)
    assert best.factor == pytest.approx(1.0)


def test_roughness_finer_than_the_slopes_does_not_lead_a_descent_astray(problem_of):
    problem = problem_of(Formula(roughness=0.02))
    best = optima(problem, screen(problem, EFFORT, 1), problem.all_runs(), EFFORT)[0]
    np.testing.assert_allclose(best.point, TRUTH, atol=0.03)


def test_the_same_seed_finds_the_same_to_the_last_digit_and_another_one_tries_others(problem_of):
    def found(seed):
        problem = problem_of(Formula(roughness=0.02, misfit=0.1))
        screening = screen(problem, EFFORT, seed)
        return screening.points, optima(problem, screening, problem.all_runs(), EFFORT)[0].point

    first, second, other = found(3), found(3), found(4)
    assert all((a == b).all() for a, b in zip(first, second, strict=True))
    assert (first[0][:-1] != other[0][:-1]).all()


def test_an_optimum_beyond_a_bound_is_found_at_the_bound(problem_of, monkeypatch):
    monkeypatch.setattr(f"{__name__}.TRUTH", np.array([0.4, 0.3, 1.5]))
    problem = problem_of(Formula(slopes=np.vstack([np.eye(3)] * 6)[:16]))
    fit = PlantFit(problem)
    carry_out(fit, EFFORT, 1, Nobody())
    told = as_json(fit, 1, stopped=False)["parameters"]
    assert [each["at_bound"] for each in told] == [None, None, "upper"]
    assert told[2]["value"] == pytest.approx(0.95, rel=2e-3)


def test_the_leeway_is_that_of_a_parabola_whose_shape_is_known(problem_of):
    a = np.diag([3.0, 1.0, 0.2])
    slopes = np.zeros((16, 3))
    slopes[:3] = a
    misfit = np.where(np.arange(16) < 3, 0.0, 0.2)  # what no parameter can explain
    problem = problem_of(Formula(slopes=slopes, misfit=misfit))
    screening = screen(problem, EFFORT, 1)
    optimum = optima(problem, screening, problem.all_runs(), EFFORT)[0]
    around = flatness(problem, optimum)
    floor = np.log(optimum.factor)
    reach = np.sqrt(16 * ((floor + np.log(1.01)) ** 2 - floor**2)) / np.diag(a)
    expected_high = np.minimum(optimum.point + reach, 1.0)
    np.testing.assert_allclose(around.highest, expected_high, atol=0.035)
    assert around.condition == pytest.approx(15.0, rel=1e-3)
    np.testing.assert_allclose(around.correlation, np.eye(3), atol=1e-6)


def test_parameters_that_only_their_sum_tells_are_fully_anticorrelated_and_the_whole_range_is_as_good(problem_of):
    problem = problem_of(Formula(slopes=np.outer(np.ones(16), [1.0, 1.0, 0.0]) + np.outer(np.arange(16), [0, 0, 0.1])))
    optimum = optima(problem, screen(problem, EFFORT, 1), problem.all_runs(), EFFORT)[0]
    around = flatness(problem, optimum)
    assert around.correlation[0, 1] == pytest.approx(-1.0, abs=1e-3)
    assert (around.highest - around.lowest)[:2].min() > 0.6
    assert around.condition > 1e6


def test_a_fit_cross_validates_and_ends_over_the_wire(problem_of):
    workers = Formula(misfit=0.15)
    fit = PlantFit(problem_of(workers))
    carry_out(fit, EFFORT, 1, Nobody())
    assert [(each.fitted, each.judged) for each in fit.validations] == [(1, 2), (2, 1)]
    assert workers.wired == len(RUNS)
    assert fit.wired_factor == pytest.approx(fit.best.factor)
    assert fit.start_factor > fit.best.factor
    assert "not a validated plant" in verdict(fit)
    assert "not unique" in verdict(fit)


@pytest.mark.parametrize("after", [0, 5, 25, 60])
def test_a_stopped_fit_keeps_the_best_so_far(problem_of, after):
    problem = problem_of(Formula(stop_after=after))
    fit = PlantFit(problem)
    with pytest.raises(Stopped):
        carry_out(fit, EFFORT, 1, Nobody())
    told = as_json(fit, 1, stopped=True)
    assert told["stopped"]
    if after < 16:  # not even the screening's first batch was done
        assert told["typical_factor"] is None
    else:
        assert told["typical_factor"] == factor_of(problem.best[1])
        assert told["plant"]["torque_limit"] == from_unit(problem.parameters, fit.best.point)[2]
