"""Adding a law is adding one file to the laws' package."""

import sys
import textwrap

import pytest

from torquerig import building, load_configuration
from torquerig.cli import main
from torquerig.control import LawFileError, UnknownLawError, law_named, laws, load_laws

NEW_LAW = """
    from dataclasses import dataclass
    from typing import ClassVar

    import numpy as np

    from torquerig.control.law import Gains, Law


    @dataclass(frozen=True, slots=True)
    class Spring(Law):
        name: ClassVar[str] = "{name}"
        gains: ClassVar = {{1: Gains(1.0, 0.0)}}

        def torque(self, state, desired):
            return self.kp * np.sign(desired.q - state.q)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A second folder of the laws' package, empty; what is imported from it is forgotten afterwards."""
    monkeypatch.setattr(laws, "__path__", [*laws.__path__, str(tmp_path)])
    yield tmp_path
    for module in [name for name in sys.modules if name.startswith("torquerig.control.laws.dropped")]:
        del sys.modules[module]


def test_a_file_dropped_into_the_package_is_found(folder, model):
    (folder / "dropped_spring.py").write_text(textwrap.dedent(NEW_LAW.format(name="spring")))
    law = law_named("spring").for_motion(model, 1)
    assert law.running_time_ns is None
    assert not law.published
    assert "spring" in load_laws()


def test_laws_that_a_file_only_imports_are_not_its_own(folder):
    before = load_laws()
    (folder / "dropped_import.py").write_text("from torquerig.control.laws.coupled_pd import CoupledPD\n")
    assert load_laws() == before


def test_two_laws_of_one_name_are_refused(folder):
    (folder / "dropped_twin.py").write_text(textwrap.dedent(NEW_LAW.format(name="coupled-pd")))
    with pytest.raises(ValueError, match="two laws are named 'coupled-pd'"):
        load_laws()


def test_an_unknown_law_is_answered_with_the_known_ones():
    known = ", ".join(load_laws())
    assert "augmented-pd, computed-torque, coupled-pd, decoupled-pd" in known
    with pytest.raises(UnknownLawError, match=f"unknown law 'nosuch': choose {known}"):
        law_named("nosuch")


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ('name: ClassVar[str] = "spring"', "law Spring has no name"),
        ("gains: ClassVar = {1: Gains(1.0, 0.0)}", "law Spring has no gains"),
    ],
)
def test_a_law_without_name_or_gains_is_refused_with_its_file(folder, line, sentence):
    text = textwrap.dedent(NEW_LAW.format(name="spring"))
    assert line in text
    (folder / "dropped_lacking.py").write_text(text.replace(line, "other: ClassVar[int] = 1"))
    with pytest.raises(LawFileError) as refused:
        load_laws()
    assert str(refused.value).startswith(f"{folder / 'dropped_lacking.py'}: {sentence}: ")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("gains", ["{}", "{1: (1.0,)}", "{1: 5.0}", "[1, 2]"])
def test_gains_that_are_none_are_refused(folder, gains):
    text = textwrap.dedent(NEW_LAW.format(name="spring")).replace("{1: Gains(1.0, 0.0)}", gains)
    (folder / "dropped_gainless.py").write_text(text)
    with pytest.raises(LawFileError, match=r"dropped_gainless\.py: law Spring has no gains: "):
        load_laws()


@pytest.mark.parametrize(
    ("text", "words"), [("def (", "SyntaxError: "), ("import nosuch\n", "No module named 'nosuch'")]
)
def test_a_file_that_is_no_python_is_told_in_one_sentence(folder, capsys, text, words):
    (folder / "dropped_broken.py").write_text(text)
    assert main(["laws"]) == 2
    told = capsys.readouterr().err
    assert f"{folder / 'dropped_broken.py'} cannot be imported: " in told
    assert words in told
    assert told.count("\n") == 1


def test_the_command_line_tells_of_a_bad_law_in_one_sentence(folder, capsys):
    (folder / "dropped_nameless.py").write_text(textwrap.dedent(NEW_LAW.format(name="")))
    assert main(["config"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_run_of_a_motion_that_a_law_has_no_gains_for_is_refused(folder, capsys):
    (folder / "dropped_spring.py").write_text(textwrap.dedent(NEW_LAW.format(name="spring")))
    assert main(["run", "--law", "spring", "--motion", "2", "--json"]) == 2
    told = capsys.readouterr().err
    assert "spring has no gains for motion 2, only for 1: " in told
    assert "[laws.spring.motion2]" in told
    assert told.count("\n") == 1


def test_gains_of_the_configuration_do_where_the_law_has_none(folder, tmp_path):
    (folder / "dropped_spring.py").write_text(textwrap.dedent(NEW_LAW.format(name="spring")))
    mine = tmp_path / "mine.toml"
    mine.write_text('[loop]\nlaw = "spring"\nmotion = 2\n[laws.spring.motion2]\nkp = 7.0\nkv = 0.5\n', encoding="utf-8")
    assert building.gains(load_configuration(mine).rig) == (7.0, 0.5)


def test_the_help_of_run_lists_a_new_law(folder, capsys):
    (folder / "dropped_spring.py").write_text(textwrap.dedent(NEW_LAW.format(name="spring")))
    assert main(["run", "--help"]) == 0
    assert "spring" in capsys.readouterr().out
