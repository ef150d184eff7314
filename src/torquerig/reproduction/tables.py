"""Tables 6.1 and 6.2 and the object of `--json`: our numbers beside the thesis'."""

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from torquerig.reproduction.experiments import PlantRuns, Run, finite
from torquerig.reproduction.findings import Finding, findings

_MEASURED: Final = ("position_rmse_mm", "velocity_rmse_m_s", "peak_torque_nm", "rms_torque_nm")


class PlantReport(NamedTuple):
    """What came out on one plant.

    Attributes:
        runs: Its runs.
        findings: The thesis' findings, judged on them.
    """

    runs: PlantRuns
    findings: tuple[Finding, ...]

    @property
    def plant(self) -> str:
        """Its name."""
        return self.runs.plant

    @property
    def reproduced(self) -> int:
        """How many findings came out."""
        return sum(finding.reproduced is True for finding in self.findings)


def report_on(plants: Sequence[PlantRuns]) -> tuple[PlantReport, ...]:
    """Judge the runs of each plant."""
    return tuple(PlantReport(runs, findings(runs)) for runs in plants)


def as_json(reports: Sequence[PlantReport]) -> dict[str, Any]:
    """What `torquerig reproduce --json` prints; a number that there is not is null.

    Args:
        reports: Of each plant.

    Returns:
        {plants: {NAME: {typical_factor, runs: [...], findings: [...]}}}.
    """
    return {
        "plants": {
            report.plant: {
                "typical_factor": report.runs.typical_factor(),
                "compared_numbers": report.runs.compared(),
                "runs": [_run_as_json(run) for run in report.runs.runs],
                "findings": [finding.as_json() for finding in report.findings],
            }
            for report in reports
        }
    }


def _run_as_json(run: Run) -> dict[str, Any]:
    """A run as JSON holds it."""
    summary = run.summary
    measured = {name: None if summary is None else getattr(summary, name) for name in _MEASURED}
    position_ratio, velocity_ratio = run.ratios or (None, None)
    numbers = {**measured, "position_ratio": position_ratio, "velocity_ratio": velocity_ratio, "law_us": run.law_us}
    told = {key: finite(value) for key, value in numbers.items()}
    return {"law": run.law, "motion": run.motion, **told, "ended": run.ended}
