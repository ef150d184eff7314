"""`torquerig show` and `torquerig compare`: what they print, draw, and refuse."""

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from torquerig import load_configuration, run_experiment
from torquerig.building import controller
from torquerig.cli import main
from torquerig.control.errors import LimitExceeded
from torquerig.control.log import LoopLog
from torquerig.record_figures import differing, figures_of, ratio
from torquerig.records import open_record
from torquerig.simulator import begin_record
from torquerig.torque_parts import TorqueParts, measured_components


@pytest.fixture(scope="module")
def records(tmp_path_factory) -> Path:
    """Records of two laws, one of a run that a limit stopped, one of a run that never began, one of drives."""
    place = tmp_path_factory.mktemp("shown")
    run_experiment(load_configuration(), record=place / "ct")
    run_experiment(load_configuration(options={"loop.law": "coupled-pd"}), record=place / "cpd")
    with pytest.raises(LimitExceeded):
        run_experiment(load_configuration(options={"limits.position_error": 1e-3}), record=place / "stopped")
    with pytest.raises(LimitExceeded):
        run_experiment(load_configuration(options={"limits.workspace_x": [0.09, 0.1]}), record=place / "never")
    drives = begin_record(load_configuration(), place / "sim")
    for k in range(5):
        row = (0.09 + 0.001 * k, 0.06 + 0.001 * k, *[1.0] * 5, *[float(k)] * 3)
        drives.truth.append(k * 1_000_000, np.array(row))
    drives.write(origin_ns=0, lost=2, stood_still_ns=0)
    return place


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    return tmp_path


