"""Adding a law is adding one file to the laws' package."""

import sys
import textwrap

import pytest

from torquerig.control import UnknownLawError, law_named, laws, load_laws

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
    (folder / "dropped_import.py").write_text("from torquerig.control.laws.coupled_pd import CoupledPD\n")
    assert len(load_laws()) == 4


def test_two_laws_of_one_name_are_refused(folder):
    (folder / "dropped_twin.py").write_text(textwrap.dedent(NEW_LAW.format(name="coupled-pd")))
    with pytest.raises(ValueError, match="two laws are named 'coupled-pd'"):
        load_laws()


def test_an_unknown_law_is_answered_with_the_known_ones():
    known = "augmented-pd, computed-torque, coupled-pd, decoupled-pd"
    with pytest.raises(UnknownLawError, match=f"unknown law 'pid': choose {known}"):
        law_named("pid")
