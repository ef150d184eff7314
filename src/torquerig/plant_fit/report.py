"""A fit's findings as JSON and as tables for a person."""

from typing import Any, Final

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.table import Table

from torquerig.json_numbers import finite_number
from torquerig.plant_fit.fit import PlantFit
from torquerig.plant_fit.flatness import Flatness
from torquerig.plant_fit.parameters import PlantParameter, from_unit
from torquerig.plant_fit.problem import Array
from torquerig.plant_fit.search import Optimum

AT_A_BOUND: Final = 5e-3
"""Nearer to a bound than this share of its range a parameter counts as standing at it."""


def verdict(fit: PlantFit) -> str:
    """What the plant found is, and what it is not."""
    if fit.best is None:
        return "stopped before any plant was tried"
    factor = fit.wired_factor or fit.best.factor
    return f"within {100 * (factor - 1):.0f} %, not a validated plant; the optimum is not unique"


def as_json(fit: PlantFit, seed: int, *, stopped: bool) -> dict[str, Any]:
    """Everything that a fit has found, as JSON holds it.

    Args:
        fit: The fit.
        seed: Of its screening.
        stopped: Whether somebody stopped it.

    Returns:
        One object; what the fit did not come to is null or empty.
    """
    best, problem = fit.best, fit.problem
    return {
        "verdict": verdict(fit),
        "stopped": stopped,
        "seed": seed,
        "plants_tried": problem.tried,
        "typical_factor": best and best.factor,
        "typical_factor_over_the_wire": fit.wired_factor,
        "typical_factor_at_start": fit.start_factor,
        "parameters": _parameters(fit, best) if best else [],
        "runs": _runs(fit, best) if best else [],
        "optima": [
            {"typical_factor": each.factor, "values": _named(problem.parameters, each.point)} for each in fit.optima
        ],
        "cross_validation": [
            {
                "fitted_motion": each.fitted,
                "judged_motion": each.judged,
                "fitted_typical_factor": each.fitted_factor,
                "judged_typical_factor": each.judged_factor,
                "values": dict(zip((p.name for p in problem.parameters), each.values.tolist(), strict=True)),
            }
            for each in fit.validations
        ],
        "correlation": fit.flatness and fit.flatness.correlation.tolist(),
        "condition_number": fit.flatness and finite_number(fit.flatness.condition),
        "plant": best and problem.plant_at(best.point).model_dump(mode="json"),
    }


def show(fit: PlantFit, console: Console) -> None:
    """Print a fit's findings for a person.

    Args:
        fit: The fit.
        console: Where.
    """
    if fit.best is not None:
        console.print(Group(*_tables(fit, fit.best)))
    console.print(f"{verdict(fit)[0].upper()}{verdict(fit)[1:]}.", markup=False, soft_wrap=True)


def _tables(fit: PlantFit, best: Optimum) -> list[RenderableType]:
    """What there is to print, in the order of its weight."""
    shown: list[RenderableType] = [_factors(fit, best), _parameter_table(fit, best), _run_table(fit, best)]
    if fit.validations:
        shown.append(_validation_table(fit))
    if fit.flatness is not None:
        shown.append(_correlation_table(fit, fit.flatness))
    return shown


def _factors(fit: PlantFit, best: Optimum) -> str:
    """The typical factors in one line."""
    words = [f"typical factor {best.factor:.4f}"]
    if fit.wired_factor is not None:
        words.append(f"over the wire {fit.wired_factor:.4f}")
    if fit.start_factor is not None:
        words.append(f"at the start {fit.start_factor:.4f}")
    ends = ", ".join(f"{each.factor:.4f}" for each in fit.optima)
    return f"{'; '.join(words)}; {fit.problem.tried} plants tried" + (f"\nthe descents ended at {ends}" if ends else "")


def _parameter_table(fit: PlantFit, best: Optimum) -> Table:
    """Each parameter with its bounds and the leeway that it has."""
    caption = "* at a bound" if any(row["at_bound"] for row in _parameters(fit, best)) else None
    table = Table(title="Parameters", title_justify="left", caption=caption, caption_justify="left")
    table.add_column("", no_wrap=True)
    for heading in ("value", "within 1 %", "bounds"):
        table.add_column(heading, justify="right")
    table.add_column("unit")
    for row in _parameters(fit, best):
        leeway = (
            "-"
            if row["lowest_within_1_percent"] is None
            else (f"{row['lowest_within_1_percent']:.4g} .. {row['highest_within_1_percent']:.4g}")
        )
        mark = " *" if row["at_bound"] else ""
        table.add_row(
            row["name"], f"{row['value']:.4g}{mark}", leeway, f"{row['lowest']:g} .. {row['highest']:g}", row["unit"]
        )
    return table


