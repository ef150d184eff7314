"""What drives in steady operation do with RPDOs and their targets, compiled; see `steady_kernels`."""

import math
from typing import Any

from torquerig.device_sim.drive.steady_memory import (
    ADVANCE,
    DONE,
    LATENCY_MAXIMUM,
    LEAVE,
    NEVER_NS,
    NS_PER_S,
    TRIP_LOAD,
    US,
    WAITING,
)
from torquerig.mechanism.compiled import compiled


@compiled
def signed_number(data: Any, at: int) -> int:  # noqa: ANN401
    """16 bits with a sign in the data of a frame."""
    value = int(data[at]) | int(data[at + 1]) << 8
    return value - 0x1_0000 if value & 0x8000 else value


@compiled
def aim(drive: Any, effects: Any, at_ns: int) -> None:  # noqa: ANN401
    """Let the target that the objects ask for now take effect a reaction time later."""
    path, node = drive.path, drive.node
    target = path.raw + path.offset * path.counts_per_permille
    if path.by_permille:
        target = (path.permille + path.offset) * path.counts_per_permille
    effects[node.waiting].at_ns = at_ns + node.reaction_ns
    effects[node.waiting].target = target
    node.waiting += 1


@compiled
def concerns(drive: Any, rpdo: Any, entry: Any) -> int:  # noqa: ANN401
    """Whether a frame is an RPDO, 1, or not, 0; -1 if it is one that is not regular."""
    if rpdo.can_id != entry.can_id:
        return 0
    if rpdo.size != entry.length or drive.node.waiting == WAITING:
        return -1
    at = rpdo.control_at
    if at >= 0 and int(entry.data[at]) | int(entry.data[at + 1]) << 8 != drive.clock.controlword:
        return -1
    return 1


@compiled
def hear(drive: Any, rpdo: Any, effects: Any, entry: Any, at_ns: int) -> None:  # noqa: ANN401
    """Take an RPDO."""
    rpdo.received += 1
    if rpdo.event_ns:
        rpdo.deadline_ns = at_ns + rpdo.event_ns
    if rpdo.raw_at >= 0:
        drive.path.raw = signed_number(entry.data, rpdo.raw_at)
    if rpdo.permille_at >= 0:
        drive.path.permille = signed_number(entry.data, rpdo.permille_at)
    drive.node.heard_ns = at_ns
    if rpdo.raw_at >= 0 or rpdo.permille_at >= 0:
        aim(drive, effects, at_ns)


@compiled
def receive(fleet: Any, lent: Any, entry: Any, at_ns: int) -> int:  # noqa: ANN401
    """Do with a frame what all drives do whose RPDO it is."""
    drives, effects, rpdos, _, _, _, _ = lent
    hearers = 0
    for place in range(fleet.rpdos):
        found = concerns(drives[rpdos[place].drive], rpdos[place], entry)
        if found < 0:
            return LEAVE
        hearers += found
    if not hearers:
        return LEAVE
    for place in range(fleet.rpdos):
        rpdo = rpdos[place]
        if rpdo.can_id == entry.can_id:
            hear(drives[rpdo.drive], rpdo, effects[rpdo.drive], entry, at_ns)
    return DONE


@compiled
def command(fleet: Any, drive: Any, motors: Any, axis: int, effect: Any) -> int:  # noqa: ANN401
    """Command the torque of a target whose time has come."""
    path, protection = drive.path, drive.protection
    demand = min(max(effect.target, path.low), path.high)
    torque = demand / (path.gain_positive if demand >= 0.0 else path.gain_negative)
    share = torque / protection.rated
    load = share * share
    if (demand != effect.target) != path.limited or load > TRIP_LOAD or abs(share) > protection.overcurrent:
        return LEAVE
    if torque != path.torque:
        if fleet.machine_ns != effect.at_ns:
            fleet.wanted_ns = effect.at_ns
            return ADVANCE
        path.torque = motors[3][axis] = torque
        if fleet.is_prompt:
            motors[2][axis] = torque
    path.demand = demand
    elapsed = (effect.at_ns - protection.warmed_ns) / NS_PER_S
    warmed = protection.load + (protection.warmth - protection.load) * math.exp(-elapsed / protection.time_constant)
    protection.warmth, protection.load, protection.warmed_ns = warmed, load, effect.at_ns
    return DONE


@compiled
def take_effect(fleet: Any, drive: Any, motors: Any, axis: int, effects: Any) -> int:  # noqa: ANN401
    """Let the first of a drive's targets take effect."""
    clock, node, at_ns = drive.clock, drive.node, effects[0].at_ns
    needed = command(fleet, drive, motors, axis, effects[0])
    if needed == DONE:
        clock.latency = min((at_ns - clock.last_sync_ns) // US, LATENCY_MAXIMUM)
        node.heard_ns = at_ns
        node.waiting -= 1
        for place in range(node.waiting):
            effects[place].at_ns, effects[place].target = effects[place + 1].at_ns, effects[place + 1].target
    return needed


@compiled
def next_effect(fleet: Any, drives: Any, effects: Any) -> int:  # noqa: ANN401
    """Whose target takes effect next; -1: nobody's waits."""
    found, due_ns = -1, NEVER_NS
    for axis in range(fleet.drives):
        if drives[axis].node.waiting and effects[axis, 0].at_ns < due_ns:
            found, due_ns = axis, effects[axis, 0].at_ns
    return found
