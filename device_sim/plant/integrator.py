"""The compiled integrator of the manipulator plant: `advance` carries its state over a stretch of time.

The state is always in one of three modes: all joints rest, one rests and two slide, all slide. Modes change at events
only, and a mode is left only towards one that its accelerations agree with, so nothing chatters. Should events still
crowd, joints are kept from giving way until the end of one step: friction may hold longer, energy never comes of it.
"""

from math import copysign

from torquerig.device_sim.plant.layout import (
    ALL,
    ANGLE,
    BREAKAWAY,
    CAUTION,
    CAUTIOUS,
    COULOMB,
    CROWD,
    DEMAND,
    ELBOW,
    EVENTS,
    LAG,
    LEAN,
    LEANING,
    NOBODY,
    POSITION,
    SIGN,
    STEP,
    STOPS,
    THETA,
    THETA_RATE,
    TORQUE,
    TORQUE_SEEN,
    TRUTH,
    VELOCITY,
)
from torquerig.device_sim.plant.motion import (
    Motion,
    Triple,
    acceleration,
    arrested,
    inside,
    net_torque,
    on_circle,
    stride,
)
from torquerig.device_sim.plant.motor import remaining_share, step_length
from torquerig.device_sim.plant.rest import first_motion, holding_time, resting_inertia, resting_joint
from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import Floats, leg_angles, leg_at, rows_of


@compiled
def let_torques_run(f: Floats, s: Floats, duration: float) -> None:
    """The torques after `duration` of their lag."""
    share = remaining_share(duration, f[LAG])
    for i in range(3):
        s[TORQUE + i] = s[DEMAND + i] + share * (s[TORQUE + i] - s[DEMAND + i])


@compiled
def motion_of(s: Floats) -> Motion:
    """Position and velocity out of the state."""
    return s[POSITION], s[POSITION + 1], s[VELOCITY], s[VELOCITY + 1]


@compiled
def holding_friction(p: Floats, f: Floats, s: Floats, joint: int) -> float:
    """The friction that would keep a joint at rest now [N·m]; its sign is the way the joint is pushed."""
    return acceleration(p, motion_of(s), net_torque(p, f, s, 1.0), joint)[2]


@compiled
def hold_or_slide(p: Floats, f: Floats, s: Floats, joint: int) -> None:
    """Stops one joint whose rate is zero; holds it if friction can, else sends it off the way it is pushed."""
    s[VELOCITY], s[VELOCITY + 1] = arrested(p, motion_of(s), joint)
    s[SIGN + joint] = 0.0
    needed = holding_friction(p, f, s, joint)
    if s[EVENTS] < CROWD and abs(needed) > f[BREAKAWAY + joint]:
        s[SIGN + joint] = copysign(1.0, needed)
    else:
        keep_elbow(p, s, joint)


@compiled
def keep_elbow(p: Floats, s: Floats, joint: int) -> None:
    """Notes where the held joint's elbow is: as long as it is held, the end-effector turns about it."""
    leg = leg_at(p, joint, s[POSITION], s[POSITION + 1])
    s[ELBOW] = s[POSITION] - leg[2]
    s[ELBOW + 1] = s[POSITION + 1] - leg[3]
    s[ANGLE] = leg_angles(p, joint, s[POSITION], s[POSITION + 1])[0]


@compiled
def settle(p: Floats, f: Floats, s: Floats) -> None:
    """Stops the machine: all joints rest; but where fewer than two have friction, none or that one only."""
    s[VELOCITY] = 0.0
    s[VELOCITY + 1] = 0.0
    rough = 0
    for i in range(3):
        if f[BREAKAWAY + i] > 0.0:
            rough += 1
    for i in range(3):
        s[SIGN + i] = 0.0 if rough >= 2 else 1.0
    for i in range(3):
        if rough == 1 and f[BREAKAWAY + i] > 0.0:
            hold_or_slide(p, f, s, i)