def _run_table(fit: PlantFit, best: Optimum) -> Table:
    """The sixteen numbers beside the thesis'."""
    table = Table(title="RMSE of position [mm] and velocity [m/s]".replace("[", r"\["), title_justify="left")
    table.add_column("law, motion", no_wrap=True)
    for heading in ("position", "thesis", "ratio", "velocity", "thesis", "ratio"):
        table.add_column(heading, justify="right")
    for row in _runs(fit, best):
        table.add_row(
            f"{row['law']}, {row['motion']}",
            _decimals(row["position_rmse_mm"], 4),
            _decimals(row["thesis_position_rmse_mm"], 4),
            _decimals(row["position_ratio"], 2),
            _decimals(row["velocity_rmse_m_s"], 4),
            _decimals(row["thesis_velocity_rmse_m_s"], 4),
            _decimals(row["velocity_ratio"], 2),
        )
    return table


def _validation_table(fit: PlantFit) -> Table:
    """Fits to one motion, judged on the other."""
    table = Table(title="Cross-validation", title_justify="left")
    table.add_column("", no_wrap=True)
    for each in fit.validations:
        table.add_column(f"fitted to motion {each.fitted}", justify="right")
    for place, parameter in enumerate(fit.problem.parameters):
        table.add_row(parameter.name, *(f"{each.values[place]:.4g}" for each in fit.validations))
    table.add_row("factor on its own motion", *(f"{each.fitted_factor:.3f}" for each in fit.validations))
    table.add_row("factor on the other motion", *(f"{each.judged_factor:.3f}" for each in fit.validations))
    return table


def _correlation_table(fit: PlantFit, found: Flatness) -> Table:
    """Which parameters the data do not tell apart."""
    names = [each.name for each in fit.problem.parameters]
    title = f"Correlation along the valley; condition number {found.condition:.3g}"
    table = Table(title=title, title_justify="left")
    table.add_column("", no_wrap=True)
    for number in range(1, len(names) + 1):
        table.add_column(f"({number})", justify="right")
    for number, (name, row) in enumerate(zip(names, found.correlation, strict=True), start=1):
        table.add_row(f"({number}) {name}", *(f"{value:+.2f}" for value in row))
    return table


def _parameters(fit: PlantFit, best: Optimum) -> list[dict[str, Any]]:
    """Each parameter: value, bounds, whether it stands at one, and its leeway."""
    parameters = fit.problem.parameters
    values = from_unit(parameters, best.point)
    low = high = None
    if fit.flatness is not None:
        low, high = from_unit(parameters, fit.flatness.lowest), from_unit(parameters, fit.flatness.highest)
    return [
        {
            "name": parameter.name,
            "value": float(values[place]),
            "unit": parameter.unit,
            "lowest": parameter.lowest,
            "highest": parameter.highest,
            "at_bound": _bound_at(float(best.point[place])),
            "lowest_within_1_percent": None if low is None else float(low[place]),
            "highest_within_1_percent": None if high is None else float(high[place]),
        }
        for place, parameter in enumerate(parameters)
    ]


def _runs(fit: PlantFit, best: Optimum) -> list[dict[str, Any]]:
    """Each run's errors, over the wire where they are known, beside the thesis'."""
    target = fit.problem.target
    errors = target * np.exp(best.residuals).reshape(target.shape) if fit.wired is None else fit.wired
    return [
        {
            "law": run.law,
            "motion": run.motion,
            "position_rmse_mm": finite_number(ours[0]),
            "velocity_rmse_m_s": finite_number(ours[1]),
            "thesis_position_rmse_mm": float(theirs[0]),
            "thesis_velocity_rmse_m_s": float(theirs[1]),
            "position_ratio": finite_number(ours[0] / theirs[0]),
            "velocity_ratio": finite_number(ours[1] / theirs[1]),
        }
        for run, ours, theirs in zip(fit.problem.runs, errors, target, strict=True)
    ]


def _decimals(value: float | None, places: int) -> str:
    """A number for a table, a dash for none."""
    return "-" if value is None else f"{value:.{places}f}"


def _bound_at(share: float) -> str | None:
    """Which bound a parameter stands at."""
    if share <= AT_A_BOUND:
        return "lower"
    return "upper" if share >= 1 - AT_A_BOUND else None


def _named(parameters: tuple[PlantParameter, ...], point: Array) -> dict[str, float]:
    """A point's values by name."""
    return dict(zip((each.name for each in parameters), from_unit(parameters, point).tolist(), strict=True))
