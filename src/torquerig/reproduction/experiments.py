"""The thesis' experiments: which there are, and all of them run one after another."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from torquerig.building import controller
from torquerig.configuration import Configuration
from torquerig.control.comparison import published_runs, typical_factor
from torquerig.control.errors import LimitExceeded
from torquerig.control.law import Law, Published
from torquerig.control.laws import load_laws
from torquerig.control.motions import THESIS_STROKES
from torquerig.control.tracking import motion_rows
from torquerig.driver.errors import DriveFault, TorqueRigError
from torquerig.errors import ApplicationError, RecordError
from torquerig.experiment import Outcome, Watcher, run_experiment
from torquerig.mechanism import Manipulator, MechanismError
from torquerig.reproduction.settings import configuration_of
from torquerig.reproduction.torques import true_torque
from torquerig.summary import Summary

PLANTS: Final = ("identified", "fitted")
PD_LAWS: Final = ("decoupled-pd", "coupled-pd")
MODEL_BASED_LAWS: Final = ("augmented-pd", "computed-torque")
THESIS_LAWS: Final = PD_LAWS + MODEL_BASED_LAWS
"""In the order of Tables 6.1 and 6.2."""
MOTIONS: Final = tuple(THESIS_STROKES)
NUMBERS: Final = 2 * len(published_runs())
"""Errors of the thesis to compare with: position and velocity of each of its runs."""


@dataclass(frozen=True, slots=True)
class Experiment:
    """A run that is to be made.

    Attributes:
        plant: Name of the simulated machine.
        law: The law.
        motion: Number of the test motion.
        configuration: All of it.
    """

    plant: str
    law: type[Law]
    motion: int
    configuration: Configuration

    @property
    def name(self) -> str:
        """Its name, fit for a folder."""
        return f"{self.plant}-{self.law.name}-motion-{self.motion}"

    @property
    def published(self) -> Published | None:
        """The thesis' result; None for a law or motion that it does not have."""
        result = self.law.published.get(self.motion)
        return result if result is not None and result.is_of_thesis else None


@dataclass(frozen=True, slots=True)
class Run:
    """An experiment that was made.

    Attributes:
        experiment: Which one.
        outcome: What it left; None if it was stopped.
        ended: "done", or the sentence of the limit or drive that stopped it.
    """

    experiment: Experiment
    outcome: Outcome | None
    ended: str

    @property
    def law(self) -> str:
        """The law's name."""
        return self.experiment.law.name

    @property
    def motion(self) -> int:
        """Number of the test motion."""
        return self.experiment.motion

    @property
    def summary(self) -> Summary | None:
        """Its numbers; None if it was stopped."""
        return None if self.outcome is None else self.outcome.summary

    @property
    def true_peak_torque_nm(self) -> float | None:
        """The peak torque by the drives' own gains, not by the driver's counts [N·m]; None where it is not known."""
        if self.outcome is None:
            return None
        log = self.outcome.log
        recorded = log.tau_actual[: log.rows][motion_rows(log)]
        truth = true_torque(self.experiment.configuration, recorded)
        return None if truth is None else float(np.nanmax(np.abs(truth)))

    @property
    def law_us(self) -> float | None:
        """Median time of estimator, kinematics, limits and law in a cycle [µs]; None if the run was stopped."""
        return None if self.summary is None else self.summary.law_us

    @property
    def thesis_ms(self) -> float | None:
        """The law's running time on the thesis' computer [ms]; None for a law that it does not have."""
        return self.experiment.law.thesis_ms()

    @property
    def ratios(self) -> tuple[float, float] | None:
        """Position and velocity RMSE over the thesis'; None if there is nothing to compare."""
        summary, thesis = self.summary, self.experiment.published
        if summary is None or thesis is None:
            return None
        return (
            summary.position_rmse_mm / thesis.position_rmse_mm,
            summary.velocity_rmse_m_s / thesis.velocity_rmse_m_s,
        )


