"""From the configuration's tables to what the driver needs to know of its drives."""

from pathlib import Path
from typing import Final

from torquerig.building import manipulator, period_ns
from torquerig.configuration import DEFAULT, Configuration
from torquerig.driver.master.profile import DEFAULT_PROFILE, DriveProfile, load_profile
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.master.settings import GroupSettings
from torquerig.schema import Axis, Rig

_SCALES: Final = ("counts_per_nm_positive", "counts_per_nm_negative", "encoder_counts")
"""Keys whose defaults belong to the default drive; another profile has its own."""


def axis_settings(configuration: Configuration) -> tuple[AxisSettings, ...]:
    """The three drives in the order of the legs.

    Args:
        configuration: The configuration.

    Returns:
        Their settings, with the joint angles that the fixture holds as home.

    Raises:
        ProfileError: A profile cannot be used.
        ReachError: A leg cannot reach the fixture.
    """
    model = configuration.rig.model
    home = manipulator(model, model).inverse_kinematics(model.home).theta
    given = {setting.key for setting in configuration.settings if setting.source != DEFAULT}
    return tuple(
        _axis(axis, float(angle), {name for name in _SCALES if f"axes.{leg}.{name}" in given})
        for leg, (axis, angle) in enumerate(zip(configuration.rig.axes.legs, home, strict=True), start=1)
    )


def profile_of(axis: Axis) -> DriveProfile:
    """The profile of a drive, with the drive's own EDS if it has one."""
    return load_profile(axis.profile, eds=Path(axis.eds) if axis.eds else None)


def group_settings(rig: Rig) -> GroupSettings:
    """What holds for all drives: the cycle, watchdogs and heartbeats."""
    return GroupSettings(
        period_ns=period_ns(rig),
        rpdo_type=rig.loop.rpdo_type,
        group_rpdo=rig.loop.group_rpdo,
        watchdog_periods=rig.master.watchdog_periods,
        master_id=rig.master.node_id,
        heartbeat_ms=_milliseconds(rig.master.heartbeat),
        heartbeat_limit_ms=_milliseconds(rig.master.heartbeat_limit),
        listening_ms=_milliseconds(rig.master.listening),
        settling_ms=_milliseconds(rig.master.settling),
    )


def _axis(axis: Axis, home: float, given: set[str]) -> AxisSettings:
    """One drive; what is not given for a drive of another profile is left to that profile."""
    ours = given | (set(_SCALES) if axis.profile == DEFAULT_PROFILE else set())
    return AxisSettings(
        node_id=axis.node_id,
        profile=profile_of(axis),
        sign=axis.sign,
        gear=axis.gear,
        home=home + axis.encoder_zero,  # so that the drives are homed to the same counts, whatever the zeros are
        zero=axis.encoder_zero,
        counts_per_revolution=axis.encoder_counts if "encoder_counts" in ours else None,
        counts_per_nm_positive=axis.counts_per_nm_positive if "counts_per_nm_positive" in ours else None,
        counts_per_nm_negative=axis.counts_per_nm_negative if "counts_per_nm_negative" in ours else None,
        torque_constant=axis.torque_constant,
    )


def _milliseconds(seconds: float) -> int:
    """Seconds as whole milliseconds."""
    return round(1e3 * seconds)
