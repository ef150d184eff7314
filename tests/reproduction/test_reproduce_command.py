"""`torquerig reproduce`: every law found, in both motions, on both plants; JSON, pictures and records."""

import pyarrow.parquet as pq
import pytest

from torquerig.cli import main
from torquerig.control import law_named
from torquerig.experiment import Nobody
from torquerig.reproduction.experiments import THESIS_LAWS, Series, planned
from torquerig.reproduction.report import claim_folder

NUMBERS = ("position_rmse_mm", "velocity_rmse_m_s", "peak_torque_nm", "rms_torque_nm", "law_us")
PLAIN = ("2.2", "2.3", "6.2", "6.3")
OF_RUNS = ("6.4", "6.5", "6.6", "6.7", "6.8", "6.9", "6.10")


def test_only_one_json_object_is_printed(reproduced):
    assert reproduced.code == 0
    assert reproduced.printed.count("\n") == 1
    assert list(reproduced.plants) == ["identified", "fitted"]


def test_the_fitted_plant_is_within_a_factor_of_1_30(reproduced):
    assert reproduced.plants["fitted"]["compared_numbers"] == 16
    assert reproduced.plants["fitted"]["typical_factor"] <= 1.30
    assert reproduced.plants["identified"]["typical_factor"] == pytest.approx(1.82, abs=0.05)


@pytest.mark.parametrize("plant", ["identified", "fitted"])
def test_each_run_has_its_numbers_beside_the_thesis(reproduced, plant):
    for motion in (1, 2):
        for law in THESIS_LAWS:
            run, thesis = reproduced.runs(plant)[law, motion], law_named(law).published[motion]
            assert all(run[name] > 0 for name in NUMBERS)
            assert run["position_ratio"] == pytest.approx(run["position_rmse_mm"] / thesis.position_rmse_mm)
            assert run["velocity_ratio"] == pytest.approx(run["velocity_rmse_m_s"] / thesis.velocity_rmse_m_s)


def test_the_laws_computing_time_is_far_below_the_thesis(reproduced):
    assert all(run["law_us"] < 2710 for run in reproduced.runs("fitted").values() if run["ended"] == "done")


@pytest.mark.parametrize("motion", [1, 2])
def test_the_law_that_the_document_adds_is_run_and_has_no_ratio(reproduced, motion):
    run = reproduced.runs("fitted")["spring-damper", motion]
    assert run["ended"] == "done"
    assert 0.3 < run["position_rmse_mm"] < 3.0
    assert run["position_ratio"] is None
    assert "spring-damper" in (reproduced.place / "report.html").read_text(encoding="utf-8")


def test_a_run_that_a_limit_stops_is_told_and_the_others_go_on(reproduced):
    run = reproduced.runs("fitted")["greedy", 2]
    assert "limit" in run["ended"]
    assert run["position_ratio"] is None
    assert all(run[name] is None for name in NUMBERS)
    assert run["ended"] in (reproduced.place / "report.html").read_text(encoding="utf-8")


def test_a_law_without_gains_for_a_motion_is_left_out_of_it(reproduced):
    assert ("greedy", 1) not in reproduced.runs("fitted")


def test_every_figure_is_a_png_beside_the_report(reproduced):
    names = {f"figure-{number}.png" for number in PLAIN}
    names |= {f"figure-{number}-{plant}.png" for number in OF_RUNS for plant in ("identified", "fitted")}
    assert {path.name for path in reproduced.place.glob("*.png")} == names
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in reproduced.place.glob("*.png"))


def test_every_run_has_its_record(reproduced):
    records = sorted((reproduced.place / "records").iterdir())
    assert len(records) == sum(len(reproduced.runs(plant)) for plant in reproduced.plants)
    cycles = pq.read_table(reproduced.place / "records" / "fitted-coupled-pd-motion-2" / "cycles.parquet")
    assert sum(cycles["in_motion"].to_pylist()) == 40
    assert cycles.schema.field("law_ns").metadata[b"unit"] == b"ns"


def test_a_folder_that_is_not_empty_is_refused_before_anything_runs(reproduced, capsys):
    assert main(["reproduce", "--out", str(reproduced.place)]) == 2
    assert "is not empty" in capsys.readouterr().err


def test_an_unknown_plant_is_answered_with_the_known_ones(capsys, tmp_path):
    assert main(["reproduce", "--plant", "fited", "--out", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr()
    assert "'fited' is not a plant" in printed.err
    assert "fitted" in printed.err
    assert not (tmp_path / "out").exists()


def test_the_default_folder_is_the_first_free_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert [claim_folder(None).name for _ in range(3)] == [
        "torquerig-reproduction",
        "torquerig-reproduction-2",
        "torquerig-reproduction-3",
    ]


def test_the_experiments_are_the_thesis_whatever_a_file_says(tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text('[bus]\nurl = "socketcan:vcan0"\n[loop]\nrate_hz = 1000.0\nrepeat = 3\n')
    experiments = planned(["fitted"], mine)
    planned_laws = {motion: [each.law.name for each in experiments if each.motion == motion] for motion in (1, 2)}
    assert all(tuple(laws[: len(THESIS_LAWS)]) == THESIS_LAWS for laws in planned_laws.values())  # then those added
    for each in experiments:
        rig = each.configuration.rig
        assert (rig.bus.url, rig.loop.rate_hz, rig.loop.repeat) == ("lockstep:", 250.0, 1)


def test_one_bar_goes_over_all_experiments():
    told = []

    class Bar(Nobody):
        def prepare(self, words, cycles):
            told.append((words, cycles))

        def cycles_done(self, done):
            told.append(done)

    series = Series(Bar(), 8)
    for experiment in planned(["fitted"])[:2]:
        series.begin(experiment)
        series.prepare("", 100)
        series.cycles_done(50)
    assert told == [
        ("1 of 8: fitted, decoupled-pd, motion 1", 800),
        *(0, 50),
        ("2 of 8: fitted, coupled-pd, motion 1", 800),
        *(100, 150),
    ]


@pytest.mark.parametrize("motion", [1, 2])
def test_the_torque_components_tell_what_the_model_leaves_unexplained(reproduced, motion):
    page = (reproduced.place / "report.html").read_text(encoding="utf-8")
    caption = page.partition(f'id="figure-6.{motion + 3}"')[2].partition("<figure>")[0]
    assert "Residual: the torque recorded at that instant less their total" in caption
    assert "dry friction beyond the stiction is in it" in caption
