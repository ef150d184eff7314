"""Adding an estimator is adding one file to the estimators' package; what it may be given is checked."""

import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from torquerig.configuration import load_configuration
from torquerig.control import EstimatorFileError, UnknownEstimatorError, estimators
from torquerig.control.estimators import (
    BackwardDifference,
    MovingWindow,
    estimator_named,
    load_estimators,
    make_estimator,
)

NAMES = ["alpha-beta", "backward-difference", "kalman", "low-pass-derivative", "moving-window", "savitzky-golay"]
NEW = """
    from torquerig.control.estimator import Estimator, Parameter


    class Constant(Estimator):
        name = "{name}"
        parameters = (Parameter("guess", "rad/s", 1.5, -10.0, 10.0, "what it always says"),)
        delay = 0.0
        noise_gain = 0.0

        def _begin(self, at_ns):
            pass

        def _advance(self, at_ns, interval_ns):
            self.rate[:] = self.values["guess"]
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A second folder of the estimators' package, empty; what is imported from it is forgotten afterwards."""
    monkeypatch.setattr(estimators, "__path__", [*estimators.__path__, str(tmp_path)])
    yield tmp_path
    for module in [name for name in sys.modules if name.startswith("torquerig.control.estimators.dropped")]:
        del sys.modules[module]


def test_the_family():
    assert list(load_estimators()) == NAMES
    assert estimator_named("moving-window") is MovingWindow
    assert type(make_estimator("backward-difference", 3)) is BackwardDifference


def test_a_file_dropped_into_the_package_is_found_and_can_be_configured(folder):
    (folder / "dropped_constant.py").write_text(textwrap.dedent(NEW.format(name="constant")))
    estimator = make_estimator("constant", 2, guess=3)
    estimator.update([0.0, 0.0], 0)
    assert estimator.update([0.0, 0.0], 1).tolist() == [3.0, 3.0]
    rig = load_configuration(options={"loop.estimator": "constant", "estimators.constant.guess": 2.5}).rig
    assert rig.estimators["constant"] == {"guess": 2.5}


def test_the_example_in_the_docs_is_an_estimator_that_tells_its_delay_and_noise(folder):
    text = (Path(__file__).resolve().parents[2] / "docs" / "estimators.md").read_text(encoding="utf-8")
    example = textwrap.dedent(
        text[text.index("    class HalfWay") : text.index("`torquerig run --estimator half-way`")]
    )
    imports = "from torquerig.control.estimator import THESIS_SAMPLING, Estimator, Parameter\n"
    (folder / "dropped_half_way.py").write_text(f"import math\nimport numpy as np\n{imports}{example}")
    estimator = make_estimator("half-way", 1, weight=0.4)
    answer = np.array([estimator.update([k == 50], k * 4_000_000)[0] * 0.004 for k in range(500)])[50:]
    assert -np.sum(answer * np.arange(450) ** 2) / 2 == pytest.approx(estimator.delay)
    assert np.linalg.norm(answer) == pytest.approx(estimator.noise_gain)


def test_estimators_that_a_file_only_imports_are_not_its_own(folder):
    (folder / "dropped_import.py").write_text("from torquerig.control.estimators.kalman import Kalman\n")
    assert list(load_estimators()) == NAMES


@pytest.mark.parametrize("line", ["pass", "name = 3", 'name = ""'])
def test_an_estimator_without_a_name_is_refused_with_its_file(folder, line):
    text = textwrap.dedent(NEW.format(name="constant")).replace('name = "constant"', line)
    (folder / "dropped_nameless.py").write_text(text)
    with pytest.raises(EstimatorFileError) as refused:
        load_estimators()
    assert str(refused.value).startswith(f"{folder / 'dropped_nameless.py'}: estimator Constant has no name: ")
    assert "\n" not in str(refused.value)


def test_two_estimators_of_one_name_are_refused(folder):
    (folder / "dropped_twin.py").write_text(textwrap.dedent(NEW.format(name="kalman")))
    with pytest.raises(ValueError, match="two estimators are named 'kalman'"):
        load_estimators()


def test_an_unknown_estimator_is_answered_with_the_known_ones():
    with pytest.raises(UnknownEstimatorError, match=f"unknown estimator 'klman': choose {', '.join(NAMES)}"):
        make_estimator("klman", 3)


@pytest.mark.parametrize(
    ("name", "given", "sentence"),
    [
        ("moving-window", {"length": 0}, "moving-window: length = 0 cannot be: it must be a whole number at least 1"),
        ("moving-window", {"length": 2.5}, "length = 2.5 cannot be: it must be a whole number"),
        ("moving-window", {"span": 2}, "moving-window: span = 2 cannot be: moving-window takes length"),
        ("backward-difference", {"length": 1}, "backward-difference takes no parameter"),
        ("kalman", {"jerk_noise": float("nan")}, "jerk_noise = nan cannot be: it must be a number at least 1"),
        ("alpha-beta", {"alpha": 1.01}, "alpha = 1.01 cannot be: it must be a number at least 0.01 and at most 1"),
        ("savitzky-golay", {"order": 5}, "order = 5 cannot be: it must be below length = 5"),
        ("savitzky-golay", {"length": 2}, "length = 2 cannot be: it must be above order = 2"),
        ("savitzky-golay", {"length": 101}, "length = 101 cannot be: it must be a whole number at least 2"),
    ],
)
def test_a_parameter_that_cannot_be_is_refused_in_one_sentence(name, given, sentence):
    with pytest.raises(ValueError, match=sentence):
        make_estimator(name, 3, **given)


@pytest.mark.parametrize("name", NAMES)
def test_the_shipped_configuration_says_what_the_estimators_have_by_default(name):
    told = load_configuration().rig.estimators.get(name, {})
    assert told == {each.name: each.default for each in estimator_named(name).parameters}
    assert all(each.unit and each.meaning and each.allows(each.default) for each in estimator_named(name).parameters)
