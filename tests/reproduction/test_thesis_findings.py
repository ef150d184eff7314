"""What the thesis found, on our two plants: what comes out, and what is told as not coming out."""

from types import SimpleNamespace

import pytest

from torquerig.reproduction.experiments import THESIS_LAWS, Experiment, PlantRuns, Run, planned
from torquerig.reproduction.findings import findings
from torquerig.reproduction.tables import PlantReport
from torquerig.reproduction.verdicts import Claim

BOTH = ("identified", "fitted")


@pytest.fixture
def finding(reproduced):
    def find(plant, key, motion=None):
        (found,) = [
            each for each in reproduced.plants[plant]["findings"] if (each["finding"], each["motion"]) == (key, motion)
        ]
        return found

    return find


@pytest.mark.parametrize("plant", BOTH)
@pytest.mark.parametrize(("motion", "thesis"), [(1, 1.36), (2, 2.19)])
def test_model_based_control_beats_pd_in_both_motions(finding, plant, motion, thesis):
    found = finding(plant, "model-based-beats-pd", motion)
    assert found["number"] > 1.0
    assert found["thesis"] == pytest.approx(thesis, abs=0.005)
    assert found["verdict"] == "reproduced"


def test_the_gain_is_greater_in_the_fast_motion_on_the_fitted_plant_only(finding):
    fitted, identified = (finding(plant, "gain-greater-in-fast-motion") for plant in ("fitted", "identified"))
    assert (fitted["verdict"], identified["verdict"]) == ("reproduced", "not reproduced")
    assert fitted["number"] > 1.0 > identified["number"]


@pytest.mark.parametrize("plant", BOTH)
@pytest.mark.parametrize("motion", [1, 2])
def test_coupled_pd_takes_less_torque_than_decoupled_pd(reproduced, finding, plant, motion):
    found, runs = finding(plant, "coupled-pd-takes-less-torque", motion), reproduced.runs(plant)
    assert runs["coupled-pd", motion]["rms_torque_nm"] < runs["decoupled-pd", motion]["rms_torque_nm"]
    assert found["verdict"] == "reproduced"


@pytest.mark.parametrize("plant", BOTH)
@pytest.mark.parametrize("motion", [1, 2])
def test_coriolis_torque_is_below_a_twentieth_of_the_total(finding, plant, motion):
    found = finding(plant, "coriolis-insignificant", motion)
    assert 0.0 < found["number"] < 0.05
    assert found["verdict"] == "reproduced"


@pytest.mark.parametrize("plant", BOTH)
def test_peak_torque_of_the_slow_motion_lies_where_the_thesis_has_it(reproduced, finding, plant):
    peaks = [reproduced.runs(plant)[law, 1]["peak_torque_nm"] for law in THESIS_LAWS]
    assert all(0.2 <= peak <= 0.45 for peak in peaks)
    assert finding(plant, "peak-torque", 1)["verdict"] == "reproduced"


@pytest.mark.parametrize("plant", BOTH)
def test_peak_torque_of_the_fast_motion_is_told_as_greater(finding, plant):
    found = finding(plant, "peak-torque", 2)
    assert found["number"] > 0.5
    assert found["verdict"] == "not reproduced"


@pytest.mark.parametrize("plant", BOTH)
@pytest.mark.parametrize("motion", [1, 2])
def test_that_friction_dominates_along_the_reference_is_told_as_the_models(finding, plant, motion):
    found = finding(plant, "friction-dominates-at-constant-velocity", motion)
    assert found["number"] > 10.0
    assert found["verdict"] == "model"


def test_what_is_the_models_is_no_verdict_that_counts():
    stopped = tuple(Run(experiment, None, "position error limit") for experiment in planned(["fitted"]))
    report = PlantReport(PlantRuns("fitted", stopped), (judged(of_model=True), judged(of_model=False)))
    assert (report.reproduced, report.refutable) == (1, 1)


def judged(*, of_model):
    claim = Claim("key", "claim", 1, "measure", "1", "above 1", lambda number: number > 1.0, of_model=of_model)
    return claim.judged(2.0)


@pytest.mark.parametrize("plant", BOTH)
@pytest.mark.parametrize("motion", [1, 2])
def test_the_model_explains_the_torque_somewhat_worse_at_constant_velocity(finding, plant, motion):
    found = finding(plant, "model-worse-at-constant-velocity", motion)
    assert 1.0 < found["number"] < 2.0
    assert found["verdict"] == "reproduced"


def test_a_peak_is_told_by_the_drives_own_gain_too(reproduced, finding):
    found = finding("fitted", "peak-torque", 2)
    run = reproduced.runs("fitted")[found["law"], 2]
    assert run["true_peak_torque_nm"] == pytest.approx(0.494, abs=0.001)
    assert "0.494 N·m by the drive's own gain" in found["note"]


def test_without_one_of_the_thesis_runs_there_is_no_typical_factor():
    summary = SimpleNamespace(position_rmse_mm=1.0, velocity_rmse_m_s=0.1)
    runs = [Run(each, SimpleNamespace(summary=summary), "done") for each in planned(["fitted"])]
    report = PlantReport(PlantRuns("fitted", tuple(runs)), ())
    assert report.runs.typical_factor() is not None
    assert "of 16 numbers" in report.factor_in_words
    runs[3] = Run(runs[3].experiment, None, "position error limit")
    report = PlantReport(PlantRuns("fitted", tuple(runs)), ())
    assert report.runs.typical_factor() is None
    assert report.factor_in_words == "no typical factor, 14 of 16 numbers are there"


def test_findings_are_judged_on_the_thesis_laws_alone(reproduced):
    laws = {found["law"] for plant in BOTH for found in reproduced.plants[plant]["findings"]}
    assert laws <= {None, *THESIS_LAWS}


def test_without_its_runs_nothing_is_judged():
    stopped = tuple(Run(experiment, None, "position error limit") for experiment in planned(["fitted"]))
    judged = findings(PlantRuns("fitted", stopped))
    assert {finding.verdict for finding in judged} == {"not judged"}
    assert all(finding.as_json()["number"] is None for finding in judged)
    assert PlantRuns("fitted", stopped).typical_factor() is None


def test_an_experiment_knows_the_thesis_result():
    experiment: Experiment = planned(["fitted"])[0]
    assert experiment.published is not None
    assert experiment.published.position_rmse_mm == 1.2285
