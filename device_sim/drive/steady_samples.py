"""What drives in steady operation do with a SYNC, compiled: watchdogs, samples, TPDOs; see `steady_kernels`."""

import math
from typing import Any

import numpy as np

from torquerig.device_sim.drive.steady_memory import (
    ADVANCE,
    ASK,
    ASKED,
    DONE,
    EDGES,
    LEAVE,
    MISSED_MAXIMUM,
    POSITION,
    RAW_TORQUE,
    TORQUE,
    US,
    VELOCITY,
)
from torquerig.mechanism.compiled import compiled


@compiled
def as_signed(value: float, bits: int) -> int:
    """A rounded number, as an object with a sign holds it at most."""
    low, high = -(1 << (bits - 1)), (1 << (bits - 1)) - 1
    return int(min(max(np.rint(value), low), high))


@compiled
def wrapped(value: int) -> int:
    """A number as 32 bits with a sign hold it."""
    return ((value + 0x8000_0000) & 0xFFFF_FFFF) - 0x8000_0000


@compiled
def measured(gear: float, drive: Any, field: Any, motion: tuple[float, float, float]) -> int:  # noqa: ANN401
    """What a number of a TPDO is now."""
    encoder, path, source = drive.encoder, drive.path, field.source
    angle, rate, torque = motion
    if source in (POSITION, EDGES):
        edges = math.floor(gear * angle * encoder.counts_per_radian) - encoder.edge
        return wrapped(edges + encoder.shift if source == POSITION else edges)
    if source == VELOCITY:
        return wrapped(int(np.rint(gear * rate * encoder.counts_per_radian)))
    if source in (RAW_TORQUE, TORQUE):
        counts = torque * (path.gain_positive if torque >= 0.0 else path.gain_negative)
        return as_signed(counts if source == RAW_TORQUE else counts / path.counts_per_permille, 16)
    return int(field.value)


@compiled
def copy_frame(to: Any, frame: Any) -> None:  # noqa: ANN401
    """Make one frame the same as another."""
    to.can_id, to.length = frame.can_id, frame.length
    for byte in range(8):
        to.data[byte] = frame.data[byte]


@compiled
def say(fleet: Any, said: Any, tpdo: Any) -> None:  # noqa: ANN401
    """Add a TPDO to the frames to be sent, lower identifiers first, as arbitration would have it."""
    place = fleet.said
    while place > 0 and said[place - 1].can_id > tpdo.can_id:
        copy_frame(said[place], said[place - 1])
        place -= 1
    copy_frame(said[place], tpdo)
    fleet.said += 1


@compiled
def sample(fleet: Any, lent: Any, tpdo: Any) -> None:  # noqa: ANN401
    """Sample a TPDO."""
    drives, _, _, _, fields, _, (angle, rate, torque, _) = lent
    axis = tpdo.drive
    motion = angle[axis], rate[axis], torque[axis]
    for number in range(tpdo.first, tpdo.end):
        field = fields[number]
        value = measured(fleet.gear, drives[axis], field, motion)
        for byte in range(field.size):
            tpdo.data[field.at + byte] = value >> (8 * byte) & 0xFF


@compiled
def watch_sync(drive: Any, at_ns: int) -> None:  # noqa: ANN401
    """What the watchdogs, and the clock of the samples, make of a SYNC."""
    clock, watchdogs = drive.clock, drive.watchdogs
    clock.sample_time = (at_ns - clock.power_on_ns) // US
    if watchdogs.period_ns:
        gap_ns = at_ns - clock.last_sync_ns
        if gap_ns > watchdogs.period_ns:
            missed = watchdogs.missed + int(np.rint(gap_ns / watchdogs.period_ns)) - 1
            watchdogs.missed = min(missed, MISSED_MAXIMUM)
        if watchdogs.losses:
            watchdogs.deadline_ns = at_ns + watchdogs.losses * watchdogs.period_ns + 1
    clock.last_sync_ns = drive.node.heard_ns = at_ns
    drive.node.syncs += 1


@compiled
def what_sync_needs(fleet: Any, lent: Any, at_ns: int) -> int:  # noqa: ANN401
    """What is needed before a SYNC can be taken."""
    drives, _, _, tpdos, fields, _, (_, rate, _, _) = lent
    fleet.wanted_ns = at_ns
    if fleet.machine_ns != at_ns:
        return ADVANCE
    for axis in range(fleet.drives):
        if abs(fleet.gear * rate[axis]) > drives[axis].protection.overspeed:
            return LEAVE
    for place in range(fleet.tpdos):
        tpdo = tpdos[place]
        for number in range(tpdo.first, tpdo.end):
            if fields[number].source == ASKED and tpdo.syncs + 1 >= tpdo.every and fleet.asked_ns != at_ns:
                return ASK
    return DONE


@compiled
def synchronise(fleet: Any, lent: Any, at_ns: int) -> int:  # noqa: ANN401
    """Do with a SYNC what all drives do."""
    drives, _, _, tpdos, _, said, _ = lent
    needed = what_sync_needs(fleet, lent, at_ns)
    if needed != DONE:
        return needed
    for axis in range(fleet.drives):
        watch_sync(drives[axis], at_ns)
    for place in range(fleet.tpdos):
        tpdo = tpdos[place]
        tpdo.syncs += 1
        if tpdo.syncs >= tpdo.every:
            tpdo.syncs, tpdo.sent = 0, 1
            sample(fleet, lent, tpdo)
            say(fleet, said, tpdo)
    return DONE
