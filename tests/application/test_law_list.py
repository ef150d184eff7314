"""`torquerig laws`: a list that a law joins by being a file; tried with the law that docs/laws.md adds."""

import json
import re
import sys
import textwrap
from pathlib import Path

import pytest

from torquerig.cli import main
from torquerig.control import law_named, laws, load_laws

DOCUMENT = Path(__file__).parents[2] / "docs" / "laws.md"
SILENT_LAW = '''
    """A law whose class says nothing.

    It can do little."""

    from dataclasses import dataclass
    from typing import ClassVar

    import numpy as np

    from torquerig.control.law import Gains, Law, Published


    @dataclass(frozen=True, slots=True)
    class Silent(Law):
        name: ClassVar[str] = "silent"
        gains: ClassVar = {2: Gains(1.5, 0.0)}
        published: ClassVar = {2: Published(1.0, 0.1, "a paper")}
        running_time_ns: ClassVar = 1_000_000

        def torque(self, state, desired):
            return np.zeros(3)
'''
"""It has no docstring of its own, and a result and a running time that are not the thesis'."""


@pytest.fixture
def dropped(tmp_path, monkeypatch):
    """The law of the document and a silent one, dropped into the laws' package."""
    example = re.search(r"```python\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL)
    assert example is not None
    if "spring-damper" not in load_laws():  # somebody may have followed the document
        (tmp_path / "dropped_spring_damper.py").write_text(example.group(1), encoding="utf-8")
    (tmp_path / "dropped_silent.py").write_text(textwrap.dedent(SILENT_LAW), encoding="utf-8")
    monkeypatch.setattr(laws, "__path__", [*laws.__path__, str(tmp_path)])
    yield
    for module in [name for name in sys.modules if name.startswith("torquerig.control.laws.dropped")]:
        del sys.modules[module]


def listed(capsys, *arguments):
    assert main(["laws", *arguments]) == 0
    return capsys.readouterr().out


@pytest.mark.usefixtures("dropped")
def test_every_law_found_is_listed_with_its_equation_and_gains(capsys):
    told = {law["law"]: law for law in json.loads(listed(capsys, "--json"))["laws"]}
    assert set(told) == set(load_laws())
    assert all(law["equation"] and law["motions"] for law in told.values())
    added = told["spring-damper"]
    assert added["equation"].startswith("tau_m = S(S'S)^-1 (Mt a_d + kp e + kv edot) / n")
    assert [(each["motion"], each["kp"], each["kv"]) for each in added["motions"]] == [(1, 20000, 500), (2, 25000, 800)]
    assert added["motions"][0]["thesis_ms"] is None


@pytest.mark.usefixtures("dropped")
@pytest.mark.parametrize("form", [(), ("--markdown",)])
def test_a_new_law_stands_in_the_list_and_in_the_page(capsys, monkeypatch, form):
    monkeypatch.setenv("COLUMNS", "80")
    text = listed(capsys, *form)
    for law in load_laws():
        assert law in text
    assert "20000" in text
    assert "tau_m = kp (q_d - q) + kv (qd_d - qd)" in text
    assert "3.18" in text
    assert "…" not in text


@pytest.mark.usefixtures("dropped")
def test_the_thesis_numbers_stand_beside_its_laws_and_nobody_elses(capsys):
    told = {law["law"]: law["motions"] for law in json.loads(listed(capsys, "--json"))["laws"]}
    for motion in told["computed-torque"]:
        thesis = law_named("computed-torque").published[motion["motion"]]
        assert motion["thesis_position_rmse_mm"] == thesis.position_rmse_mm
        assert motion["thesis_velocity_rmse_m_s"] == thesis.velocity_rmse_m_s
        assert motion["thesis_ms"] == 3.18
    silent = told["silent"][0]
    assert [silent[key] for key in silent if key.startswith("thesis")] == [None, None, None]


@pytest.mark.usefixtures("dropped")
def test_a_law_without_words_is_told_by_its_files(capsys):
    text = listed(capsys, "silent")
    assert "silent (dropped_silent.py)\n    A law whose class says nothing.\n" in text
    assert "It can do little." in text
    assert "coupled-pd" not in text


def test_one_law_is_told_with_all_its_docstring(capsys):
    assert "taken as joint torque they give errors of 8 to 9 mm" in listed(capsys, "decoupled-pd")
    assert "taken as joint torque" not in listed(capsys)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nosuch"], "unknown law 'nosuch': choose augmented-pd, computed-torque, coupled-pd, decoupled-pd"),
        (["--json", "--markdown"], "give one of them"),
    ],
)
def test_what_cannot_be_listed_is_refused_in_one_sentence(capsys, arguments, sentence):
    assert main(["laws", *arguments]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert sentence in told.err
    assert told.err.count("\n") == 1


def test_the_document_names_the_command_that_makes_the_list():
    assert "torquerig laws --markdown" in DOCUMENT.read_text(encoding="utf-8")
