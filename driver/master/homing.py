"""Homing: the fixture's pose is written into the drives, which mark themselves as homed (CiA 402, homing mode).

Encoders start at zero wherever the machine stands. In the fixture the joint angles are known, so each drive gets its
position there as home offset (607C) and takes the current position for home (method 37). From then on its position is
absolute, until it loses power: the homed mark in its statusword says so, and whoever finds it homes nothing.
"""

from collections.abc import Sequence
from functools import partial
from typing import Final

from torquerig.driver.errors import NotHomed
from torquerig.driver.master.axis import Axis
from torquerig.driver.master.pump import name_drives
from torquerig.driver.master.sdo_jobs import Job
from torquerig.driver.master.session import DriveSession
from torquerig.driver.wire.cia402 import (
    HOMING_ATTAINED,
    HOMING_ERROR,
    HOMING_START,
    TARGET_REACHED,
    DriveState,
    OperationMode,
)

HOME_OFFSET: Final = 0x607C
HOMING_METHOD: Final = 0x6098
MODE: Final = 0x6060

_NEAR_REVOLUTIONS: Final = 0.05  # of the motor: how far from its place in the fixture a drive may stand
_OUTCOME: Final = HOMING_ERROR | HOMING_ATTAINED | TARGET_REACHED
_DONE: Final = HOMING_ATTAINED | TARGET_REACHED


def home_axes(session: DriveSession, positions: Sequence[int], *, anew: bool) -> bool:
    """Home the drives that are not homed yet.

    Args:
        session: The drives, none of them enabled.
        positions: Their positions in the fixture [count].
        anew: Home all of them.

    Returns:
        Whether one was homed.

    Raises:
        NotHomed: The machine does not stand in the fixture, a drive was homed to another position, or homing failed.
    """
    session.refresh()
    wanted = dict(zip(session.axes, positions, strict=True))
    homed = [] if anew else [axis for axis in session.axes if axis.is_homed]
    for axis in session.axes:
        if axis.settings.profile.homed_bit is None and not anew:
            raise NotHomed(
                f"drive {axis.node_id} cannot tell whether it was homed (its profile has no homed_bit): put"
                " the machine into the fixture and home it anew"
            )
    offsets = session.service.run({axis.node_id: axis.objects.read_number(HOME_OFFSET) for axis in homed})
    for axis in homed:
        if offsets[axis.node_id] != wanted[axis]:
            raise NotHomed(
                f"drive {axis.node_id} was homed to {offsets[axis.node_id]} counts (607C), where the settings say"
                f" {wanted[axis]}: put the machine into the fixture and home it anew"
            )
    rest = [axis for axis in session.axes if axis not in homed]
    if rest:
        _refuse_elsewhere(session, homed, rest, wanted)
        _home(session, rest, wanted)
    return bool(rest)


def _refuse_elsewhere(
    session: DriveSession, homed: Sequence[Axis], rest: Sequence[Axis], wanted: dict[Axis, int]
) -> None:
    """Raise when drives that know their position say that the machine is not in the fixture."""
    away = [axis for axis in homed if not _is_near(session, axis, wanted[axis])]
    if away:
        raise NotHomed(
            f"{name_drives([axis.node_id for axis in rest])} cannot be homed here, because by"
            f" {name_drives([axis.node_id for axis in away])} the machine does not stand in the fixture"
        )


def _home(session: DriveSession, axes: Sequence[Axis], wanted: dict[Axis, int]) -> None:
    session.service.run({axis.node_id: _prepare(axis, wanted[axis]) for axis in axes})
    session.walk(axes, {axis.node_id: OperationMode.HOMING for axis in axes})
    for axis in axes:
        axis.aim(DriveState.OPERATION_ENABLED, operation_bits=HOMING_START)
    session.refresh()  # what an earlier homing attained is still shown until this one has begun
    session.serve_until(partial(_is_over, session, axes))
    if session.watch.troubles:
        raise session.explain()
    failed = [axis for axis in axes if axis.statusword & _OUTCOME != _DONE]
    session.cut()
    session.serve_until(lambda: all(axis.is_disabled for axis in axes))
    session.service.run(
        {axis.node_id: axis.objects.write_verified(MODE, 0, axis.settings.profile.mode) for axis in axes}
    )
    if failed:
        raise NotHomed(f"{name_drives([axis.node_id for axis in failed])} did not attain home: {failed[0].state_words}")
    session.refresh()
    for axis in axes:
        if not _is_near(session, axis, wanted[axis]):
            raise NotHomed(
                f"drive {axis.node_id} says {session.exchange.position(axis)} counts after homing, not {wanted[axis]}"
            )
        if axis.settings.profile.homed_bit is not None and not axis.is_homed:
            raise NotHomed(f"drive {axis.node_id} does not mark itself as homed: {axis.state_words}")


def _prepare(axis: Axis, position: int) -> Job[None]:
    yield from axis.objects.write_verified(HOME_OFFSET, 0, position)
    yield from axis.objects.write_verified(HOMING_METHOD, 0, axis.settings.profile.homing_method)
    yield from axis.objects.write_verified(MODE, 0, OperationMode.HOMING)


def _is_over(session: DriveSession, axes: Sequence[Axis]) -> bool:
    return bool(session.watch.troubles) or all(
        bool(axis.statusword & HOMING_ERROR) or axis.statusword & _DONE == _DONE for axis in axes
    )


def _is_near(session: DriveSession, axis: Axis, position: int) -> bool:
    counts = axis.settings.counts_per_revolution or axis.settings.profile.counts_per_revolution or 0
    return abs(session.exchange.position(axis) - position) <= _NEAR_REVOLUTIONS * counts
