"""The house stands as its plan says: packages, links, dependencies."""

import re
import tomllib
from pathlib import Path

import pytest

from torquerig.cli.failures import EXIT_CODES
from torquerig.schema import Rig

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_the_packages_listed_are_those_on_the_disk():
    folders = PROJECT["tool"]["setuptools"]["package-dir"]
    found = set()
    for package, folder in folders.items():
        for init in (ROOT / folder).rglob("__init__.py"):
            inner = init.parent.relative_to(ROOT / folder)
            found.add(".".join([package, *inner.parts]))
    assert set(PROJECT["tool"]["setuptools"]["packages"]) == found


@pytest.mark.parametrize("name", ["calibration", "control", "device_sim", "driver", "mechanism"])
def test_each_floor_is_linked_where_editors_look(name):
    link = ROOT / "src" / "torquerig" / name
    assert link.is_symlink()
    assert link.readlink() == Path("..") / ".." / name


def required(entries: list[str]) -> set[str]:
    return {f"{name} ≥ {version}" for name, version in (entry.split(">=") for entry in entries)}


def test_every_dependency_is_accounted_for():
    text = (ROOT / "docs" / "dependencies.md").read_text(encoding="utf-8")
    to_run, to_develop = text.split("## Needed to develop")
    rows = re.compile(r"^\| ([\w-]+ ≥ [\d.]+) \|", re.MULTILINE)
    project = PROJECT["project"]
    assert set(rows.findall(to_run)) == required(project["dependencies"])
    assert set(rows.findall(to_develop)) == required(project["optional-dependencies"]["dev"])


def test_the_exit_codes_are_told_alike_in_help_and_docs():
    text = (ROOT / "docs" / "exit-codes.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| (\d+) \|", text, re.MULTILINE) == re.findall(r"^  (\d+) ", EXIT_CODES, re.MULTILINE)


def test_the_tables_told_in_docs_are_those_of_the_configuration():
    text = (ROOT / "docs" / "configuration.md").read_text(encoding="utf-8")
    told = re.findall(r"\[([a-z]+)[\].]", "\n".join(re.findall(r"^\| (\[.*?) \|", text, re.MULTILINE)))
    assert set(told) == set(Rig.model_fields)
