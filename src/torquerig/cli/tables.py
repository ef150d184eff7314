"""A run's numbers as tables for a person."""

import math
from typing import Final

from rich.markup import escape
from rich.table import Table

from torquerig.record_figures import Figure
from torquerig.summary import Summary, motion_in_words

US_PER_MS: Final = 1e3
SMALL: Final = 0.1
"""A ratio below it has three digits behind the point, others two."""


def title_of(summary: Summary) -> str:
    """What the picture is a picture of."""
    plant = f", plant {summary.plant}" if summary.plant else ""
    return f"{summary.law}, {motion_in_words(summary.motion)}, {summary.rate_hz:g} Hz{plant}"


def summary_table(summary: Summary) -> Table:
    """The summary beside the thesis' row."""
    thesis, departs = summary.thesis, bool(summary.departures)
    table = Table(title=escape(title_of(summary)), title_justify="left", caption_justify="left")
    if departs:
        table.caption = escape(f"* not this experiment: here {'; '.join(summary.departures)}")
    table.add_column("")
    for heading in ("this run", "thesis *" if departs else "thesis", "ratio"):
        table.add_column(heading, justify="right")
    _compare(table, "position RMSE [mm]", summary.position_rmse_mm, thesis and thesis.position_rmse_mm)
    if summary.true_position_rmse_mm is not None:
        _compare(table, "true position RMSE [mm]", summary.true_position_rmse_mm, None)
    _compare(table, "velocity RMSE [m/s]", summary.velocity_rmse_m_s, thesis and thesis.velocity_rmse_m_s)
    _compare(table, "peak torque [N·m]", summary.peak_torque_nm, None)
    _compare(table, "rms torque [N·m]", summary.rms_torque_nm, None)
    gains, cycle = summary.gains, summary.cycle_us
    borrowed = "" if gains.motion == summary.motion else f" (motion {gains.motion}'s)"
    table.add_row(escape(f"gains{borrowed}: kp, kv"), f"{gains.kp:g}, {gains.kv:g}")
    table.add_row("late cycles", f"{summary.overruns} of {summary.cycles}")
    for name, load in (summary.bus_loads or {"": summary.bus_load}).items():
        table.add_row(escape(f"bus load {name}".rstrip()), f"{100 * load:.1f} %")
    table.add_row(escape("work a cycle [µs]: p50, p99, max"), f"{cycle.p50:.0f}, {cycle.p99:.0f}, {cycle.max:.0f}")
    thesis_us = None if summary.thesis_ms is None else US_PER_MS * summary.thesis_ms
    _compare(table, "of it the law [µs]: p50", summary.law_us, thesis_us, digits=0)
    if summary.timing is not None:
        late, answered, commanded = (
            summary.timing.lateness_us,
            summary.timing.sync_to_last_tpdo_us,
            summary.timing.sync_to_last_rpdo_us,
        )
        table.add_row(escape("lateness of SYNC [µs]: p50, p99, max"), f"{late.p50:.0f}, {late.p99:.0f}, {late.max:.0f}")
        table.add_row(escape("SYNC to last TPDO, RPDO [µs]: p99"), f"{answered.p99:.0f}, {commanded.p99:.0f}")
    return table


def _compare(table: Table, words: str, ours: float, theirs: float | None, *, digits: int = 4) -> None:
    """Add a row with our number, the thesis' and their ratio, where there are such."""
    shown = "-" if math.isnan(ours) else f"{ours:.{digits}f}"
    if theirs is None:
        table.add_row(escape(words), shown)
    else:
        ratio = "-" if math.isnan(ours) else f"{ours / theirs:.{2 if ours > SMALL * theirs else 3}f}"
        table.add_row(escape(words), shown, f"{theirs:.{digits}f}", ratio)


def number(figure: Figure) -> str:
    """A figure's number with its digits; "-" where there is none."""
    return "-" if math.isnan(figure.value) else f"{figure.value:.{figure.digits}f}"
