"""The simulated drives as a process of their own, in real time on any bus between processes."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from torquerig.assembly import build_simulation, nanoseconds
from torquerig.configuration import Configuration
from torquerig.device_sim.plant import TruthLog
from torquerig.driver.bus.url import LOCKSTEP, open_bus
from torquerig.errors import ConfigurationError
from torquerig.garbage import frozen_heap
from torquerig.realtime import RealTimeDevices
from torquerig.record import BUS_FILE, RUN_FILE, TRUTH_FILE, BusLog, channel_name, claim, write_run, write_table
from torquerig.scheduling import real_time
from torquerig.stopping import undisturbed
from torquerig.truth import columns_of

FOREVER_NS: Final = 1 << 62
SPIN_NS: Final = 0  # a simulator that spins would take the processor from the controller it waits for


@dataclass(slots=True)
class SimulatorRecord:
    """What the simulator keeps for its record.

    Attributes:
        place: The record's folder.
        configuration: What is simulated.
        truth: What the machine really did.
        bus_log: Every frame.
        epoch_ns: What the bus clock's zero is since 1970.
        started: When it began.
    """

    place: Path
    configuration: Configuration
    truth: TruthLog
    bus_log: BusLog = field(default_factory=BusLog)
    epoch_ns: int = 0
    started: datetime = field(default_factory=lambda: datetime.now(UTC))

    def write(self, devices: RealTimeDevices) -> None:
        """Write it.

        Args:
            devices: What was simulated.
        """
        facts = {
            "started": self.started.isoformat(),
            "time_zero_ns": devices.origin_ns + self.epoch_ns,
            "lost_frames": devices.lost,
            "configuration": self.configuration.as_tables(),
        }
        write_run(self.place / RUN_FILE, facts)
        self.bus_log.write(self.place / BUS_FILE, channel_name(self.configuration.rig.bus.url), self.epoch_ns)
        write_table(self.place / TRUTH_FILE, columns_of(self.truth.rows()))


def simulate(configuration: Configuration, *, record: Path | None, ready: Callable[[str], None]) -> None:
    """Be the simulated drives until something is raised: by a signal, or by the bus.

    Args:
        configuration: What to simulate, and on which bus, which must not be `lockstep:`.
        record: A new or empty folder for the record.
        ready: Called once the drives are on the bus, with how the process is scheduled.

    Raises:
        ConfigurationError: Other processes cannot join this bus.
        RecordError: The record's folder cannot be used.
        BusUrlError, BusError: The bus cannot be used, or is gone.
    """
    settings = configuration.rig
    if settings.bus.url.partition(":")[0] == LOCKSTEP:
        raise ConfigurationError(
            f"bus.url = {settings.bus.url!r} cannot be for `sim`: no other process can join simulated time;"
            " take unix:FOLDER"
        )
    keep = None if record is None else _begin_record(configuration, record)
    simulation = build_simulation(settings, keep.truth if keep else None)
    bus = open_bus(
        settings.bus.url, bitrate=settings.bus.bitrate, tap=keep.bus_log.tap if keep else None, spin_ns=SPIN_NS
    )
    if keep:
        keep.epoch_ns = time.time_ns() - bus.now_ns()
    devices = RealTimeDevices(bus, simulation.devices)
    try:
        with frozen_heap(), real_time(settings.simulator.fifo_priority) as scheduling:
            ready(scheduling)
            devices.serve(FOREVER_NS)
    finally:
        with undisturbed():
            bus.close()
            if keep:
                keep.write(devices)


def _begin_record(configuration: Configuration, place: Path) -> SimulatorRecord:
    """A record that is empty yet, its folder claimed."""
    grid_ns = nanoseconds(configuration.rig.simulator.record_period)
    return SimulatorRecord(claim(place), configuration, TruthLog(grid_ns=grid_ns))
