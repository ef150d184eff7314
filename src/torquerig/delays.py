"""What passes between a sample and the torque that follows it, by what `torquerig calibrate latency` found."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.axes import profile_of
from torquerig.building import pace, period_ns
from torquerig.control.compensation import Compensation
from torquerig.control.laws import law_named
from torquerig.driver.wire import cob
from torquerig.driver.wire.frame import worst_case_bits
from torquerig.driver.wire.pdo import EVENT_PROFILE
from torquerig.schema import Rig

NS_PER_S: Final = 1_000_000_000
RPDO: Final = 4
"""Bytes of a drive's RPDO1: controlword and raw torque; the group RPDO has 6, a third of them each."""
GROUP_RPDO: Final = 6


def places_on_the_wire(rig: Rig) -> tuple[int, ...]:
    """How many RPDOs of other drives go over its bus before that of each axis: the lowest identifier first.

    That is both how CAN arbitrates and how the driver sends them.

    Args:
        rig: The configuration, of a loop without a group RPDO.

    Returns:
        A place for each axis, from 0.

    Raises:
        ProfileError: A drive's profile cannot be used.
    """
    commands = [
        (axis.bus or rig.bus.url, cob.RPDO[profile_of(axis).rpdo.number] + axis.node_id) for axis in rig.axes.legs
    ]
    return tuple(sum(other[0] == own[0] and other[1] < own[1] for other in commands) for own in commands)


def action_delay(rig: Rig, lag: float) -> NDArray[np.float64]:
    """What passes from sample to torque beyond the time from SYNC's to the RPDOs' handing over.

    Encoders are latched at the end of SYNC. The RPDOs follow each other on the bus; then a drive takes
    latency.reaction, and its current loop the lag.

    Args:
        rig: The configuration.
        lag: The current loop's [s].

    Returns:
        Of each axis, shape (3,) [s].
    """
    size = GROUP_RPDO if rig.loop.group_rpdo else RPDO
    frame = worst_case_bits(size) / rig.bus.bitrate
    queue = frame * (np.zeros(3) if rig.loop.group_rpdo else np.array(places_on_the_wire(rig), dtype=np.float64))
    delay: NDArray[np.float64] = queue + (frame + rig.latency.reaction + lag - worst_case_bits(0) / rig.bus.bitrate)
    return delay


def lead(rig: Rig) -> float:
    """How long after its sample a torque begins to act, in the axes' mean [s].

    What the law itself takes is in it only where `loop.command_after` says it; drives that act at the next SYNC
    (`loop.rpdo_type` = 1) wait for it. Half of the period for which a torque holds is not in it: it makes tracking
    worse, because joint rates by backward differences are half a period old (docs/calibration.md).
    """
    if rig.loop.rpdo_type != EVENT_PROFILE:
        return period_ns(rig) / NS_PER_S + rig.latency.reaction + rig.latency.current_lag
    sent = (pace(rig).command_after_ns or 0) / NS_PER_S
    return sent + float(np.mean(action_delay(rig, rig.latency.current_lag)))


def compensation(rig: Rig) -> Compensation:
    """What `loop.delay_compensation` and `loop.coulomb_feedforward` ask for.

    Coulomb friction is fed forward where viscous friction is, as `loop.friction_feedforward` says.
    """
    chosen, wanted = law_named(rig.loop.law), rig.loop.friction_feedforward
    has_friction = chosen.friction_by_default if wanted == "law" else wanted
    feeds = rig.loop.coulomb_feedforward and has_friction
    return Compensation(
        lead=lead(rig) if rig.loop.delay_compensation else 0.0,
        coulomb=rig.model.active_coulomb / rig.model.gear_ratio if feeds else 0.0,
    )