@dataclass(frozen=True, slots=True)
class PlantRuns:
    """All runs on one plant.

    Attributes:
        plant: Its name.
        runs: The runs, motion by motion, the thesis' laws first.
    """

    plant: str
    runs: tuple[Run, ...]

    @property
    def model(self) -> Manipulator:
        """The manipulator as the controllers knew it."""
        return controller(self.runs[0].experiment.configuration.rig).model

    @property
    def laws(self) -> tuple[str, ...]:
        """The laws that were run, in order."""
        return tuple(dict.fromkeys(run.law for run in self.runs))

    def of(self, motion: int) -> tuple[Run, ...]:
        """The runs of a motion that were not stopped."""
        return tuple(run for run in self.runs if run.motion == motion and run.outcome is not None)

    def compared(self) -> int:
        """How many numbers have one of the thesis beside them: `NUMBERS` if all its runs came to their end."""
        return 2 * sum(run.ratios is not None for run in self.runs)

    def typical_factor(self) -> float | None:
        """The typical factor between our errors and all of the thesis'; None when a run of its was stopped.

        A stopped run is the worst there is: a factor of the others alone would look the better for it.
        """
        ratios = [ratio for run in self.runs for ratio in run.ratios or ()]
        return typical_factor(ratios, [1.0] * NUMBERS) if len(ratios) == NUMBERS else None


def planned(plants: Sequence[str], config_file: Path | None = None) -> tuple[Experiment, ...]:
    """The experiments: on each plant each motion under every law that has gains for it.

    They are the thesis': in lockstep, one run each, with its motions, gains and sampling time. All else is as
    configured.

    Args:
        plants: Names of plants.
        config_file: A TOML file with what differs from the shipped configuration.

    Returns:
        Plant by plant, motion by motion, the thesis' laws first.

    Raises:
        ConfigurationError: The file cannot be used, or there is no such plant.
    """
    laws = load_laws()
    ordered = [laws[name] for name in THESIS_LAWS if name in laws]
    ordered += [law for law in laws.values() if law not in ordered]
    return tuple(
        Experiment(plant, law, motion, configuration_of(config_file, plant, law.name, motion))
        for plant in dict.fromkeys(plants)
        for motion in MOTIONS
        for law in ordered
        if motion in law.gains
    )


def run_all(experiments: Sequence[Experiment], watcher: Watcher, records: Path | None = None) -> tuple[PlantRuns, ...]:
    """Make all experiments.

    A run that a limit or a drive stops is told as such, and the others go on: a new law may well ask for too much.

    Args:
        experiments: Which ones.
        watcher: Is told how far it all is.
        records: The folder for the records, one a run; None for no records.

    Returns:
        The runs of each plant.

    Raises:
        RecordError: A record cannot be written.
    """
    series = Series(watcher, len(experiments))
    runs = []
    for experiment in experiments:
        series.begin(experiment)
        runs.append(_run(experiment, series, None if records is None else records / experiment.name))
    plants = dict.fromkeys(experiment.plant for experiment in experiments)
    return tuple(PlantRuns(name, tuple(run for run in runs if run.experiment.plant == name)) for name in plants)


class Series:
    """Tells of several experiments as of one: a `Watcher` of each that has one behind it."""

    def __init__(self, watcher: Watcher, count: int) -> None:
        """Begin before the first of `count` experiments."""
        self._watcher = watcher
        self._count = count
        self._begun = 0
        self._before = 0
        self._name = ""
        watcher.phase("compiling")

    def begin(self, experiment: Experiment) -> None:
        """The next experiment begins."""
        self._begun += 1
        self._name = f"{experiment.plant}, {experiment.law.name}, motion {experiment.motion}"

    def phase(self, words: str) -> None:
        """Hear and forget: the bar of all experiments stays."""

    def prepare(self, words: str, cycles: int) -> None:  # noqa: ARG002  (Watcher's signature)
        """An experiment's loop will begin, with so many cycles."""
        self._before = (self._begun - 1) * cycles
        self._watcher.prepare(f"{self._begun} of {self._count}: {self._name}", cycles * self._count)
        self._watcher.cycles_done(self._before)

    def cycles_done(self, done: int) -> None:
        """So many cycles of the experiment are done."""
        self._watcher.cycles_done(self._before + done)


def _run(experiment: Experiment, watcher: Watcher, record: Path | None) -> Run:
    """Make one experiment."""
    try:
        outcome = run_experiment(experiment.configuration, record=record, watcher=watcher)
    except (LimitExceeded, DriveFault, MechanismError) as stop:
        return Run(experiment, None, str(stop))
    except (ApplicationError, TorqueRigError):
        raise  # some of them are an OSError too, and tell more than its words
    except OSError as error:
        raise RecordError(f"cannot write the record {record}: {error.strerror or error}") from error
    return Run(experiment, outcome, "done")
