"""The suite itself: it knows no codec of ours, notices what is wrong, and its table is up to date."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from conversation import BARRIER, FACTORY, QUIET, talk
from stations import WireLine

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
JUDGES = (HERE, ROOT / "tests" / "independent")
DEVICE_TYPE = "> 601#40 00 10 00 00 00 00 00\n"
ANSWER = "< 581#43 00 10 00 92 01 02 00\n"
LIMIT_S = 120.0


def imported(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("folder", JUDGES, ids=lambda folder: folder.name)
def test_the_judges_import_no_codec_and_nothing_else_of_the_driver(folder):
    modules = {name: path.name for path in folder.glob("*.py") for name in imported(path)}
    assert len(modules) > 10
    assert {name: file for name, file in modules.items() if name.startswith("torquerig.driver")} == {}


def test_the_table_in_the_docs_is_what_the_suite_shows(tmp_path):
    made = tmp_path / "conformance.md"
    command = [sys.executable, "-m", "pytest", str(HERE), "--collect-only", "-q", "-p", "no:cacheprovider"]
    run = subprocess.run(
        [*command, f"--conformance-table={made}"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert (ROOT / "docs" / "conformance.md").read_text() == made.read_text(), "see the command in docs/conformance.md"


@pytest.fixture(scope="module")
def line():
    line = WireLine()
    talk(line, FACTORY + QUIET)
    return line


def test_what_is_said_as_expected_passes(line):
    talk(line, DEVICE_TYPE + ANSWER)


@pytest.mark.parametrize(
    ("conversation", "complaint"),
    [
        (DEVICE_TYPE + ANSWER.replace("92", "93"), "but heard: 581#43 00 10 00 92 01 02 00"),
        (DEVICE_TYPE, "but heard: 581#43 00 10 00 92 01 02 00"),
        (ANSWER, "but heard nothing of the kind"),
        ("> 601#40 01 10 00 00 00 00 00\n" + DEVICE_TYPE + ANSWER, "but heard: 581#4F 01 10 00 00 00 00 00"),
        (DEVICE_TYPE + "~ 581#4F ..\n", "but heard: 581#43"),
    ],
    ids=["another byte", "one more", "one less", "another before", "another than tolerated"],
)
def test_what_is_said_otherwise_is_noticed(line, conversation, complaint):
    with pytest.raises(pytest.fail.Exception) as failed:
        talk(line, conversation)
    assert complaint in str(failed.value)
    line.overhear()


@pytest.mark.parametrize(
    "timeline",
    [
        "50 < 701#7E\n60 < .",
        "50.000001 < 701#7F\n60 < .",
        "50 < 701#7F\n100 < 701#7F\n150 < 701#7F\n151 < 701#7F",
        "50 < 701#7F\n120 < .",
    ],
    ids=["another byte", "another nanosecond", "one less", "one more"],
)
def test_what_is_said_at_another_time_is_noticed(bench, timeline):
    beat = "0 > 601#2B 17 10 00 32 00 00 00\n0 < 581#60 17 10 00 00 00 00 00\n"
    with pytest.raises(pytest.fail.Exception, match="said"):
        bench.follow(beat + timeline)


def test_the_barrier_asks_another_node():
    assert BARRIER.split()[1].startswith("602#")
