"""calibration.toml: written whole, the old one kept, loaded over the configuration, and never beyond its keys."""

import tomllib
from datetime import UTC, date, datetime, time

import numpy as np
import pytest

from torquerig.calibrated import read_calibration
from torquerig.calibrating.deposit import deposit
from torquerig.calibration.procedure import Estimate, Result, Verdict
from torquerig.cli import main
from torquerig.configuration import load_configuration
from torquerig.errors import ConfigurationError, RecordError
from torquerig.toml_text import write

FACTS = {
    "date": "2026-11-22T05:00:00+00:00",
    "command": "torquerig calibrate direction",
    "drives": ["node 1: vendor 0"],
}


def result(**settings: object) -> Result:
    named = {key.replace("__", "."): value for key, value in settings.items()}
    return Result(Verdict(), (Estimate("axis 1, positive", np.float64(0.0656), 0.065, 0.067, "N·m"),), settings=named)


@pytest.fixture
def place(tmp_path):
    return tmp_path / "calibration.toml"


def test_what_is_written_is_read_back(place):
    deposit(place, "direction", result(axes__1__sign=-1, model__actuator_inertia=np.float64(0.03)), FACTS)
    calibration = read_calibration(place)
    assert calibration.settings == {"axes.1.sign": -1, "model.actuator_inertia": 0.03}
    assert calibration.measured["direction"]["axis 1, positive"] == [0.0656, 0.065, 0.067, "N·m"]
    assert calibration.provenance["direction"]["drives"] == ["node 1: vendor 0"]


def test_a_second_procedure_keeps_what_the_first_set(place):
    deposit(place, "direction", result(axes__1__sign=-1), FACTS)
    deposit(place, "zeros", result(axes__1__encoder_zero=0.01), FACTS)
    calibration = read_calibration(place)
    assert calibration.settings == {"axes.1.sign": -1, "axes.1.encoder_zero": 0.01}
    assert set(calibration.provenance) == {"direction", "zeros"}


def test_every_old_calibration_is_kept_under_the_next_number(place):
    texts = []
    for zero in (0.01, 0.02, 0.03):
        written = deposit(place, "zeros", result(axes__1__encoder_zero=zero), FACTS)
        texts.append(place.read_text())
    assert written.kept == place.with_name("calibration.toml.2")
    assert place.with_name("calibration.toml.1").read_text() == texts[0]
    assert place.with_name("calibration.toml.2").read_text() == texts[1]
    assert sorted(each.name for each in place.parent.iterdir()) == [
        "calibration.toml", "calibration.toml.1", "calibration.toml.2",
    ]  # fmt: skip


def test_a_result_that_sets_what_it_must_not_writes_nothing(place):
    deposit(place, "zeros", result(axes__1__encoder_zero=0.01), FACTS)
    before = place.read_bytes()
    with pytest.raises(ConfigurationError, match=r"limits\.torque is not for a calibration to set"):
        deposit(place, "zeros", result(limits__torque=5.0), FACTS)
    assert place.read_bytes() == before


def test_a_damaged_calibration_is_not_written_over(place):
    place.write_text("[axes.1\n")
    with pytest.raises(ConfigurationError, match="is not TOML"):
        deposit(place, "zeros", result(axes__1__encoder_zero=0.01), FACTS)
    assert place.read_text() == "[axes.1\n"


@pytest.mark.parametrize(
    "value",
    [
        date(2026, 11, 22),
        datetime(2026, 11, 22, 5, 0, 0, 250, tzinfo=UTC),
        time(5, 30),
        {"who": "me", "a b": [1, {"c": 2.5}], "when": date(2026, 11, 22)},
        {},
        'DEL \x7f, tab \t, quote " and \\',
    ],
)
def test_every_value_is_written_as_what_toml_reads_back(value):
    assert tomllib.loads(f"x = {write(value)}")["x"] == value


