"""The fixture as somebody else's tests use it, in a pytest of their own; and the examples of the documentation."""

from __future__ import annotations

import re
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

PAGE = Path(__file__).resolve().parents[2] / "docs" / "testing-your-own-driver.md"
EXAMPLES = re.findall(r"^## ?(.*?)$|^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def examples() -> list[object]:
    """The page's blocks of Python, each named by its section."""
    section, found = "the first", []
    for title, code in EXAMPLES:
        section = title or section
        if code:
            found.append(pytest.param(code, id=section.replace(" ", "-")))
    return found


@pytest.fixture
def run_tests(pytester, monkeypatch):
    """Return what runs a test file in a pytest that has our plugin and no other, with every warning an error."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    pytester.makeini("[pytest]\nfilterwarnings = error\naddopts = --strict-markers --strict-config\n")

    def run(source: str, *arguments: str) -> pytest.RunResult:
        pytester.makepyfile(source)
        return pytester.runpytest_subprocess("-p", "torquerig.pytest_plugin", "-p", "no:cacheprovider", *arguments)

    return run


def test_pytest_finds_the_plugin_by_itself():
    (found,) = [each for each in entry_points(group="pytest11") if each.name == "torquerig"]
    assert found.value == "torquerig.pytest_plugin"


@pytest.mark.parametrize("code", examples())
def test_the_examples_of_the_page_work(run_tests, pytester, code):
    code = code.replace("/tmp/rig-example", str(pytester.path / "bus"))  # noqa: S108  (that is what is replaced)
    if "def test_" in code:
        run_tests(code).assert_outcomes(passed=1)
    else:
        result = pytester.run(sys.executable, "-W", "error", pytester.makepyfile(example=code))
        assert result.ret == 0
        result.stdout.fnmatch_lines(["Timestamp: *"])


def test_the_plugin_imports_nothing_heavy_and_starts_nothing(run_tests):
    run_tests(
        """
        import os, sys
        from pathlib import Path
        HEAVY = {"can", "canopen", "numba", "numpy", "pydantic", "multiprocessing", "torquerig.simulated_rig"}
        def test_nothing_is_imported():
            assert not HEAVY & set(sys.modules)
            assert Path(f"/proc/self/task/{os.getpid()}/children").read_text() == ""
        """
    ).assert_outcomes(passed=1)


def test_every_test_has_new_drives_on_a_bus_of_its_own_in_one_process(run_tests):
    run_tests(
        """
        import os, pytest
        from pathlib import Path
        seen = []
        @pytest.mark.parametrize("turn", [1, 2, 3])
        def test_a_rig(simulated_rig, turn):
            (member,) = Path(simulated_rig.channel).glob("member-*")
            seen.append((simulated_rig.channel, member.name.split("-")[1]))
            simulated_rig.inject(1, "overvoltage")
            assert simulated_rig.bus.recv(20.0).arbitration_id & 0x780 in (0x080, 0x700)
        def test_what_was_seen():
            channels, processes = zip(*seen)
            assert (len(set(channels)), len(set(processes))) == (3, 1)
            assert not any(Path(each).exists() for each in channels)
        """
    ).assert_outcomes(passed=4)


def test_the_marker_says_what_is_simulated_and_the_option_on_which_bus(run_tests, pytester):
    run_tests(
        """
        import pytest
        from pathlib import Path
        def test_the_option(simulated_rig):
            assert simulated_rig.url == "lockstep:"
        @pytest.mark.simulated_rig(options={"axes.3.node_id": 9})
        def test_the_marker_and_the_option(simulated_rig):
            assert (simulated_rig.url, simulated_rig.node_ids) == ("lockstep:", (1, 2, 9))
        @pytest.mark.simulated_rig("unix:bus", plant="ideal")
        def test_the_marker_wins(simulated_rig):
            assert simulated_rig.url == f"unix:{Path.cwd() / 'bus'}"
            assert simulated_rig.bus.recv(20.0) is not None
        """,
        "--simulated-rig-bus",
        "lockstep:",
    ).assert_outcomes(passed=3)
    assert (pytester.path / "bus").is_dir()


def test_a_rig_that_cannot_be_is_an_error_of_the_test_in_one_sentence(run_tests):
    result = run_tests(
        """
        import pytest
        @pytest.mark.simulated_rig(plant="rubber")
        def test_never_begins(simulated_rig): pass
        def test_the_next_one_does(simulated_rig): pass
        """
    )
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(["E *ConfigurationError: SimulatedRig: simulator.plant = 'rubber' is not a plant; *"])
