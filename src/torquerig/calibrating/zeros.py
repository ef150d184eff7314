"""What the application adds to the procedure for encoder zeros."""

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from torquerig import building
from torquerig.calibrating.drives import gearing
from torquerig.calibrating.identify import task_controller
from torquerig.calibrating.offer import Offer, Option, Request
from torquerig.calibrating.zeros_figure import draw
from torquerig.calibration.driving import prepare
from torquerig.calibration.encoder_zeros import Driven, Recorded, ZerosProcedure
from torquerig.calibration.excitation import FourierMotion
from torquerig.configuration import Configuration
from torquerig.errors import ConfigurationError
from torquerig.experiment import rehearse
from torquerig.provenance import Drives
from torquerig.records import open_record
from torquerig.schema import Rig

LEGS: Final = 3
HARMONICS: Final = ((3, 8), (8, 13))
"""Of 1 / duration, of the figure's x and of its y: without a common factor, so that no part of it comes twice. Samples
that come again bring the same rounding again: of four times the same way the intervals held only 72 % of the truths."""
PEAKS: Final = (1.3610, 1.6109)
"""Greatest values of sin k u - k / m sin m u with these."""


def make(configuration: Configuration, request: Request) -> ZerosProcedure:
    """The procedure for a rig.

    Raises:
        ConfigurationError: An option is out of range, or two do not go together.
        RecordError: The record cannot be read.
    """
    rig, options = configuration.rig, request.options
    _require(rig, request)
    extent, seconds, torque, tolerance = (options[name] for name in ("extent", "seconds", "torque", "tolerance"))
    controller = task_controller(rig, torque)
    driven = None
    if options["record"] is None and not options["by_hand"]:
        motion = figure(rig.model.home, extent / 1e3, seconds)
        driven = Driven(motion, prepare(controller, motion, building.period_ns(rig)))
        rehearse(controller, driven.table)
    recorded_on = rig if options["record"] is None else open_record(options["record"]).rig()
    return ZerosProcedure(
        controller,
        driven,
        seconds,
        torque,
        building.sampling(rig).resolution,
        _zeros(recorded_on),
        recorded_on.model.home,
        gearing(recorded_on),
        tolerance / 1e3 if options["geometry"] else None,
        None if options["record"] is None else f"the record {options['record']}",
    )


def _require(rig: Rig, request: Request) -> None:
    """See that the options are in range and go together.

    Raises:
        ConfigurationError: One is not, or two do not.
    """
    options = request.options
    if request.axis is not None:
        raise ConfigurationError("--axis cannot be: the zeros of all axes follow together from the legs' closing")
    extent, seconds, torque, tolerance = (options[name] for name in ("extent", "seconds", "torque", "tolerance"))
    if not 0.1 <= extent <= 30:
        raise ConfigurationError(f"--extent {extent:g} mm cannot be: 0.1 to 30")
    if not 1 <= seconds <= 600:
        raise ConfigurationError(f"--seconds {seconds:g} cannot be: 1 to 600")
    if not 0 < torque <= rig.limits.torque:
        raise ConfigurationError(
            f"--torque {torque:g} N·m cannot be: above 0 and at most limits.torque = {rig.limits.torque:g}"
        )
    if not 0 < tolerance <= 5:
        raise ConfigurationError(f"--tolerance {tolerance:g} mm cannot be: above 0 and at most 5")
    if options["record"] is not None and options["by_hand"]:
        raise ConfigurationError("--record and --by-hand cannot be together: a record has been moved already")


def figure(home: tuple[float, float], extent: float, seconds: float) -> FourierMotion:
    """A slow figure about home that turns the closure's direction as much as its extent allows, from rest to rest."""
    sines = []
    for (slow, fast), peak in zip(HARMONICS, PEAKS, strict=True):
        sizes = {slow: extent / peak, fast: -slow / fast * extent / peak}  # their velocities at the ends cancel
        sines.append(tuple(sizes.get(harmonic, 0.0) for harmonic in range(1, HARMONICS[-1][-1] + 1)))
    still = (0.0,) * HARMONICS[-1][-1]
    return FourierMotion(home, seconds, 1, (sines[0], sines[1]), (still, still))


def recorded(_configuration: Configuration, request: Request) -> Recorded | None:
    """The joint angles of the record that was asked for.

    Raises:
        RecordError: It cannot be read, or has no cycles.
    """
    place = request.options["record"]
    if place is None:
        return None
    log = open_record(place).cycles()
    whole = log.complete[: log.rows] & ~log.skipped[: log.rows]
    return Recorded(log.period_ns * 1e-9, np.where(whole[:, None], log.q[: log.rows], np.nan))


def drives(_configuration: Configuration, request: Request) -> Drives | None:
    """The drives of the record that was asked for."""
    return open_record(request.options["record"]).drives


def truth(configuration: Configuration, request: Request) -> Mapping[str, Any]:
    """What the simulated encoders would have to have added, half a count for their rounding down included."""
    rig = configuration.rig
    if request.options["record"] is not None:
        return {}
    model, true = (building.manipulator(each.model, each.model) for each in (rig, configuration.simulated))
    told = model.inverse_kinematics(rig.model.home).theta
    stands = true.inverse_kinematics(rig.simulator.stands_at or rig.model.home).theta
    return {"zeros_deg": [_missing(*each) for each in zip(told, stands, rig.axes.legs, strict=True)]}


def _missing(told: float, stands: float, axis: Any) -> float:  # noqa: ANN401  (an axis' table)
    """True joint angle less what the homed encoder tells, in the mean over the angles of a count [deg]."""
    count = axis.sign * math.tau / (axis.encoder_counts * axis.gear)
    edge = math.floor(axis.sign * stands / abs(count))
    return math.degrees((edge + 0.5 - round(told / count)) * count)


def _zeros(rig: Rig) -> tuple[float, float, float]:
    a, b, c = (axis.encoder_zero for axis in rig.axes.legs)
    return a, b, c


OFFER: Final = Offer(
    make=make,
    draw=draw,
    truth=truth,
    recorded=recorded,
    drives=drives,
    options=(
        Option("record", str, None, "Evaluate this record's motion; nothing moves.", "DIR"),
        Option("by-hand", bool, default=False, help="Record while a person moves the machine; drives at zero torque."),
        Option("extent", float, 10.0, "Of the driven figure about home, both ways [mm].", "MM"),
        Option("seconds", float, 20.0, "How long the motion lasts [s].", "S"),
        Option("torque", float, 0.45, "To which motor torques are cut [N·m at the motor].", "NM"),
        Option("geometry", bool, default=False, help="Seek link lengths and base points too; they are reported only."),
        Option("tolerance", float, 0.05, "Standard deviation of lengths and points from the drawing [mm].", "MM"),
    ),
)