def test_dates_tables_and_quoted_names_of_an_old_calibration_stay_readable(place):
    old = """
[provenance.zeros]
date = 2026-11-22
at = 2026-11-22T05:00:00Z
bench = {name = "B", "serial no" = 7}
[provenance."my way"]
note = "by hand"
"""
    place.write_text(old)
    deposit(place, "direction", result(axes__1__sign=-1), FACTS)
    tables = tomllib.loads(place.read_text())
    before = tomllib.loads(old)
    assert {name: tables["provenance"][name] for name in ("zeros", "my way")} == before["provenance"]
    assert read_calibration(place).settings == {"axes.1.sign": -1}


@pytest.mark.parametrize("value", [object(), "\udc80"])
def test_what_toml_cannot_hold_leaves_the_old_calibration(place, value):
    deposit(place, "direction", result(axes__1__sign=-1), FACTS)
    before = place.read_bytes()
    with pytest.raises(RecordError, match="which is as it was") as caught:
        deposit(place, "zeros", result(axes__1__encoder_zero=0.01), FACTS | {"bench": value})
    assert "\n" not in str(caught.value)
    assert place.read_bytes() == before
    assert [each.name for each in place.parent.iterdir()] == ["calibration.toml"]


def test_a_calibration_wins_over_the_file_and_the_options_over_both(place, tmp_path):
    deposit(place, "direction", result(axes__1__sign=-1, model__active_viscous=0.9), FACTS)
    own = tmp_path / "my.toml"
    own.write_text('[calibration]\nfile = "calibration.toml"\n[model]\nactive_viscous = 0.5\n')
    rig = load_configuration(own).rig
    assert (rig.axes.leg1.sign, rig.model.active_viscous) == (-1, 0.9)
    rig = load_configuration(own, {"model.active_viscous": 0.7}).rig
    assert (rig.axes.leg1.sign, rig.model.active_viscous) == (-1, 0.7)


def test_config_names_the_line_and_the_procedure_of_a_calibrated_value(place, capsys):
    deposit(place, "direction", result(axes__1__sign=-1), FACTS)
    assert main(["config", "--calibration", str(place)]) == 0
    printed = capsys.readouterr().out
    line = next(line for line in printed.splitlines() if line.startswith("sign = -1"))
    assert "calibration.toml:5 (direction, 2026-11-22) (default 1)" in line
    assert tomllib.loads(printed)["axes"]["1"]["sign"] == -1


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[limits]\ntorque = 9.0\n", "limits.torque is not for a calibration to set"),
        ("[axes.1\n", "is not TOML"),
        ("measured = 3\n", "measured must hold a table a procedure"),
        ("[axes.1]\nsign = 7\n", "axes.1.sign"),
    ],
)
def test_a_bad_calibration_is_one_sentence(place, capsys, text, sentence):
    place.write_text(text)
    assert main(["config", "--calibration", str(place)]) == 2
    printed = capsys.readouterr().err
    assert sentence in printed
    assert str(place) in printed
    assert printed.count("\n") == 1


def test_a_calibration_that_is_not_there_is_one_sentence(capsys):
    assert main(["config", "--calibration", "nowhere.toml"]) == 2
    assert "cannot read the calibration nowhere.toml" in capsys.readouterr().err


def test_what_is_simulated_does_not_follow_what_was_measured_of_it(place):
    measured = {
        "model__link_length": 0.0702,
        "latency__reaction": 3e-4,
        "model__active_coulomb": 1.6,
        "axes__1__sign": -1,
    }
    deposit(place, "direction", result(**measured), FACTS)
    options = {"calibration.file": str(place), "drive.reaction": 8e-5}
    loaded, plain = load_configuration(options=options), load_configuration(options={"drive.reaction": 8e-5})
    assert (loaded.rig.model.link_length, loaded.rig.latency.reaction) == (0.0702, 3e-4)
    assert loaded.rig.model.active_coulomb == 1.6
    without_name = loaded.simulated.model_copy(update={"calibration": plain.rig.calibration})
    assert without_name == plain.rig == plain.simulated
