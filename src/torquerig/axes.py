"""From the configuration's tables to what the driver needs to know of its drives."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from torquerig.building import manipulator, period_ns
from torquerig.buses import homes_of
from torquerig.configuration import DEFAULT, Configuration
from torquerig.driver.master.objects import DriveObjects
from torquerig.driver.master.profile import DEFAULT_PROFILE, DriveProfile, load_profile
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.master.settings import GroupSettings
from torquerig.driver.wire.dictionary import load_dictionary
from torquerig.errors import ConfigurationError
from torquerig.schema import Axis, Rig

_SCALES: Final = ("counts_per_nm_positive", "counts_per_nm_negative", "encoder_counts")
"""Keys whose defaults belong to the default drive; another profile has its own."""
_EMERGENCY_CONSUMER: Final = 0x1028  # CiA 301, 7.5.2.26


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


def refuse_unheard(axes: Sequence[AxisSettings]) -> None:
    """See, before a bus is opened, that each drive can hear the emergencies of the others.

    Args:
        axes: The drives in the order of the legs.

    Raises:
        ConfigurationError: A drive has no room for another's in object 1028, whose sub-index is the node-id.
        EdsError, ProfileError: A drive's description cannot be used.
    """
    for leg, axis in enumerate(axes, start=1):
        if not axis.profile.watchdogs.emergency:
            continue
        dictionary = load_dictionary(axis.eds_path, axes[0].node_id)  # as the driver reads it: once a kind
        room = DriveObjects(axis.node_id, axis.eds_path, dictionary).subindices(_EMERGENCY_CONSUMER)
        for other, sibling in enumerate(axes, start=1):
            if other != leg and sibling.node_id not in room:
                raise ConfigurationError(
                    f"axes.{other}.node_id = {sibling.node_id} cannot be: the drive of axis {leg} hears emergencies of"
                    f" node-ids 1 to {max(room, default=0)} only (object 1028 of its EDS)"
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
        bit_rate=rig.bus.bitrate,
        most_on_a_bus=max(Counter(homes_of(rig).values()).values()),
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
