"""The closed loops that a fit runs: as over the wire, and informative enough to find a known plant again."""

import re
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from torquerig.configuration import load_configuration
from torquerig.control.comparison import published_runs, typical_factor
from torquerig.experiment import run_experiment
from torquerig.plant_fit.experiments import thesis_errors
from torquerig.plant_fit.parameters import changed, chosen_parameters, from_unit
from torquerig.plant_fit.problem import Problem
from torquerig.plant_fit.search import Effort, optima, screen
from torquerig.plant_fit.workers import Task, ThisProcess, workers

RUNS = published_runs()
SHIPPED = files("torquerig").joinpath("rig.toml").read_text(encoding="utf-8")
DOCUMENT = (Path(__file__).parents[2] / "docs" / "fit-plant.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def base():
    return load_configuration()


@pytest.fixture(scope="module")
def here(base):
    return ThisProcess(base)


@pytest.mark.parametrize(("place", "plant"), [(1, "fitted"), (6, "identified")])
def test_a_run_without_the_wire_errs_as_the_run_over_it(base, here, place, plant):
    run = RUNS[place]
    options = {"loop.law": run.law, "loop.motion": run.motion, "simulator.plant": plant}
    summary = run_experiment(load_configuration(options=options)).summary
    task = Task(base.rig.plant[plant], (place,))
    without, wired = here.errors([task, task._replace(wired=True)])
    over = [summary.position_rmse_mm, summary.velocity_rmse_m_s]
    assert wired[0].tolist() == over
    np.testing.assert_allclose(without[0], over, rtol=1e-6)


def test_the_shipped_plant_is_as_near_to_the_thesis_over_the_wire_as_is_told(base, here):
    """In the shipped configuration and in the document; the wireless loops that the fit tries say the same."""
    everything = Task(base.rig.plant["fit5"], tuple(range(len(RUNS))))
    target = thesis_errors(RUNS)
    with_frames, without = (
        typical_factor(errors.ravel().tolist(), target.ravel().tolist())
        for errors in here.errors([everything._replace(wired=True), everything])
    )
    told = [re.search(r"plant\.fit5\](?:.|\n)*?typical factor (1\.\d{3})", text) for text in (SHIPPED, DOCUMENT)]
    assert [float(match[1]) for match in told if match] == pytest.approx([with_frames] * 2, abs=1.5e-3)
    assert with_frames <= 1.15
    assert without == pytest.approx(with_frames, rel=1e-3)


def test_a_fit_finds_the_plant_again_that_made_the_numbers(base, here):
    parameters = chosen_parameters(["coulomb", "torque_limit"])
    start = base.rig.plant["fitted"]
    truth = [1.1, 0.40]
    runs = RUNS[4:]  # motion 2 saturates
    assert {run.motion for run in runs} == {2}

    class Second:
        """Motion 2 alone, by the places that it has among all runs."""

        def errors(self, tasks):
            return here.errors([task._replace(which=tuple(place + 4 for place in task.which)) for task in tasks])

    target = here.errors([Task(changed(start, parameters, truth), tuple(range(4, 8)))])[0]
    problem = Problem(parameters, start, runs, Second(), target)
    effort = Effort(screened=8, starts=1, iterations=4)
    best = optima(problem, screen(problem, effort, 1), problem.all_runs(), effort)[0]
    assert from_unit(parameters, best.point) == pytest.approx(truth, rel=0.06)
    assert best.factor < 1.02


def test_two_processes_find_what_one_does_to_the_last_bit(base, here):
    plants = [base.rig.plant[name] for name in ("fitted", "identified", "ideal")]
    tasks = [Task(plant, (0, 5)) for plant in plants]
    with workers(base, 2) as two:
        both = two.errors(tasks)
    assert all((a == b).all() for a, b in zip(both, here.errors(tasks), strict=True))


def test_a_run_that_a_limit_stops_counts_as_ten_times_the_thesis(base):
    tight = load_configuration(options={"limits.position_error": 1e-4})
    errors = ThisProcess(tight).errors([Task(base.rig.plant["fitted"], (0,))])[0]
    assert errors[0].tolist() == [10 * RUNS[0].position_rmse_mm, 10 * RUNS[0].velocity_rmse_m_s]