@compiled
def break_away(p: Floats, f: Floats, s: Floats, inertia: Triple) -> bool:
    """Decides which joints start to slide under the present torques; False if none does.

    The breakaway limits say which joints give way. Those then have Coulomb friction only, and if a joint that held
    cannot bear that, Coulomb friction decides for all three.
    """
    if not first_motion(p, s, inertia, (f[BREAKAWAY], f[BREAKAWAY + 1], f[BREAKAWAY + 2])):
        return False
    held = resting_joint(s)
    if held == NOBODY or abs(holding_friction(p, f, s, held)) > f[BREAKAWAY + held]:
        first_motion(p, s, inertia, (f[COULOMB], f[COULOMB + 1], f[COULOMB + 2]))
        held = resting_joint(s)
    if held != NOBODY:
        keep_elbow(p, s, held)
    return True


@compiled
def wait_for_load(p: Floats, f: Floats, s: Floats, longest: float) -> float:
    """Rests until friction gives way, at most for `longest`; returns the time spent."""
    inertia = resting_inertia(p, s)
    duration = min(longest, holding_time(p, f, s))
    let_torques_run(f, s, duration)
    if duration < longest and not (s[EVENTS] < CROWD and break_away(p, f, s, inertia)):
        pause = min(longest - duration, f[STEP])
        let_torques_run(f, s, pause)
        duration += pause
    return duration


@compiled
def slide(p: Floats, f: Floats, s: Floats, h: float) -> tuple[float, bool]:
    """Moves for `h`, or up to the first event; returns the time spent, and whether an event ended it."""
    held = resting_joint(s)
    motion, h, joint = stride(p, f, s, held, h)
    let_torques_run(f, s, h)
    if not inside(p, motion):
        s[STOPS] += 1.0 if s[LEANING] == 0.0 else 0.0
        s[LEANING] = LEAN
        settle(p, f, s)
        return h, False
    s[LEANING] = max(s[LEANING] - 1.0, 0.0)
    if held != NOBODY:
        motion = on_circle(p, s, motion)
    s[POSITION], s[POSITION + 1], s[VELOCITY], s[VELOCITY + 1] = motion
    if held != NOBODY:
        s[VELOCITY], s[VELOCITY + 1] = arrested(p, motion, held)
    if joint == NOBODY:
        return h, False
    if joint == held:
        s[SIGN + held] = copysign(1.0, holding_friction(p, f, s, held))
    elif held != NOBODY:
        settle(p, f, s)  # the second joint at rest: the machine stands
    else:
        hold_or_slide(p, f, s, joint)
    return h, True


@compiled
def look(p: Floats, s: Floats, seen: Floats) -> None:
    """Joint angles and rates as an encoder sees them: those of a resting joint do not move by a bit; and the truth."""
    for i in range(4):
        seen[TRUTH + i] = s[POSITION + i]
    held = resting_joint(s)
    for i in range(3):
        rows = rows_of(p, leg_at(p, i, s[POSITION], s[POSITION + 1]))
        seen[THETA + i] = leg_angles(p, i, s[POSITION], s[POSITION + 1])[0]
        seen[THETA_RATE + i] = rows[0] * s[VELOCITY] + rows[1] * s[VELOCITY + 1]
        seen[TORQUE_SEEN + i] = s[TORQUE + i]
    if NOBODY < held < ALL:
        seen[THETA + held] = s[ANGLE]
        seen[THETA_RATE + held] = 0.0


@compiled
def advance(p: Floats, f: Floats, s: Floats, seen: Floats, duration: float) -> None:
    """Carries the state over `duration` [s] at constant demands, and fills in what is then seen."""
    s[EVENTS] = 0.0
    while duration > 0.0:
        if resting_joint(s) == ALL:
            spent = wait_for_load(p, f, s, duration)
            event = resting_joint(s) != ALL
        else:
            change = max(abs(s[DEMAND] - s[TORQUE]), abs(s[DEMAND + 1] - s[TORQUE + 1]))
            change = max(change, abs(s[DEMAND + 2] - s[TORQUE + 2]))
            spent, event = slide(p, f, s, min(duration, s[CAUTION] * step_length(f[STEP], f[LAG], change)))
        s[EVENTS] = s[EVENTS] + 1.0 if event else 0.0
        s[CAUTION] = CAUTIOUS if event else min(2.0 * s[CAUTION], 1.0)
        duration -= spent
    look(p, s, seen)
