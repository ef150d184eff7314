"""Counts to rad and N·m and back: here and nowhere else.

    theta = sign * 2 pi * position / (counts_per_revolution * gear) + zero  [rad at the joint]
    torque = sign * counts / counts_per_nm                                  [N·m at the motor]

A drive may have another torque constant in each direction of *its* positive counts, so the slope is chosen by the sign
of the counts, after the axis' own sign.
"""

import math
from dataclasses import dataclass
from pathlib import Path

from torquerig.driver.errors import EnablingRefused, ProfileError
from torquerig.driver.master.profile import DriveProfile
from torquerig.driver.wire import cob

INT16_MIN = -(1 << 15)
INT16_MAX = (1 << 15) - 1


@dataclass(frozen=True, slots=True)
class AxisSettings:
    """One axis of the machine: which drive, and how its counts relate to the joint.

    Attributes:
        node_id: The drive's node-id, 1 to 127.
        profile: Its make.
        sign: +1 when positive counts turn the joint positively, else -1.
        gear: Motor revolutions a joint revolution.
        home: Joint angle in the home fixture [rad].
        zero: What is added to the joint angle that the counts tell [rad]; from a calibration.
        counts_per_revolution: Counts of 6064 a motor revolution; None: the profile's.
        counts_per_nm_positive: Counts of torque a newton metre, for positive counts; None: the profile's, or worked out
            from the drive's rated value.
        counts_per_nm_negative: The same for negative counts.
        torque_constant: [N·m/A], needed where torque is told in per mille of the rated current.
        eds: EDS of this drive, instead of the profile's.
    """

    node_id: int
    profile: DriveProfile
    sign: int = 1
    gear: float = 25.0
    home: float = 0.0
    zero: float = 0.0
    counts_per_revolution: int | None = None
    counts_per_nm_positive: float | None = None
    counts_per_nm_negative: float | None = None
    torque_constant: float | None = None
    eds: Path | None = None

    def __post_init__(self) -> None:
        cob.check_node_id(self.node_id)
        if self.sign not in {-1, 1}:
            raise ValueError(f"the sign of an axis is +1 or -1, not {self.sign}")
        for name in ("gear", "counts_per_revolution", "counts_per_nm_positive", "counts_per_nm_negative"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} of drive {self.node_id} is to be positive, not {value}")
        for name in ("home", "zero"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"{name} of drive {self.node_id} is to be an angle [rad], not {getattr(self, name)}")

    @property
    def eds_path(self) -> Path:
        """The EDS that describes this drive.

        Raises:
            ProfileError: Neither the settings nor the profile name one.
        """
        path = self.eds or self.profile.eds
        if path is None:
            raise ProfileError(f"drive {self.node_id}: the profile {self.profile.name} has no EDS; give its path")
        return path


@dataclass(frozen=True, slots=True)
class AxisScale:
    """The factors of one axis, worked out.

    Attributes:
        rad_per_count: Joint angle a count of position, signed [rad].
        sign: Of the axis.
        positive: Counts of torque a newton metre for positive counts.
        negative: The same for negative counts.
        limits: Counts that the torque object can hold, least and greatest.
        zero: Joint angle at position 0 [rad].
    """

    rad_per_count: float
    sign: int
    positive: float
    negative: float
    limits: tuple[int, int] = (INT16_MIN, INT16_MAX)
    zero: float = 0.0

    def angle(self, position: int) -> float:
        """Joint angle [rad] of a position [count]."""
        return position * self.rad_per_count + self.zero

    def position(self, angle: float) -> int:
        """Position [count] nearest to a joint angle [rad]."""
        return round((angle - self.zero) / self.rad_per_count)

    def torque(self, counts: float) -> float:
        """Torque [N·m at the motor] of counts."""
        return self.sign * counts / (self.positive if counts >= 0 else self.negative)

    def torque_counts(self, torque: float) -> int:
        """Counts nearest to a torque [N·m at the motor], held within what the object can carry.

        Raises:
            ValueError: The torque is not a number.
        """
        directed = self.sign * torque
        if directed != directed:  # noqa: PLR0124 - only NaN differs from itself, and math.isnan costs a call a cycle
            raise ValueError(f"{torque} is no torque")
        exact = directed * (self.positive if directed >= 0 else self.negative)
        low, high = self.limits
        return low if exact <= low else high if exact >= high else round(exact)


def axis_scale(settings: AxisSettings, rated: int | None) -> AxisScale:
    """The factors of an axis.

    Args:
        settings: The axis.
        rated: What the drive's `rated_object` holds [count]; None where the profile names none.

    Raises:
        ProfileError: Something is told by neither settings nor profile.
        EnablingRefused: The drive's rated value is 0, so that per mille of it mean nothing.
    """
    profile = settings.profile
    counts = settings.counts_per_revolution or profile.counts_per_revolution
    if counts is None:
        raise ProfileError(f"drive {settings.node_id}: neither settings nor profile say counts_per_revolution")
    default = _counts_per_nm(settings, rated)
    return AxisScale(
        rad_per_count=settings.sign * 2 * math.pi / (counts * settings.gear),
        sign=settings.sign,
        positive=settings.counts_per_nm_positive or default,
        negative=settings.counts_per_nm_negative or default,
        zero=settings.zero,
    )


def _counts_per_nm(settings: AxisSettings, rated: int | None) -> float:
    torque = settings.profile.torque
    if torque.reference == "counts":
        if torque.counts_per_nm is None:
            raise ProfileError(f"drive {settings.node_id}: the profile {settings.profile.name} has no counts_per_nm")
        return torque.counts_per_nm
    if not rated or torque.rated_unit is None:
        raise EnablingRefused(
            f"drive {settings.node_id}: its {torque.reference} ({torque.rated_object}) is 0, so that per mille of it"
            " mean nothing: set torque.rated_value in its profile"
        )
    full_scale = rated * torque.rated_unit
    if torque.reference == "rated current":
        if settings.torque_constant is None:
            raise ProfileError(f"drive {settings.node_id}: per mille of the rated current need a torque_constant")
        full_scale *= settings.torque_constant
    return 1000 / full_scale
