"""What the thesis found, on our two plants: what comes out, and what is told as not coming out."""

import pytest

from torquerig.reproduction.experiments import THESIS_LAWS, Experiment, PlantRuns, Run, planned
from torquerig.reproduction.findings import findings

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
def test_friction_dominates_where_the_references_velocity_is_constant(finding, plant, motion):
    assert finding(plant, "friction-dominates-at-constant-velocity", motion)["number"] > 10.0


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
