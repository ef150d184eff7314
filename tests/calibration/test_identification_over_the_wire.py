"""identify and zeros in lockstep over the simulated wire, from the plan to the JSON's facts."""

import json

import numpy as np
import pytest

from torquerig.calibrating.catalogue import offer
from torquerig.calibrating.conducting import perform
from torquerig.calibrating.offer import Request
from torquerig.calibrating.task import Task
from torquerig.calibration.procedure import Grade, Unwatched
from torquerig.cli import main
from torquerig.configuration import load_configuration
from torquerig.errors import ConfigurationError
from torquerig.experiment import run_experiment


def prepared(name, keys, **options):
    made = offer(name)
    request = Request(None, {each.name.replace("-", "_"): each.default for each in made.options} | options)
    return Task.prepare(name, made, load_configuration(options=keys), request)


def carry_out(name, keys, **options):
    task = prepared(name, keys, **options)
    result, _ = perform(task, Unwatched())
    return result, task.offer.truth(task.configuration, task.request)


def test_identify_finds_the_plant_within_a_percent_and_shows_the_thesis_bias(tmp_path):
    result, truth = carry_out("identify", {}, picture=tmp_path / "before.png")
    assert result.verdict.grade is Grade.OK
    for name, value in truth.items():
        assert result.facts["recommended"][name] == pytest.approx(value, rel=0.01)
        low, high = result.facts["intervals"][name]
        assert low <= value <= high
    assert result.facts["thesis"]["I1"] > 1.3 * truth["I1"]
    assert set(result.facts["thesis"]) == {"I1", "K1", "K2"}
    assert result.facts["condition_number"] < 5
    assert result.facts["validation_rmse_nm"] < 0.001
    assert result.settings["model.actuator_inertia"] == result.facts["recommended"]["I1"]
    json.dumps(result.facts, allow_nan=False)
    offer("identify").draw(result, "identify", tmp_path / "after.png")
    assert (tmp_path / "before.png").stat().st_size > 10_000
    assert (tmp_path / "after.png").stat().st_size > 10_000


def test_zeros_finds_a_home_fixture_that_is_off(tmp_path):
    result, truth = carry_out("zeros", {"simulator.stands_at": [0.0928, 0.0612]}, seconds=6.0)
    assert result.verdict.grade is Grade.OK
    assert np.max(np.abs(truth["zeros_deg"])) > 0.5
    np.testing.assert_allclose(result.facts["zeros_deg"], truth["zeros_deg"], atol=0.002)
    for true, (low, high) in zip(truth["zeros_deg"], result.facts["intervals_deg"], strict=True):
        assert low <= true <= high
    np.testing.assert_allclose(
        [result.settings[f"axes.{leg}.encoder_zero"] for leg in (1, 2, 3)], np.radians(result.facts["zeros_deg"])
    )
    offer("zeros").draw(result, "zeros", tmp_path / "zeros.png")
    assert (tmp_path / "zeros.png").stat().st_size > 10_000


def test_zeros_of_a_machine_nobody_moves_are_refused(tmp_path):
    result, _ = carry_out("zeros", {}, by_hand=True, seconds=1.0)
    assert result.verdict.grade is Grade.FAILED
    assert not result.settings
    offer("zeros").draw(result, "zeros", tmp_path / "zeros.png")


def test_zeros_of_a_record_open_no_bus(tmp_path):
    keys = {"loop.motion": "circle", "motion.circle.laps": 8, "simulator.stands_at": [0.0925, 0.0616]}
    run_experiment(load_configuration(options=keys), record=tmp_path / "run")
    result, _ = carry_out("zeros", {"bus.url": "unix:/nowhere"}, record=str(tmp_path / "run"))
    truth = prepared("zeros", keys).offer.truth(load_configuration(options=keys), prepared("zeros", keys).request)
    np.testing.assert_allclose(result.facts["zeros_deg"], truth["zeros_deg"], atol=0.004)


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("identify", {"torque": 2.0}, "--torque 2 N·m cannot be: above 0 and at most limits.torque = 0.98"),
        ("identify", {"periods": 0}, "--periods 0 cannot be: 1 to 100"),
        ("identify", {"lag": 1.0}, "--lag 1 s cannot be"),
        ("identify", {"torque": 0.2}, "does not keep to this rig's limits .*: --design 1 looks for another one"),
        ("zeros", {"extent": 100.0}, "--extent 100 mm cannot be: 0.1 to 30"),
        ("zeros", {"seconds": 0.0}, "--seconds 0 cannot be: 1 to 600"),
        ("zeros", {"tolerance": -1.0}, "--tolerance -1 mm cannot be"),
        ("zeros", {"by_hand": True, "record": "x"}, "--record and --by-hand cannot be together"),
    ],
)
def test_options_that_cannot_be_are_named(name, options, words):
    with pytest.raises(ConfigurationError, match=words):
        prepared(name, {}, **options)


def test_a_dry_run_tells_what_would_be_driven(capsys):
    assert main(["calibrate", "identify", "--dry-run", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert "condition number 3.8" in shown["steps"][0]
    assert shown["limits"]["torque_nm"] == 0.45
