"""What a run has brought so far: from it come the summary and the record, whatever ended the run."""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from torquerig import building
from torquerig.buses import bus_urls, channel_names, words_for
from torquerig.configuration import DEFAULT, Configuration
from torquerig.control.laws import law_named
from torquerig.control.log import LoopLog
from torquerig.control.tracking import motion_rows, rms_norm
from torquerig.device_sim.plant import TruthRows
from torquerig.driver.bus.url import LOCKSTEP
from torquerig.provenance import Drives, notes_on_loaded
from torquerig.record import (
    BUS_FILE,
    CYCLES_FILE,
    RUN,
    RUN_FILE,
    TRUTH_FILE,
    BusLog,
    write_run,
    write_table,
)
from torquerig.scheduling import Step
from torquerig.summary import Conditions, Summary, UsedGains, motion_name, summarise
from torquerig.thesis_experiment import departures
from torquerig.truth import at_instants, columns_of


@dataclass(slots=True)
class Results:
    """What is known of a run.

    Attributes:
        configuration: What is run.
        bus_log: Every frame so far.
        notes: What a person should know: old faults that were reset, whether the machine was homed.
        log: The loop's cycles; None until the loop begins.
        truth: What the simulated machine really did; None where nobody knows, or not yet.
        epoch_ns: What the bus clock's zero is since 1970; 0 in simulated time.
        started: When it began.
        counters: What the driver counted.
        real_time: The steps of the real-time set-up, done or refused; none in simulated time.
        drives: Who the drives are; None before they were asked.
    """

    configuration: Configuration
    bus_log: BusLog = field(default_factory=BusLog)
    notes: list[str] = field(default_factory=list)
    log: LoopLog | None = None
    truth: TruthRows | None = None
    epoch_ns: int = 0
    started: datetime = field(default_factory=lambda: datetime.now(UTC))
    counters: dict[str, dict[str, Any]] = field(default_factory=dict)
    real_time: tuple[Step, ...] = ()
    drives: Drives | None = None

    def meet(self, drives: Drives) -> None:
        """Note who the drives are, and see whether the calibration is of them.

        Raises:
            ConfigurationError: It is of others, and these are real.
        """
        self.drives, own = drives, self.configuration
        any_drives = own.rig.calibration.any_drives
        self.notes += notes_on_loaded(own.calibration, own.provenance, drives, any_drives=any_drives)

    def true_positions(self) -> NDArray[np.float64] | None:
        """True positions when each of the log's rows was due, shape (rows, 2) [m]; None where nobody knows."""
        if self.log is None or self.truth is None:
            return None
        return at_instants(self.truth, self.log.start_ns + self.log.due_ns[: self.log.rows])

    def summary(self) -> Summary | None:
        """The numbers of what there is; None before the loop began."""
        log, settings = self.log, self.configuration.rig
        if log is None:
            return None
        motion, law = motion_name(settings.loop.motion), law_named(settings.loop.law)
        gains = UsedGains(building.gains_motion(settings), *map(float, building.gains(settings)))
        published = law.published.get(motion) if isinstance(motion, int) else None
        thesis = published if published is not None and published.is_of_thesis else None
        return summarise(
            Conditions(
                law.name,
                motion,
                gains,
                self._plant(),
                words_for(bus_urls(settings)),
                settings.loop.rate_hz,
                law.thesis_ms(),
                () if thesis is None else departures(self.configuration),
            ),
            log,
            bus_loads=self._bus_loads(log),
            true_position_rmse_mm=self._true_rmse_mm(log),
            thesis=thesis,
        )

    def write(self, place: Path, how_it_ended: str) -> None:
        """Write the record of what there is.

        Args:
            place: Its folder.
            how_it_ended: "done", or the sentence of what ended it.

        Raises:
            RecordError: If a file cannot be written.
        """
        summary = self.summary()
        facts = {
            "kind": RUN,
            "started": self.started.isoformat(),
            "ended": how_it_ended,
            "time_zero_ns": self.epoch_ns,
            "loop": self.log
            and {
                "start_ns": self.log.start_ns,
                "period_ns": self.log.period_ns,
                "planned_cycles": len(self.log.due_ns),
            },
            "notes": self.notes,
            **(self.drives.facts() if self.drives else {}),
            "counters": self.counters,
            "real_time": [step._asdict() for step in self.real_time],
            "summary": summary and summary.as_json(),
            "configuration": self.configuration.as_tables(),
            "sources": {each.key: each.source for each in self.configuration.settings if each.source != DEFAULT},
        }
        channel, *others = channel_names(bus_urls(self.configuration.rig))
        self.bus_log.write(place / BUS_FILE, channel, self.epoch_ns, others)
        if self.log is not None:
            write_table(place / CYCLES_FILE, self.log.columns())
        if self.truth is not None:
            write_table(place / TRUTH_FILE, columns_of(self.truth))
        write_run(place / RUN_FILE, facts)

    def _bus_loads(self, log: LoopLog) -> dict[str, float]:
        """How busy each bus was in the loop's time, by its name in the log."""
        settings = self.configuration.rig
        begin_ns, end_ns = log.start_ns, log.start_ns + log.rows * log.period_ns
        return {
            name: self.bus_log.load(begin_ns, end_ns, settings.bus.bitrate, place)
            for place, name in enumerate(channel_names(bus_urls(settings)))
        }

    def _plant(self) -> str | None:
        """The plant behind the drives: ours in lockstep, elsewhere only what somebody says."""
        setting = next(each for each in self.configuration.settings if each.key == "simulator.plant")
        is_ours = self.configuration.rig.bus.url.partition(":")[0] == LOCKSTEP
        return self.configuration.rig.simulator.plant if is_ours or setting.source != DEFAULT else None

    def _true_rmse_mm(self, log: LoopLog) -> float | None:
        """Position RMSE by the simulator's own state [mm]; None where nobody knows."""
        truth = self.true_positions()
        if truth is None:
            return None
        return 1e3 * rms_norm((log.desired_position[: log.rows] - truth)[motion_rows(log)])
