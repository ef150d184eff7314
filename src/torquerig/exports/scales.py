"""What the raw numbers of a drive's objects stand for on the axis that it drives."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import canopen

from torquerig.driver.master.profile import DEFAULT_PROFILE, POSITION, ObjectAddress
from torquerig.driver.master.scale import AxisSettings, axis_scale
from torquerig.driver.wire.dictionary import find_variable
from torquerig.exports.objects import Scale

_VELOCITY: Final = (0x606C, 0)
_OF_RATED_TORQUE: Final = Scale(0.1, "%", "of the rated torque 6076")

# CiA 402 fixes these; positions and velocities it leaves to the drive
_STANDARD: Final = MappingProxyType(
    {
        **{(index, 0): _OF_RATED_TORQUE for index in (0x6071, 0x6072, 0x6074, 0x6077, 0x60B2, 0x60E0, 0x60E1)},
        (0x6078, 0): Scale(0.1, "%", "of the rated current 6075"),
        (0x6079, 0): Scale(0.001, "V"),
    }
)
# the manufacturer's objects of our own drive, as the comments of its EDS have them
_OURS: Final = MappingProxyType(
    {
        (0x2100, 1): Scale(0.1, "degC"),
        (0x2100, 2): Scale(0.1, "degC"),
        (0x2100, 3): Scale(1, "%", "of the trip level"),
        (0x2100, 4): Scale(1, "us", "from SYNC until the torque took effect"),
        (0x2130, 0): Scale(1, "us", "since power-on"),
    }
)


def scales_of(settings: AxisSettings, dictionary: canopen.ObjectDictionary) -> Mapping[tuple[int, int], Scale]:
    """The scales of a drive's objects: rad of the joint and N·m of the motor where the axis tells them.

    A torque with another slope in each direction has no single factor: it stays in counts, and both slopes are told.
    One in per mille of something that neither profile nor EDS tell stays in per cent of it.

    Args:
        settings: The drive and its axis.
        dictionary: Its object dictionary.

    Returns:
        Scales by address.

    Raises:
        ProfileError: Neither settings nor profile say what a count is.
    """
    profile = settings.profile
    rated = _rated(settings, dictionary)
    axis = axis_scale(settings, rated or 1)
    scales: dict[tuple[int, int], Scale] = dict(_STANDARD)
    if profile.name == DEFAULT_PROFILE:
        scales |= _OURS
    scales[POSITION] = Scale(axis.rad_per_count, "rad", "of the joint")
    if profile.velocity_unit == "counts/s":
        scales[_VELOCITY] = Scale(axis.rad_per_count, "rad/s", "of the joint")
    elif profile.velocity_unit == "rpm":
        scales[_VELOCITY] = Scale(1, "rpm")
    if rated is None and profile.torque.reference != "counts":
        return scales
    for address in (profile.torque.target, profile.torque.actual):
        if axis.positive == axis.negative:
            scales[address] = Scale(axis.sign / axis.positive, "Nm", "at the motor")
        else:
            note = f"sign of the axis {axis.sign:+d}; counts/Nm: {axis.positive!r} above 0, {axis.negative!r} below"
            scales[address] = Scale(1, "counts", note)
    return scales


def _rated(settings: AxisSettings, dictionary: canopen.ObjectDictionary) -> int | None:
    """What the drive's rated object will hold; None where nobody says so offline."""
    torque = settings.profile.torque
    if torque.rated_value is not None or torque.rated_object is None:
        return torque.rated_value
    variable = find_variable(dictionary, *ObjectAddress(*torque.rated_object))
    return variable.default or None if variable is not None else None
