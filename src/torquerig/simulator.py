"""The simulated drives as a process of their own, in real time on any bus between processes."""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Final, NamedTuple

from torquerig.assembly import Build, Simulation, build_simulation, nanoseconds
from torquerig.building import period_ns
from torquerig.buses import bus_urls, channel_names, homes_of
from torquerig.configuration import Configuration
from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.plant import TruthLog
from torquerig.driver.bus.interface import Bus, Tap
from torquerig.driver.bus.merged import WaitForAny
from torquerig.driver.bus.patient import PatientBus
from torquerig.driver.bus.url import LOCKSTEP, open_bus
from torquerig.driver.wire import cob
from torquerig.errors import ConfigurationError
from torquerig.garbage import frozen_heap
from torquerig.realtime import RealTimeDevices
from torquerig.realtime_several import PlacedBuses, SeveralRealTimeDevices
from torquerig.realtime_steady import joined_to
from torquerig.record import BUS_FILE, RUN_FILE, SIM, TRUTH_FILE, BusLog, claim, write_run, write_table
from torquerig.rejoining import RETRY_NS, RejoiningBus
from torquerig.scheduling import Processor, real_time
from torquerig.schema import Rig
from torquerig.several_buses import PatientTaps, devices_by_bus, waitable_ones
from torquerig.stopping import undisturbed
from torquerig.truth import columns_of

_log = logging.getLogger(__name__)

FOREVER_NS: Final = 1 << 62
SPIN_NS: Final = 0  # a simulator that spins would take the processor from the controller it waits for
_WITHIN_ONE_PROCESS: Final = {
    LOCKSTEP: "no other process can join simulated time",
    "virtual": "python-can's virtual bus ends where the process does",
}


class RunningDrives(NamedTuple):
    """Simulated drives in real time.

    Attributes:
        simulation: The machine and the drives.
        devices: The drives as members of the bus.
        scheduling: How this process is scheduled, in words.
    """

    simulation: Simulation
    devices: RealTimeDevices
    scheduling: str


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

    def write(self, *, origin_ns: int, lost: int, stood_still_ns: int = 0) -> None:
        """Write it.

        Args:
            origin_ns: What the drives' time 0 is on the bus clock.
            lost: How many of the drives' frames the bus did not take.
            stood_still_ns: For how long the drives' time stood still, see `bus.patience`.

        Raises:
            RecordError: If a file cannot be written.
        """
        facts = {
            "kind": SIM,
            "started": self.started.isoformat(),
            "time_zero_ns": origin_ns + self.epoch_ns,
            "lost_frames": lost,
            "stood_still_ns": stood_still_ns,
            "configuration": self.configuration.as_tables(),
        }
        channel, *others = channel_names(bus_urls(self.configuration.rig))
        self.bus_log.write(self.place / BUS_FILE, channel, self.epoch_ns, others)
        write_table(self.place / TRUTH_FILE, columns_of(self.truth.rows()))
        write_run(self.place / RUN_FILE, facts)


def simulate(
    configuration: Configuration,
    *,
    record: Path | None,
    ready: Callable[[str], None],
    tell: Callable[[str], None],
    build: Build = build_simulation,
) -> None:
    """Be the simulated drives until something is raised by a signal. When the bus goes, they live on and wait for it.

    Args:
        configuration: What to simulate, and on which bus, which must not be `lockstep:`.
        record: A new or empty folder for the record.
        ready: Called once the drives are on the bus, with how the process is scheduled.
        tell: Called with a sentence when the bus goes, and when it is back.
        build: Builds what is simulated.

    Raises:
        ConfigurationError: Other processes cannot join this bus.
        RecordError: The record's folder cannot be used, or the record not be written.
        BusUrlError, BusError: The bus cannot be used.
    """
    with running_drives(configuration, record=record, tell=tell, build=build) as running:
        ready(running.scheduling)
        running.devices.serve(FOREVER_NS)