def printed(capsys, *arguments: object) -> str:
    assert main([str(argument) for argument in arguments]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out


def refused(capsys, *arguments: object) -> str:
    assert main([str(argument) for argument in arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    return captured.err


def test_a_run_is_shown_as_it_was_printed_and_drawn(capsys, records, elsewhere):
    text = printed(capsys, "show", records / "cpd")
    assert "coupled-pd, motion 1, 250 Hz, plant fitted" in text
    assert "1.5021" in text
    assert "Ended:   done" in text
    assert "Changed: loop.law (options)" in text
    assert (elsewhere / "torquerig-show.png").read_bytes().startswith(b"\x89PNG")


def test_a_stopped_run_is_shown_with_what_stopped_it(capsys, records):
    text = printed(capsys, "show", records / "stopped", "--picture", "here.png")
    assert "position error limit: end-effector at" in text
    assert " cycles\n" in text
    assert Path("here.png").exists()


def test_a_run_that_never_began_its_loop_is_told_and_not_drawn(capsys, records):
    text = printed(capsys, "show", records / "never")
    assert "Ended:   workspace limit: x at" in text
    assert "after 0 of its cycles" in text
    assert "Picture" not in text


def test_simulated_drives_are_shown_by_their_truth(capsys, records):
    text = printed(capsys, "show", records / "sim")
    assert "of simulated drives that began" in text
    assert "greatest x [mm]" in text
    assert "94.000" in text
    assert Path("torquerig-show.png").exists()


@pytest.mark.parametrize("name", ["ct", "cpd", "stopped", "never", "sim"])
def test_show_prints_one_json_object_of_any_record_and_draws_nothing(capsys, records, elsewhere, name):
    shown = json.loads(printed(capsys, "show", records / name, "--json"))
    assert set(shown) == {
        "record", "kind", "started", "ended", "planned_cycles", "notes", "summary", "figures", "counters", "sources",
        "torque_components",
    }  # fmt: skip
    assert (shown["torque_components"] is None) == (name in {"never", "sim"})
    assert list(elsewhere.iterdir()) == []
    if name == "sim":
        assert shown["counters"] == {"simulator": {"lost_frames": 2}}
        assert shown["figures"]["top_speed_m_s"] == pytest.approx(math.sqrt(2))


def test_a_run_is_shown_with_what_its_torques_are_made_of(capsys, records, elsewhere):
    text = printed(capsys, "show", records / "ct")
    assert "torque components, rms over motion and motors [N·m]" in text
    assert "Coriolis and centrifugal" in text
    assert (elsewhere / "torquerig-show.png").read_bytes()[16:24] == bytes.fromhex("00000672 00000618")  # 1650 x 1560
    parts = json.loads(printed(capsys, "show", records / "ct", "--json"))["torque_components"]
    assert 0.0 < parts["reference"]["coriolis"]["share"] < 0.05
    assert parts["measured"]["friction"]["rms_nm"] > 10 * parts["measured"]["coriolis"]["rms_nm"]
    assert parts["residual_rms_nm"] < parts["recorded_rms_nm"]


def test_a_record_of_another_versions_settings_is_shown_without_torque_components(capsys, records, tmp_path):
    shutil.copytree(records / "ct", tmp_path / "old")
    facts = json.loads((records / "ct" / "run.json").read_text(encoding="utf-8"))
    del facts["configuration"]["model"]["gear_ratio"]
    (tmp_path / "old" / "run.json").write_text(json.dumps(facts), encoding="utf-8")
    text = printed(capsys, "show", tmp_path / "old")
    assert "0.9592" in text
    assert "Torque components are not shown: the configuration in" in text
    assert json.loads(printed(capsys, "show", tmp_path / "old", "--json"))["torque_components"] is None


def test_torques_that_were_not_told_in_every_cycle_are_not_taken_apart(capsys, records, tmp_path):
    shutil.copytree(records / "ct", tmp_path / "group")
    facts = json.loads((records / "ct" / "run.json").read_text(encoding="utf-8"))
    facts["configuration"]["loop"]["group_rpdo"] = True
    (tmp_path / "group" / "run.json").write_text(json.dumps(facts), encoding="utf-8")
    assert "with loop.group_rpdo the drives do not tell their torque" in printed(capsys, "show", tmp_path / "group")


def test_the_laws_time_stands_beside_the_thesis_and_is_compared(capsys, records):
    shown = json.loads(printed(capsys, "show", records / "cpd", "--json"))
    assert shown["summary"]["thesis_ms"] == shown["figures"]["thesis_ms"] == 2.81
    assert 0 < shown["summary"]["law_us"] == shown["summary"]["timing"]["law_us"]["p50"]
    assert "│   2810 │" in printed(capsys, "show", records / "cpd")
    told = json.loads(printed(capsys, "compare", records / "ct", records / "cpd", "--json"))
    assert told["ratios"][1]["thesis_ms"] == pytest.approx(2.81 / 3.18)
    assert "the law in the thesis [ms]" in printed(capsys, "compare", records / "ct", records / "cpd")


def test_a_record_without_thesis_time_and_departures_is_read_as_one_that_has_none(records, tmp_path):
    shutil.copytree(records / "ct", tmp_path / "older")
    facts = json.loads((records / "ct" / "run.json").read_text(encoding="utf-8"))
    for key in ("thesis_ms", "departures", "law_us"):
        del facts["summary"][key]
    (tmp_path / "older" / "run.json").write_text(json.dumps(facts), encoding="utf-8")
    summary = open_record(tmp_path / "older").summary
    assert summary is not None
    assert (summary.thesis_ms, summary.departures) == (None, ())
    assert summary.law_us > 0


def test_differences_of_positions_span_the_thesis_sampling_time_at_any_rate(records):
    """At 1 kHz a torque over neighbouring samples would be the encoders' steps."""
    run = open_record(records / "ct")
    log, model = run.cycles(), controller(run.rig()).model
    fine = LoopLog.from_columns(
        {column.name: np.repeat(column.values, 4, axis=0) for column in log.columns()},
        start_ns=log.start_ns,
        period_ns=log.period_ns // 4,
    )
    coarse, same = measured_components(model, log).total, measured_components(model, fine).total[::4]
    np.testing.assert_array_equal(same[:50], coarse[:50])


def test_rows_without_neighbours_have_no_measured_components(records):
    run = open_record(records / "stopped")
    parts = TorqueParts.of(controller(run.rig()).model, run.cycles())
    assert np.isnan(parts.measured.total[-1]).all()
    assert np.isfinite(parts.measured.total[:-1]).all()
    assert np.isfinite(parts.reference.total).all()


def test_two_runs_are_compared_with_differences_ratios_and_settings(capsys, records, elsewhere):
    text = printed(capsys, "compare", records / "ct", records / "cpd")
    assert "B - A" in text
    assert "B / A" in text
    assert '"coupled-pd"' in text
    assert (elsewhere / "torquerig-compare.png").read_bytes().startswith(b"\x89PNG")
    shown = json.loads(printed(capsys, "compare", records / "ct", records / "cpd", "--json"))
    first, second = (record["figures"]["position_rmse_mm"] for record in shown["records"])
    assert shown["ratios"][1]["position_rmse_mm"] == pytest.approx(second / first)
    assert shown["differences"][1]["position_rmse_mm"] == pytest.approx(second - first)
    assert shown["settings"] == {"loop.law": ["computed-torque", "coupled-pd"]}


def test_many_runs_are_compared_with_the_first_also_stopped_ones(capsys, records):
    text = printed(capsys, "compare", records / "ct", records / "cpd", records / "stopped", "--picture", "c.png")
    assert "C / A" in text
    assert "B - A" not in text
    assert ", stopped" in text
    assert "ended: position error limit" in text
    assert Path("c.png").exists()


def test_a_record_compared_with_itself_has_ratios_of_one_and_no_differing_settings(records):
    run = open_record(records / "ct")
    assert differing([run, run]) == {}
    ratios = [ratio(figure.value, figure.value) for figure in figures_of(run)]
    assert all(value == 1 or math.isnan(value) for value in ratios)


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        (("ct",), "give 2 to 26 records: there are 1"),
        (("ct", "none"), "there is no folder"),
        (("ct", "sim"), "is a record of simulated drives: it has no cycles of a loop"),
        (("never", "ct"), "has no cycles: the run ended before the first one"),
    ],
)
def test_what_cannot_be_compared_is_refused_in_one_sentence(capsys, records, names, sentence):
    assert sentence in refused(capsys, "compare", *(records / name for name in names))


def test_what_is_no_record_is_not_shown(capsys, tmp_path):
    assert "is no record: there is no run.json in it" in refused(capsys, "show", tmp_path)
    assert "there is no folder nowhere" in refused(capsys, "show", "nowhere")
