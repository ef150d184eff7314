"""The evidence of the misprints is computed, and it is what docs/mechanism.md says."""

import re
from pathlib import Path

import pytest

from torquerig.reproduction.misprints import misprints

DOCUMENT = Path(__file__).parents[2] / "docs" / "mechanism.md"


@pytest.fixture(scope="module")
def evidence():
    return {misprint.where: misprint.evidence for misprint in misprints()}


def rows():
    table = DOCUMENT.read_text(encoding="utf-8").partition("## Where the thesis is misprinted")[2]
    cells = [line.strip("| ").split(" | ") for line in table.splitlines() if line.startswith("| ")]
    return [row[0] for row in cells if row[0] not in {"where", "---"}]


def test_the_report_and_the_document_list_the_same_misprints(evidence):
    assert len(rows()) >= 9
    for row in rows():
        assert any(where.startswith(row) for where in evidence), row
    for where in evidence:
        assert any(where.startswith(row) for row in rows()), where


@pytest.mark.parametrize(
    ("where", "numbers"),
    [
        ("home angles, 5.3", [87.41, 13.61, 92.0, 62.0]),
        ("5.3, 5.4 denominator", [38.78, 26.13, 92.0, 62.0]),
        ("5.5, function", [1, 2, 3, 0, 180, 180]),
        ("after 3.67", [0.58]),
        ("6.1", [14.003, 11.997, 4, 16.66, 10.08]),
        ("Figures 6.6 to 6.10, abscissa", [200, 160, 50, 40]),
    ],
)
def test_the_number_that_came_out_is_the_documents(evidence, where, numbers):
    found = [float(number) for number in re.findall(r"\d+(?:\.\d+)?", evidence[where])]
    assert found[: len(numbers)] == pytest.approx(numbers)