@contextmanager
def running_drives(
    configuration: Configuration,
    *,
    record: Path | None,
    keep_truth: bool = False,
    tell: Callable[[str], None] = _log.warning,
    build: Build = build_simulation,
) -> Iterator[RunningDrives]:
    """Put simulated drives on a bus, and at the end take them off it and write their record.

    Args:
        configuration: What to simulate, and on which bus.
        record: A new or empty folder for the record.
        keep_truth: Whether the machine keeps its log also when there is no record.
        tell: As for `simulate`.
        build: Builds what is simulated.

    Yields:
        The drives, about to be switched on: nothing happens but in `devices.serve`.

    Raises:
        ConfigurationError: Other processes cannot join this bus.
        RecordError: The record's folder cannot be used, or the record not be written.
        BusUrlError, BusError: The bus cannot be used.
    """
    settings = configuration.rig
    if why := _WITHIN_ONE_PROCESS.get(settings.bus.url.partition(":")[0]):
        raise ConfigurationError(
            f"bus.url = {settings.bus.url!r} cannot be for drives in a process of their own: {why}; take unix:FOLDER"
        )
    keep = None if record is None else begin_record(configuration, record)
    truth = keep.truth if keep else truth_log(configuration) if keep_truth else None
    simulation = build(configuration.simulated, truth)
    log = keep.bus_log if keep else None
    if len(bus_urls(settings)) == 1:
        bus = join(settings, log.tap if log else None, tell)
        devices = joined_to(bus, simulation.devices)
    else:
        bus, devices = _join_several(settings, simulation.devices, log, tell)
    if keep:
        keep.epoch_ns = time.time_ns() - bus.now_ns()
    try:
        with frozen_heap(), real_time(settings.simulator.fifo_priority, Processor.FIRST) as scheduling:
            yield RunningDrives(simulation, devices, str(scheduling))
    finally:
        with undisturbed():
            bus.close()
            if keep:
                stood_still_ns = bus.stood_still_ns if isinstance(bus, PatientBus) else 0
                keep.write(origin_ns=devices.origin_ns, lost=devices.lost, stood_still_ns=stood_still_ns)


def join(settings: Rig, tap: Tap | None, tell: Callable[[str], None]) -> Bus:
    """Join the bus of `bus.url`, to join it again whenever it is lost, with `bus.patience` for the next SYNC.

    Raises:
        BusUrlError, BusError: The bus cannot be used.
    """
    bus = settings.bus
    inner_tap = None if bus.patience else tap
    joined = RejoiningBus(lambda: open_bus(bus.url, bitrate=bus.bitrate, tap=inner_tap, spin_ns=SPIN_NS), tell)
    return _patient(joined, settings, tap) if bus.patience else joined


def _patient(bus: Bus, settings: Rig, tap: Tap | None = None) -> PatientBus:
    """A bus with patience for the next SYNC."""
    awaited, patience_ns = frozenset({cob.SYNC}), nanoseconds(settings.bus.patience)
    return PatientBus(bus, awaited, within_ns=period_ns(settings), patience_ns=patience_ns, tap=tap)


def _join_several(
    settings: Rig, devices: SimulatedDevices, log: BusLog | None, tell: Callable[[str], None]
) -> tuple[Bus, RealTimeDevices]:
    """Join the buses of a rig that has several; as one bus, for its clock and its end, and the devices on them.

    Raises:
        BusUrlError, BusError: A bus cannot be used.
    """
    urls, bitrate = bus_urls(settings), settings.bus.bitrate
    taps = PatientTaps(lambda place: log.tap_of(place) if log else None)

    def joined(place: int, url: str) -> RejoiningBus:
        tap = taps.of(place)
        return RejoiningBus(lambda: open_bus(url, bitrate=bitrate, tap=tap, spin_ns=SPIN_NS), tell, rest_ns=RETRY_NS)

    with ExitStack() as stack:
        members = [stack.enter_context(closing(joined(place, url))) for place, url in enumerate(urls)]
        wait = WaitForAny(waitable_ones(members, urls), members[0].now_ns, spin_ns=SPIN_NS)
        stack.pop_all()
    placed = PlacedBuses(members, wait)
    bus = taps.bus = _patient(placed, settings) if settings.bus.patience else None
    groups = devices_by_bus(devices, homes_of(settings), len(urls))
    return bus or placed, SeveralRealTimeDevices(bus or placed, placed, groups)


def begin_record(configuration: Configuration, place: Path) -> SimulatorRecord:
    """A record that is empty yet, its folder claimed.

    Raises:
        RecordError: The folder cannot be used.
    """
    return SimulatorRecord(claim(place), configuration, truth_log(configuration))


def truth_log(configuration: Configuration) -> TruthLog:
    """A log of what the machine does, with a row every `simulator.record_period`."""
    return TruthLog(grid_ns=nanoseconds(configuration.rig.simulator.record_period))
