"""Tables 6.1 and 6.2 and the object of `--json`: our numbers beside the thesis'."""

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from torquerig.configuration import Setting
from torquerig.json_numbers import finite_number
from torquerig.reproduction.experiments import NUMBERS, PlantRuns, Run
from torquerig.reproduction.findings import findings
from torquerig.reproduction.settings import Departures
from torquerig.reproduction.verdicts import Finding

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
        """How many findings came out, of those that a run can refute."""
        return sum(finding.reproduced is True and not finding.of_model for finding in self.findings)

    @property
    def refutable(self) -> int:
        """How many findings are judged on runs, and not on the model alone."""
        return sum(not finding.of_model for finding in self.findings)

    @property
    def factor_in_words(self) -> str:
        """The typical factor, or why there is none."""
        factor, compared = self.runs.typical_factor(), self.runs.compared()
        if factor is None:
            return f"no typical factor, {compared} of {NUMBERS} numbers are there"
        return f"typical factor {factor:.2f} of {NUMBERS} numbers"


def report_on(plants: Sequence[PlantRuns]) -> tuple[PlantReport, ...]:
    """Judge the runs of each plant."""
    return tuple(PlantReport(runs, findings(runs)) for runs in plants)


def as_json(reports: Sequence[PlantReport], departures: Departures) -> dict[str, Any]:
    """What `torquerig reproduce --json` prints; a number that there is not is null.

    Args:
        reports: Of each plant.
        departures: What the user's file changes.

    Returns:
        {plants: {NAME: {typical_factor, compared_numbers, runs: [...], findings: [...]}}, changed_settings: [...],
        settings_put_aside: [...]}. The typical factor is null unless all of the thesis' numbers are compared.
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
        },
        "changed_settings": [_setting_as_json(each) for each in departures.changed],
        "settings_put_aside": [_setting_as_json(each) for each in departures.put_aside],
    }


def _setting_as_json(setting: Setting) -> dict[str, Any]:
    """A setting of the user's as JSON holds it; a key that is not shipped has null for default."""
    return {"key": setting.key, "value": setting.value, "default": setting.default, "source": setting.source}


def _run_as_json(run: Run) -> dict[str, Any]:
    """A run as JSON holds it."""
    summary = run.summary
    measured = {name: None if summary is None else getattr(summary, name) for name in _MEASURED}
    position_ratio, velocity_ratio = run.ratios or (None, None)
    numbers = {**measured, "position_ratio": position_ratio, "velocity_ratio": velocity_ratio, "law_us": run.law_us}
    numbers |= {"true_peak_torque_nm": run.true_peak_torque_nm, "thesis_ms": run.thesis_ms}
    told = {key: finite_number(value) for key, value in numbers.items()}
    return {"law": run.law, "motion": run.motion, **told, "ended": run.ended}
