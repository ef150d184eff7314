"""One experiment: enable the drives, approach, run the motion, hold, disable; then the summary and the record."""

import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from torquerig import building
from torquerig.assembly import Rig, open_rig
from torquerig.axes import axis_settings, group_settings, refuse_unheard
from torquerig.configuration import Configuration
from torquerig.control.log import LoopLog
from torquerig.control.loop import Controller, Progress, run_loop
from torquerig.control.reference import ReferenceTable
from torquerig.control.row import Row
from torquerig.delays import compensation
from torquerig.driver.bus.interface import Bus
from torquerig.driver.bus.patient import PatientBus
from torquerig.driver.bus.python_can import PythonCanBus
from torquerig.driver.bus.several import SeveralBuses
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.master.samples import AxisSample
from torquerig.errors import RecordError
from torquerig.garbage import no_collections
from torquerig.mechanism import warm_up
from torquerig.planning import join, plan_approach, plan_motion
from torquerig.provenance import drives_of
from torquerig.record import DONE, claim
from torquerig.results import Results
from torquerig.scheduling import real_time
from torquerig.stopping import undisturbed
from torquerig.summary import Summary, motion_in_words

PROGRESS_CALLS: Final = 50


class Watcher(Protocol):
    """Who is told what an experiment is doing."""

    def phase(self, words: str) -> None:
        """Something new begins."""
        ...

    def prepare(self, words: str, cycles: int) -> None:
        """The loop will begin, with so many cycles."""
        ...

    def cycles_done(self, done: int) -> None:
        """So many cycles are done; called inside the loop."""
        ...


class Nobody:
    """A watcher who does not care."""

    def phase(self, words: str) -> None:
        """Hear and forget."""

    def prepare(self, words: str, cycles: int) -> None:
        """Hear and forget."""

    def cycles_done(self, done: int) -> None:
        """Hear and forget."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What an experiment leaves.

    Attributes:
        summary: Its numbers.
        log: Its cycles.
        truth: True positions at the log's rows, shape (rows, 2) [m]; None on a real-time bus.
        notes: What a person should know: old faults that were reset, whether the machine was homed.
        record: The folder of its record, if there is one.
    """

    summary: Summary
    log: LoopLog
    truth: NDArray[np.float64] | None
    notes: tuple[str, ...]
    record: Path | None


def run_experiment(
    configuration: Configuration, *, record: str | Path | None = None, watcher: Watcher | None = None
) -> Outcome:
    """Run one experiment, and write its record, also when it is stopped or fails.

    Args:
        configuration: What to run, and on which bus.
        record: A new or empty folder for the record.
        watcher: Is told what is being done.

    Returns:
        Summary, cycles and notes.

    Raises:
        RecordError: The record's folder cannot be used, and nothing has moved; or the record cannot be written after a
            run that nothing else ended.
        TorqueRigError: The bus, a drive, or another master.
        ControlError: A limit.
        MechanismError: A pose that does not exist.
    """
    place = None if record is None else claim(Path(record))
    results = Results(configuration)
    try:
        log = _run(results, watcher or Nobody())
    except BaseException as error:
        try:
            _keep(results, place, str(error) or type(error).__name__)
        except RecordError as second:
            error.add_note(str(second))  # what ended the run matters more, and goes on
        raise
    _keep(results, place, DONE)
    summary = results.summary()
    assert summary is not None  # noqa: S101  (there is a log)
    return Outcome(summary, log, results.true_positions(), tuple(results.notes), place)


def _keep(results: Results, place: Path | None, how_it_ended: str) -> None:
    """Write the record, if there is to be one."""
    if place is not None:
        with undisturbed():
            results.write(place, how_it_ended)


def _run(results: Results, watcher: Watcher) -> LoopLog:
    """Open the bus, do everything, and keep what the simulator knows."""
    refuse_unheard(axis_settings(results.configuration))
    watcher.phase("compiling")
    warm_up()
    with open_rig(results.configuration, tap=results.bus_log) as rig:
        if not rig.is_simulated:
            results.epoch_ns = time.time_ns() - rig.bus.now_ns()
        try:
            return _drive(rig, results, watcher)
        finally:
            results.truth = rig.truth()


def _drive(rig: Rig, results: Results, watcher: Watcher) -> LoopLog:
    """Prepare all that can be prepared, then take the drives."""
    settings = results.configuration.rig
    controller = replace(building.controller(settings), compensation=compensation(settings))
    axes = axis_settings(results.configuration)
    motion = plan_motion(settings, controller)
    rehearse(controller, motion)
    watcher.phase("configuring the drives")
    priority = 0 if rig.is_simulated else settings.loop.fifo_priority
    group = AxisGroup(rig.bus, axes, group_settings(settings))
    try:
        with no_collections(), real_time(priority) as scheduling, group:
            results.real_time = scheduling.steps
            if not rig.is_simulated:
                results.notes.append(f"The loop ran under {scheduling}.")
            results.meet(drives_of(group, in_lockstep=rig.is_simulated))
            return _move(group, controller, motion, results, watcher)
    finally:
        results.counters = driver_counters(rig.bus, group)
        if isinstance(rig.bus, PatientBus):
            results.notes.append(f"Simulated time stood still for {1e-9 * rig.bus.stood_still_ns:.3g} s in all.")


def _move(
    group: AxisGroup, controller: Controller, motion: ReferenceTable, results: Results, watcher: Watcher
) -> LoopLog:
    """Home and enable the drives, and run the loop."""
    settings = results.configuration.rig
    if group.home():
        results.notes.append("The drives took the pose of the home fixture for home.")
    stands_at = _standing_position(group, controller)
    start_x, start_y = motion.position[0].tolist()
    approach = plan_approach(settings, controller, stands_at, (start_x, start_y), breathe=lambda: group.wait(0.0))
    table = join([*approach, motion])
    ahead = controller.compensation.ahead(controller.model, table, lambda: group.wait(0.0))
    log = LoopLog.for_table(table)
    watcher.prepare(f"{settings.loop.law}, {motion_in_words(settings.loop.motion)}", len(table))
    results.notes += group.enable()
    results.log = log
    return run_loop(
        group,
        controller,
        table,
        log,
        stopwatch_ns=time.perf_counter_ns,
        pace=building.pace(settings),
        progress=Progress(watcher.cycles_done, max(1, len(table) // PROGRESS_CALLS)),
        ahead=ahead,
    )


def _standing_position(group: AxisGroup, controller: Controller) -> tuple[float, float]:
    """Where the machine stands [m], by a cycle without torque."""
    sample = group.sample(group.now_ns())
    group.command(np.zeros(3), sample.at_ns)
    x, y = controller.model.forward_kinematics(sample.q).tolist()
    return x, y


def driver_counters(bus: Bus, group: AxisGroup) -> dict[str, dict[str, Any]]:
    """What the driver counted: frames of no use, what became of the cycles, and what went wrong on the bus."""
    counters = {"frames": asdict(group.pump_counts), "cycles": asdict(group.cycle_counts)}
    if isinstance(bus, PatientBus):
        counters["patience"] = {"stood_still_ns": bus.stood_still_ns}
        bus = bus.patient_with
    if isinstance(bus, PythonCanBus | SeveralBuses):
        counters["bus"] = bus.counts
    return counters


def rehearse(controller: Controller, table: ReferenceTable) -> None:
    """Go through a cycle's work once: whatever is compiled or loaded at first use is so before a deadline.

    Args:
        controller: What works.
        table: A reference.
    """
    controller.along(table, None, Row())(0, AxisSample(0, table.q[0], np.zeros(3), complete=True))
