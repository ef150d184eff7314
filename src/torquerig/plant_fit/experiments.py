"""The thesis' experiments, prepared once and run on any plant: eight closed loops, sixteen errors."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig import building
from torquerig.axes import axis_settings
from torquerig.configuration import Configuration
from torquerig.control.comparison import PublishedRun, published_runs
from torquerig.control.errors import LimitExceeded
from torquerig.control.log import LoopLog
from torquerig.control.loop import Controller, Pace, run_loop
from torquerig.control.reference import ReferenceTable
from torquerig.control.tracking import position_rmse_mm, velocity_rmse
from torquerig.driver.errors import TorqueRigError
from torquerig.driver.master.scale import AxisScale, axis_scale
from torquerig.experiment import run_experiment
from torquerig.planning import plan_motion
from torquerig.plant_fit.wireless import WirelessJoints
from torquerig.schema import Rig
from torquerig.schema_machines import Plant

STOPPED: Final = 10.0
"""By what factor the errors count as the thesis' when a limit stops a run: far beyond any that ends."""

LOCKSTEP_URL: Final = "lockstep:"
_NAME: Final = "under trial"

Errors = NDArray[np.float64]
"""Position RMSE [mm] and velocity RMSE [m/s] of each run, shape (runs, 2)."""


class _Prepared(NamedTuple):
    """One experiment: all of it that does not depend on the plant."""

    simulated: Rig
    controller: Controller
    table: ReferenceTable
    pace: Pace
    scales: tuple[AxisScale, ...]
    home: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Experiments:
    """The thesis' runs, ready to be repeated without a wire.

    Attributes:
        runs: The runs with the thesis' results.
    """

    runs: tuple[PublishedRun, ...]
    _prepared: tuple[_Prepared, ...]

    def errors(self, plant: Plant, which: Sequence[int]) -> Errors:
        """The errors of some runs on a plant.

        Args:
            plant: The true machine.
            which: Places in `runs`.

        Returns:
            One row a run; ten times the thesis' errors where a limit stops it.
        """
        return np.array([self._errors_of(self.runs[place], self._prepared[place], plant) for place in which])

    def _errors_of(self, run: PublishedRun, prepared: _Prepared, plant: Plant) -> tuple[float, float]:
        joints = WirelessJoints(prepared.simulated, plant, prepared.scales, prepared.home)
        log = LoopLog.for_table(prepared.table)
        try:
            run_loop(joints, prepared.controller, prepared.table, log, stopwatch_ns=_no_time, pace=prepared.pace)
        except LimitExceeded:
            return STOPPED * run.position_rmse_mm, STOPPED * run.velocity_rmse_m_s
        return position_rmse_mm(log), velocity_rmse(log)


def prepare(base: Configuration) -> Experiments:
    """Make everything ready that does not depend on the plant.

    The holds around the motion are left out: on the wire the machine stands still in them, and they count in no error.

    Args:
        base: The rig; its law, motion and bus do not matter.

    Returns:
        The experiments.
    """
    runs = published_runs()
    return Experiments(runs, tuple(_prepare(base, run) for run in runs))


def errors_over_the_wire(base: Configuration, plant: Plant, runs: Sequence[PublishedRun]) -> Errors:
    """The errors of some runs through the whole chain: CANopen frames, drives, plant, in lockstep.

    Args:
        base: The rig.
        plant: The true machine.
        runs: Which runs.

    Returns:
        One row a run; NaN where a limit or a drive stops it.
    """
    rows = []
    for run in runs:
        try:
            summary = run_experiment(_on_plant(_configured(base, run), plant)).summary
        except (LimitExceeded, TorqueRigError):
            rows.append((math.nan, math.nan))
        else:
            rows.append((summary.position_rmse_mm, summary.velocity_rmse_m_s))
    return np.array(rows)


def thesis_errors(runs: Sequence[PublishedRun]) -> Errors:
    """The thesis' errors, as `Errors`."""
    return np.array([(run.position_rmse_mm, run.velocity_rmse_m_s) for run in runs])


def _prepare(base: Configuration, run: PublishedRun) -> _Prepared:
    """One experiment, without the holds around its motion."""
    configuration = _configured(base, run)
    around = configuration.rig.approach.model_copy(update={"hold_before": 0.0, "hold_after": 0.0})
    settings = configuration.rig.model_copy(update={"approach": around})
    controller = building.controller(settings)
    axes = axis_settings(configuration)
    return _Prepared(
        configuration.simulated,
        controller,
        plan_motion(settings, controller),
        building.pace(settings),
        tuple(axis_scale(axis, rated=None) for axis in axes),
        tuple(axis.home for axis in axes),
    )


def _configured(base: Configuration, run: PublishedRun) -> Configuration:
    """The rig with a run's law and motion, in lockstep."""
    loop = base.rig.loop.model_copy(update={"law": run.law, "motion": run.motion, "repeat": 1})
    bus = base.rig.bus.model_copy(update={"url": LOCKSTEP_URL})
    return replace(base, rig=base.rig.model_copy(update={"loop": loop, "bus": bus}))


def _on_plant(configuration: Configuration, plant: Plant) -> Configuration:
    """The configuration with another true machine."""

    def changed(rig: Rig) -> Rig:
        simulator = rig.simulator.model_copy(update={"plant": _NAME})
        return rig.model_copy(update={"simulator": simulator, "plant": {**rig.plant, _NAME: plant}})

    return replace(configuration, rig=changed(configuration.rig), simulated=changed(configuration.simulated))


def _no_time() -> int:
    """A stopwatch for those who do not want to know."""
    return 0
