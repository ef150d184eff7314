"""Forwarded tests: their outcomes, texts and names come back from the guest, and nothing is lost in silence."""

import io
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

import forward
import launcher
import pytest
from places import HERE, NoVcanError, Place

pytest_plugins = ["pytester"]

CONFTEST = f"""
import sys
sys.path.insert(0, {str(HERE)!r})
from forward import pytest_configure
"""
TESTS = """
import os
import pytest

@pytest.fixture
def broken_later():
    yield
    raise ValueError("of the teardown")

@pytest.mark.vcan
@pytest.mark.parametrize("n", [1, 2])
def test_passes(n):
    pass

@pytest.mark.vcan
def test_fails():
    print("a word before")
    assert 6 * 7 == 41, "of the call"

@pytest.mark.vcan
def test_breaks(broken_later):
    pass

@pytest.mark.vcan
def test_skips():
    pytest.skip("of the test's own")

@pytest.mark.vcan
@pytest.mark.xfail(reason="known")
def test_expected():
    raise KeyError

@pytest.mark.vcan
def test_deselected():
    assert False

def test_here():
    assert "IN_GUEST" not in os.environ
"""
Guest = Callable[..., int]


@pytest.fixture
def rig(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    monkeypatch.delenv("CI", raising=False)
    pytester.makeconftest(CONFTEST)
    pytester.makepyfile(test_facts=TESTS)
    return pytester


def play_guest(monkeypatch: pytest.MonkeyPatch, guest: Guest) -> None:
    """Puts the function in the launcher's place."""
    monkeypatch.setattr(launcher, "run", guest)


def run_here(rig: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets the command run without any guest: these facts are pytest's alone."""

    def run(command: Sequence[str], *, environment: dict[str, str], output: io.BytesIO, **_: object) -> int:
        inside = {**environment, "IN_GUEST": "1"}
        done = subprocess.run(command, env=inside, cwd=rig.path, stdout=subprocess.PIPE, check=False)
        output.write(done.stdout)
        return done.returncode

    play_guest(monkeypatch, run)


def test_outcomes_texts_and_names_are_those_of_the_guest(rig: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    run_here(rig, monkeypatch)
    result = rig.runpytest_inprocess("-ra", "-k", "not deselected")
    result.assert_outcomes(passed=4, failed=1, errors=1, skipped=1, xfailed=1, deselected=1)
    result.stdout.fnmatch_lines_random(
        [
            "*AssertionError: of the call",
            "a word before",
            "*ValueError: of the teardown",
            "SKIPPED [[]1[]] test_facts.py:*: of the test's own",
            "XFAIL test_facts.py::test_expected - known",
            "FAILED test_facts.py::test_fails - *",
        ]
    )


def test_tests_without_a_report_fail_with_what_the_guest_said(
    rig: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(*_: object, environment: dict[str, str], output: io.BytesIO, **__: object) -> int:
        Path(environment[forward.REPORTS]).write_text('{"started": "test_facts.py::test_fails"}\n')
        output.write(b"Kernel panic")
        return 124

    play_guest(monkeypatch, run)
    result = rig.runpytest_inprocess()
    result.assert_outcomes(passed=1, errors=7)
    result.stdout.fnmatch_lines(
        [
            "*without a report of this test (time limit of * s; the last test it started was *::test_fails)*",
            "Kernel panic",
        ]
    )


def test_without_a_place_one_line_says_what_was_not_run_and_why(
    rig: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(*_: object, **__: object) -> int:
        raise NoVcanError("nothing here (apt install something)")

    play_guest(monkeypatch, run)
    result = rig.runpytest_inprocess("-ra")
    result.assert_outcomes(passed=1, skipped=7)
    lines = [line for line in result.outlines if "SKIPPED" in line]
    assert len(lines) == 1
    assert lines[0].endswith("not run for want of vcan0: nothing here (apt install something)")
    monkeypatch.setenv("CI", "true")
    result = rig.runpytest_inprocess()
    result.assert_outcomes(passed=1, errors=7)


def test_reason_names_what_is_missing_on_every_road(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(reason: str) -> Callable[[], Place]:
        def find() -> Place:
            raise NoVcanError(reason)

        return find

    monkeypatch.setattr(launcher, "PLACES", {"one": missing("no this (apt install a)"), "two": missing("no that")})
    with pytest.raises(NoVcanError, match=r"^no this \(apt install a\); no that$"):
        launcher.find_place()
