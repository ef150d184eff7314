"""The command, with errors by a formula instead of by closed loops."""

import json
from contextlib import contextmanager

import numpy as np
import pytest

from torquerig.cli import fit_plant, main
from torquerig.configuration import load_configuration
from torquerig.control.comparison import published_runs
from torquerig.plant_fit.problem import thesis_target
from torquerig.stopping import Stopped

ARGUMENTS = ["fit-plant", "--parameters", "torque_limit,coulomb", "--screened", "8", "--descents", "1"]
TARGET = thesis_target(published_runs())


class Formula:
    """Errors that are the thesis' with 0.4 N·m and 1.2 N·m, up to a tenth that nothing explains."""

    def __init__(self, stop_after=None):
        self.stop_after = stop_after

    def errors(self, tasks):
        return [self.one(task) for task in tasks]

    def one(self, task):
        if self.stop_after is not None:
            self.stop_after -= 1
            if self.stop_after < 0:
                raise Stopped(2)
        logs = np.resize([0.1, -0.1], 16)
        logs[::4] += 3.0 * (task.plant.torque_limit - 0.4)
        logs[1::4] += task.plant.coulomb[0] - 1.2
        return (TARGET * np.exp(logs).reshape(TARGET.shape))[list(task.which)]


@pytest.fixture(autouse=True)
def by_formula(monkeypatch, tmp_path):
    """Lets the command compute by a formula; returns what to call for one that is stopped."""

    def use(formula):
        @contextmanager
        def helpers(_base):
            yield formula

        monkeypatch.setattr(fit_plant, "workers", helpers)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    use(Formula())
    return use


def test_json_is_one_object_and_nothing_else(capsys):
    assert main([*ARGUMENTS, "--json"]) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    assert printed.out.count("\n") == 1
    told = json.loads(printed.out)
    assert set(told) == {
        "verdict", "stopped", "seed", "plants_tried", "typical_factor", "typical_factor_over_the_wire",
        "typical_factor_at_start", "parameters", "runs", "optima", "cross_validation", "correlation",
        "condition_number", "plant",
    }  # fmt: skip
    assert [each["name"] for each in told["parameters"]] == ["coulomb", "torque_limit"]
    assert [each["value"] for each in told["parameters"]] == pytest.approx([1.2, 0.4], rel=0.1)
    assert 1.0 < told["typical_factor"] < 1.11
    assert len(told["runs"]) == 8


def test_the_output_never_calls_it_validated_and_fits_a_terminal(capsys):
    assert main(ARGUMENTS) == 0
    text = capsys.readouterr().out
    assert "not a validated plant; the optimum is not unique" in text
    assert all(len(line) <= 80 for line in text.splitlines())
    for words in ("over the wire", "Parameters", "Cross-validation", "Correlation", "computed-torque, 2"):
        assert words in text


def test_the_plant_is_a_file_that_run_takes_and_is_never_overwritten(capsys, tmp_path):
    assert main([*ARGUMENTS, "--out", "p.toml", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    plants = load_configuration("p.toml").rig.plant
    assert plants["found"].torque_limit == told["parameters"][1]["value"]
    assert plants["found"].breakaway == plants["found"].coulomb
    assert plants["found"].active_viscous == plants["fitted"].active_viscous
    before = (tmp_path / "p.toml").read_bytes()
    assert before.startswith(b"# torquerig fit-plant --parameters coulomb,torque_limit --plant fitted --seed 2")
    assert main([*ARGUMENTS, "--out", "p.toml"]) == 2
    assert "p.toml exists, and no file is overwritten" in capsys.readouterr().err
    assert (tmp_path / "p.toml").read_bytes() == before


def test_ctrl_c_ends_with_the_best_so_far_and_its_file(capsys, tmp_path, by_formula):
    by_formula(Formula(stop_after=20))
    assert main([*ARGUMENTS, "--out", "p.toml", "--json"]) == 130
    printed = capsys.readouterr()
    told = json.loads(printed.out)
    assert told["stopped"]
    assert told["cross_validation"] == []
    assert told["typical_factor"] > 1.0
    assert printed.err == "torquerig: stopped by SIGINT\n"
    assert "(stopped)" in (tmp_path / "p.toml").read_text(encoding="utf-8")


def test_ctrl_c_before_anything_was_tried_leaves_no_file(capsys, tmp_path, by_formula):
    by_formula(Formula(stop_after=0))
    assert main([*ARGUMENTS, "--out", "p.toml"]) == 130
    assert "Stopped before any plant was tried" in capsys.readouterr().out
    assert not (tmp_path / "p.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--parameters", "frob"], "'frob' is not a parameter of a plant; there are coulomb"),
        (["--parameters", ","], "0 parameters cannot be fitted"),
        (["--plant", "fited"], "--plant 'fited' is not a plant; did you mean fitted?"),
        (["--out", "no/where.toml"], "there is no folder no"),
        (["--out", "p.toml", "--name", "a b"], "the plant's name 'a b' cannot be"),
        (["--seed", "-1"], "-1 is not in the range"),
        (["--descents", "0"], "0 is not in the range"),
        (["--config", "no.toml"], "cannot read the configuration no.toml"),
    ],
)
def test_bad_arguments_get_one_sentence(capsys, arguments, sentence):
    assert main(["fit-plant", *arguments]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert sentence in told.err
    assert told.err.count("\n") == 1
