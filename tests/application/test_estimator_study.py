"""`torquerig estimators`: what each estimator makes of the same angles, and of the loop."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from torquerig import estimator_study
from torquerig.cli.app import app
from torquerig.configuration import load_configuration
from torquerig.control.estimators import load_estimators, make_estimator
from torquerig.estimator_picture import estimator_figure
from torquerig.estimator_replay import SMOOTHER, TRUTH, replay_of
from torquerig.estimator_study import LoopEffect, study, torque_chatter
from torquerig.experiment import Nobody, run_experiment
from torquerig.records import open_record

SHORT = {"approach.hold_before": 0.02, "approach.hold_after": 0.0}


@pytest.fixture(scope="module")
def outcome_and_record(tmp_path_factory):
    """A run of the default experiment, and its record."""
    place = tmp_path_factory.mktemp("estimators") / "run"
    outcome = run_experiment(load_configuration(options=SHORT), record=place)
    return outcome, open_record(place)


@pytest.fixture
def two(monkeypatch):
    """Only two estimators, to save time."""
    kept = {name: kind for name, kind in load_estimators().items() if name in {"backward-difference", "moving-window"}}
    monkeypatch.setattr(estimator_study, "load_estimators", lambda: kept)


def test_on_simulated_angles_each_is_as_late_and_as_noisy_as_it_tells(outcome_and_record):
    replay = replay_of(outcome_and_record[1])
    assert replay.reference == TRUTH
    for name in load_estimators():
        estimator = make_estimator(name, 3, replay.sampling)
        estimates = replay.estimates(estimator)
        if name != "savitzky-golay":  # five samples are a quarter of a stroke: its delay at low frequency says little
            assert replay.delay(estimates, most=12.0) == pytest.approx(estimator.delay, abs=0.25), name
        told = estimator.noise_gain * replay.sampling.quantisation / replay.sampling.period
        assert 0.5 * told < replay.noise(estimator) < 1.3 * told, name
        assert replay.error(estimates) > replay.noise(estimator)


def test_the_encoder_says_the_truth_to_a_count(outcome_and_record):
    replay = replay_of(outcome_and_record[1])
    assert np.max(np.abs(replay.q - replay.angles)) <= replay.sampling.resolution


def test_where_nobody_knows_the_truth_a_smoother_comes_near_it(outcome_and_record):
    record = outcome_and_record[1]
    known, smoothed = replay_of(record), replay_of(replace(record, truth=None))
    assert (smoothed.reference, smoothed.angles) == (SMOOTHER, None)
    assert known.error(smoothed.rates) < 0.01
    for name in load_estimators():
        estimates = known.estimates(make_estimator(name, 3, known.sampling))
        assert smoothed.error(estimates) == pytest.approx(known.error(estimates), rel=0.1), name
        assert smoothed.delay(estimates, 12.0) == pytest.approx(known.delay(estimates, 12.0), abs=0.05), name


@pytest.mark.usefixtures("two")
def test_the_loops_are_those_of_run(outcome_and_record):
    outcome, record = outcome_and_record
    found = {each.name: each.loop for each in study(load_configuration(options=SHORT), record, Nobody()).findings}
    assert found["backward-difference"] == LoopEffect(
        outcome.summary.true_position_rmse_mm,
        outcome.summary.velocity_rmse_m_s,
        outcome.summary.rms_torque_nm,
        torque_chatter(outcome.log),
    )
    assert found["moving-window"].position_rmse_mm > 2 * found["backward-difference"].position_rmse_mm


def test_white_noise_chatters_with_its_own_deviation(outcome_and_record):
    log = replace(outcome_and_record[0].log)
    log.tau = np.random.default_rng(1).normal(scale=0.05, size=log.tau.shape)
    assert torque_chatter(log) == pytest.approx(0.05, rel=0.15)


@pytest.mark.usefixtures("two")
def test_a_loop_that_a_limit_stops_is_told_and_drawn(outcome_and_record):
    options = {**SHORT, "limits.position_error": 0.0025}
    result = study(load_configuration(options=options), outcome_and_record[1], Nobody())
    by_name = {each.name: each for each in result.findings}
    assert by_name["moving-window"].loop.stopped.startswith("position error limit")
    assert by_name["moving-window"].as_json()["loop"]["position_rmse_mm"] is None
    assert by_name["backward-difference"].loop.stopped == ""
    assert "stopped" in {text.get_text().strip() for text in estimator_figure(result, "").findobj(match=_is_text)}


def _is_text(artist):
    return hasattr(artist, "get_text")


@pytest.mark.usefixtures("two")
def test_the_command_takes_a_records_angles_and_settings(outcome_and_record, tmp_path):
    record, picture = outcome_and_record[1], tmp_path / "out.png"
    arguments = ["estimators", "--record", str(record.place), "--out", str(picture), "--plant", "ideal", "--json"]
    told = CliRunner().invoke(app, arguments, catch_exceptions=False)
    facts = json.loads(told.output)
    assert (facts["law"], facts["motion"], facts["plant"]) == ("computed-torque", 1, "ideal")
    assert (facts["reference"], facts["samples"], facts["period_ns"]) == (TRUTH, 50, 4_000_000)
    assert [each["name"] for each in facts["estimators"]] == ["backward-difference", "moving-window"]
    assert 0 < facts["estimators"][0]["loop"]["position_rmse_mm"] < 1
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.usefixtures("two")
def test_the_command_prints_two_tables_and_draws_a_picture(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    told = CliRunner().invoke(app, ["estimators", "--law", "coupled-pd"], catch_exceptions=False)
    assert told.exit_code == 0
    assert told.output.count("backward-difference") == 2
    assert "coupled-pd, motion 1, 250 Hz, plant fitted" in told.output.replace("\n", " ")
    assert (tmp_path / "torquerig-estimators.png").exists()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--record", "nowhere"], "there is no folder nowhere"),
        (["--out", "nowhere/out.png"], "nowhere/out.png cannot be written: there is no folder nowhere"),
        (["--estimator", "klman"], "loop.estimator = 'klman' is not an estimator; there are alpha-beta, backward-"),
    ],
)
def test_what_cannot_be_is_told_before_anything_runs(arguments, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    told = CliRunner().invoke(app, ["estimators", *arguments])
    assert told.exit_code == 2
    assert sentence in told.output


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('[loop]\nestimator = "klman"\n', "my.toml:2: loop.estimator = 'klman' is not an estimator; there are alpha"),
        ("[estimators.klman]\nx = 1\n", "my.toml:1: estimators.klman is not an estimator; did you mean kalman?"),
        ("[estimators.kalman]\njerk = 1\n", "estimators.kalman.jerk = 1 cannot be: kalman takes jerk_noise"),
        (
            "[estimators.moving-window]\nlength = 0\n",
            "my.toml:2: estimators.moving-window.length = 0 cannot be: it mus",
        ),
        ("[estimators.savitzky-golay]\norder = 5\n", "estimators.savitzky-golay.order = 5 cannot be: it must be below"),
        ("[loop]\nwindow = 9\n", "my.toml:2: loop.window is not a setting"),
    ],
)
def test_a_configuration_with_an_estimator_that_cannot_be_is_refused(text, sentence, tmp_path):
    path = tmp_path / "my.toml"
    path.write_text(text, encoding="utf-8")
    told = CliRunner().invoke(app, ["config", "--config", str(path)])
    assert told.exit_code == 2
    assert sentence in told.output
