"""A run beside the thesis' numbers says in what it is another experiment than the thesis'."""

import pytest
from rich.console import Console

from torquerig.cli.tables import summary_table
from torquerig.configuration import load_configuration
from torquerig.experiment import run_experiment
from torquerig.thesis_experiment import departures

FILE = """
[loop]
law = "coupled-pd"
motion = 2
gains = 1
rate_hz = 500.0
stiction_feedforward = 0.02
estimator = "kalman"
[estimators.kalman]
jerk_noise = 5e4
[estimators.alpha-beta]
alpha = 0.3
[motion.1]
speed = 0.2
[motion.2]
speed = 0.25
[model]
active_viscous = 0.5
[limits]
position_error = 0.02
[laws.coupled-pd.motion2]
kp = 1.0
"""


@pytest.fixture
def mine(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(FILE, encoding="utf-8")
    return path


@pytest.mark.parametrize("plant", ["fitted", "identified"])
@pytest.mark.parametrize("law", ["coupled-pd", "computed-torque"])
@pytest.mark.parametrize("motion", [1, 2])
def test_the_shipped_experiments_are_the_thesis_on_any_plant(plant, law, motion):
    options = {"simulator.plant": plant, "loop.law": law, "loop.motion": motion}
    assert departures(load_configuration(options=options)) == ()


def test_gains_motion_rate_estimator_and_model_of_the_run_count_and_those_of_others_do_not(mine):
    assert departures(load_configuration(mine)) == (
        "kp = 28000 (thesis: 38000)",
        "kv = 700 (thesis: 1200)",
        "loop.rate_hz = 500.0 (thesis: 250.0)",
        'loop.estimator = "kalman" (thesis: "backward-difference")',
        "loop.stiction_feedforward = 0.02 (thesis: 0.0)",
        "motion.2.speed = 0.25 (thesis: 0.3)",
        "estimators.kalman.jerk_noise = 50000.0 (thesis: 1400000.0)",
        "model.active_viscous = 0.5 (thesis: 0.8315)",
    )


def test_gains_that_are_the_laws_own_are_no_departure(tmp_path):
    same = tmp_path / "same.toml"
    same.write_text("[laws.computed-torque.motion1]\nkp = 3000.0\n", encoding="utf-8")
    assert departures(load_configuration(same)) == ()


def test_the_table_marks_the_thesis_column_of_another_experiment(capsys):

    def shown(**options):
        summary = run_experiment(load_configuration(options=options)).summary
        console = Console(width=100)
        console.print(summary_table(summary))
        return summary, capsys.readouterr().out

    summary, text = shown(**{"loop.stiction_feedforward": 0.02})
    assert "thesis *" in text
    assert "* not this experiment: here loop.stiction_feedforward = 0.02 (thesis: 0.0)" in " ".join(text.split())
    assert summary.as_json()["departures"] == ["loop.stiction_feedforward = 0.02 (thesis: 0.0)"]
    assert summary.thesis is not None
    assert "thesis *" not in shown()[1]
