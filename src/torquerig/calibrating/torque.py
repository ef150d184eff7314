"""`torquerig calibrate torque`: the torque scale, by a locked rotor against a torque transducer."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, cast

from torquerig.axes import axis_settings
from torquerig.bench import open_bench, transducer_settings
from torquerig.building import period_ns
from torquerig.calibrating.keyboard import Keyboard
from torquerig.calibrating.offer import Offer, Option, Request
from torquerig.calibrating.torque_figure import draw
from torquerig.calibration.conductor import SECOND_NS
from torquerig.calibration.procedure import Procedure
from torquerig.calibration.torque import AVERAGE, PER_DIRECTION, Mode, Timing, TorqueProcedure
from torquerig.calibration.torque_fit import LevelReading
from torquerig.calibration.torque_levels import HeldLevels, Schedule, read_levels
from torquerig.calibration.torque_sensors import SensorMaker, TypedSensor, WireSensor
from torquerig.configuration import Configuration
from torquerig.driver.bus.url import LOCKSTEP
from torquerig.errors import ConfigurationError

WIRE: Final = "wire"
MANUAL: Final = "manual"
CSV: Final = "csv"

PATIENCE: Final = 30.0
"""[s] that a level waits for its reading; our choice: a person reads and types five digits in ten."""
LONGEST: Final = 600.0
"""[s] of any of the times; our choice."""

OPTIONS: Final = (
    Option("sensor", str, WIRE, "Who reads torques: wire (a transducer on the bus), manual (you type), csv.", "KIND"),
    Option("readings", Path, None, "For --sensor csv: a file with a level and a reading in N·m a line.", "FILE"),
    Option("mode", str, AVERAGE, "What the driver will use: average of both slopes, or per-direction.", "MODE"),
    Option("low", int, 3500, "Lowest level [counts] of a direction.", "N"),
    Option("high", int, 8000, "Highest level [counts] of a direction.", "N"),
    Option("levels", int, 10, "How many levels from low to high.", "N"),
    Option("settle", float, 0.1, "How long a level is held before it is read [s].", "S"),
    Option("average", float, 0.2, "How long the transducer is averaged at a level [s].", "S"),
    Option("patience", float, PATIENCE, "How long a level is held at most for want of a reading [s].", "S"),
)


def make(configuration: Configuration, request: Request) -> Procedure[Any]:
    """The procedure as configured and asked for."""
    rig = configuration.rig
    options = request.options
    sensor, mode = _sensor(options["sensor"]), _mode(options["mode"])
    is_simulated = rig.bus.url.partition(":")[0] == LOCKSTEP
    if request.axis is None and (sensor == CSV or not is_simulated):
        raise ConfigurationError("calibrate torque needs --axis N here: one transducer sits on the shaft of one axis")
    _require_counts(configuration)
    schedule, timing = _schedule(options), _timing(options, sensor, period_ns(rig) / SECOND_NS)
    source, where = _source(configuration, options, schedule, timing)
    nominal = tuple((axis.counts_per_nm_positive + axis.counts_per_nm_negative) / 2 for axis in rig.axes.legs)
    return TorqueProcedure(request.axes, source, None if sensor == CSV else schedule, timing, nominal, mode, where)


def truth(configuration: Configuration, request: Request) -> Mapping[str, Any]:
    """The gains of the simulated drives, and the friction of the simulated lock."""
    drive, bench = configuration.rig.drive, configuration.rig.bench
    average = (drive.gain_positive + drive.gain_negative) / 2
    scale = {"positive": drive.gain_positive, "negative": drive.gain_negative, "average": average}
    return {"axes": [{"axis": axis, **scale, "friction_nm": bench.friction} for axis in request.axes]}


def _sensor(word: str) -> str:
    if word not in {WIRE, MANUAL, CSV}:
        raise ConfigurationError(f"--sensor {word} is not known: there are {WIRE}, {MANUAL} and {CSV}")
    return word


def _mode(word: str) -> Mode:
    if word not in {AVERAGE, PER_DIRECTION}:
        raise ConfigurationError(f"--mode {word} is not known: there are {AVERAGE} and {PER_DIRECTION}")
    return cast("Mode", word)


def _source(
    configuration: Configuration, options: Mapping[str, Any], schedule: Schedule, timing: Timing
) -> tuple[HeldLevels | None, str]:
    """Who holds the levels, None where they were held elsewhere; and where readings come from, in words."""
    bench, patience = configuration.rig.bench, options["patience"]
    match options["sensor"]:
        case "csv":
            return None, str(_file(options))
        case "manual":
            wait = configuration.rig.bus.url.partition(":")[0] == LOCKSTEP
            maker = _typed(bench.sign, patience, wait=wait)
            return HeldLevels(maker, schedule, settle=timing.settle, patience=patience), "a display that you read"
        case _:
            maker, patience = _wired(configuration, timing), patience + timing.reading
            where = f"the transducer, node {bench.node_id}"
            return HeldLevels(maker, schedule, settle=timing.settle, patience=patience), where


def _schedule(options: Mapping[str, Any]) -> Schedule:
    try:
        return Schedule(options["low"], options["high"], options["levels"])
    except ValueError as error:
        raise ConfigurationError(f"--low, --high, --levels: {error}") from error


def _timing(options: Mapping[str, Any], sensor: str, period: float) -> Timing:
    settle, reading, patience = options["settle"], options["average"], options["patience"]
    if not 0.0 <= settle <= LONGEST:
        raise ConfigurationError(f"--settle {settle:g} cannot be: from 0 to {LONGEST:g} s")
    if not 2.0 * period <= reading <= LONGEST:
        raise ConfigurationError(
            f"--average {reading:g} cannot be: from two periods, {2.0 * period:g} s, to {LONGEST:g} s"
        )
    if not 1.0 <= patience <= LONGEST:
        raise ConfigurationError(f"--patience {patience:g} cannot be: from 1 to {LONGEST:g} s")
    return Timing(settle, patience if sensor == MANUAL else reading)


def _require_counts(configuration: Configuration) -> None:
    for number, axis in enumerate(axis_settings(configuration), start=1):
        if axis.profile.torque.reference != "counts":
            raise ConfigurationError(
                f"axes.{number}.profile = {axis.profile.name!r} takes its torque in per mille of the"
                f" {axis.profile.torque.reference}: there is no scale of counts to calibrate"
            )


def _wired(configuration: Configuration, timing: Timing) -> SensorMaker:
    settings = transducer_settings(configuration.rig)
    samples = round(timing.reading * SECOND_NS / period_ns(configuration.rig))
    return lambda conductor: WireSensor(conductor, settings, samples)


def _typed(sign: int, patience: float, *, wait: bool) -> SensorMaker:
    keyboard = Keyboard(wait=wait)
    return lambda conductor: TypedSensor(conductor, keyboard, patience=patience, sign=sign)


def recorded(configuration: Configuration, request: Request) -> dict[int, list[LevelReading]] | None:
    """The levels of `--readings`, by axis; no bus is needed for them.

    Raises:
        ConfigurationError: The file cannot be read, or a line is no level.
    """
    if request.options["sensor"] != CSV:
        return None
    path, sign = _file(request.options), configuration.rig.bench.sign
    try:
        readings = read_levels(path.read_text(encoding="utf-8").splitlines(), str(path))
    except OSError as error:
        raise ConfigurationError(f"cannot read {path}: {error.strerror}") from error
    except ValueError as error:  # of a line, or of bytes that are no text
        raise ConfigurationError(str(error)) from error
    return {axis: [reading._replace(torque=sign * reading.torque) for reading in readings] for axis in request.axes}


def _file(options: Mapping[str, Any]) -> Path:
    path = options["readings"]
    if not isinstance(path, Path):
        raise ConfigurationError("--sensor csv needs --readings FILE, with a level and a reading in N·m a line")
    return path


OFFER: Final = Offer(make=make, draw=draw, options=OPTIONS, truth=truth, open_rig=open_bench, recorded=recorded)
