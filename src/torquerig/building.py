"""From the configuration's tables to the objects of mechanism and control."""

import math

from torquerig.control.errors import UnknownMotionError
from torquerig.control.estimators import Sampling, make_estimator
from torquerig.control.law import Gains, Law
from torquerig.control.laws import law_named
from torquerig.control.limits import Limits
from torquerig.control.loop import Controller, Pace
from torquerig.mechanism import Link, Manipulator
from torquerig.schema import Rig
from torquerig.schema_machines import Links, Model

MICROSECONDS_PER_SECOND = 1_000_000
THESIS_RATE_HZ = 250.0


def period_ns(rig: Rig) -> int:
    """The sampling period in whole microseconds, as the drives hold it (object 1006) [ns]."""
    return round(MICROSECONDS_PER_SECOND / rig.loop.rate_hz) * 1000


def manipulator(geometry: Model, links: Links) -> Manipulator:
    """A manipulator with one table's geometry and another's inertia and friction.

    Args:
        geometry: The model's table; the simulator's plants have its geometry too.
        links: The same table, or a plant's.

    Returns:
        The manipulator.
    """
    proximal = zip(links.proximal_mass, links.proximal_centre, links.proximal_inertia, strict=True)
    distal = zip(links.distal_mass, links.distal_centre, links.distal_inertia, strict=True)
    a1, a2, a3 = (Link(*constants) for constants in proximal)
    b1, b2, b3 = (Link(*constants) for constants in distal)
    return Manipulator(
        bases=geometry.bases,
        link_length=geometry.link_length,
        proximal=(a1, a2, a3),
        distal=(b1, b2, b3),
        actuator_inertia=links.actuator_inertia,
        active_viscous=links.active_viscous,
        passive_viscous=links.passive_viscous,
        gear_ratio=geometry.gear_ratio,
        branches=geometry.branches,
    )


def gains_motion(rig: Rig) -> int:
    """The test motion whose gains the law takes: as `loop.gains` says, or the motion's own, in other motions the first.

    The gains of motion 1 are the softer ones: where nobody has tuned them for a motion, they are the safer guess.
    """
    if rig.loop.gains != "auto":
        return rig.loop.gains
    return rig.loop.motion if isinstance(rig.loop.motion, int) else 1


def gains(rig: Rig) -> Gains:
    """The gains of `loop.law`: its own, or those that `laws.NAME` gives.

    Raises:
        UnknownMotionError: Neither the law nor the configuration has gains for the motion.
    """
    name, number = rig.loop.law, gains_motion(rig)
    changed = rig.laws.get(name)
    kp, kv = (None, None) if changed is None else (changed.of(number).kp, changed.of(number).kv)
    if kp is not None and kv is not None:
        return Gains(kp, kv)
    try:
        own = law_named(name).gains_for(number)
    except UnknownMotionError as error:
        raise UnknownMotionError(
            f"{error}: give kp and kv in [laws.{name}.motion{number}], or say in loop.gains whose to take"
        ) from error
    return Gains(own.kp if kp is None else kp, own.kv if kv is None else kv)


def law(rig: Rig, model: Manipulator) -> Law:
    """The law of `loop.law` with its gains."""
    chosen = law_named(rig.loop.law)
    kp, kv = gains(rig)
    wanted = rig.loop.friction_feedforward
    friction = chosen.friction_by_default if wanted == "law" else wanted
    return chosen(model, kp, kv, friction, rig.loop.stiction_feedforward)


def sampling(rig: Rig) -> Sampling:
    """How joint angles come: the period, and the count of the axis with the coarsest encoder."""
    counts = min(axis.encoder_counts * axis.gear for axis in rig.axes.legs)
    return Sampling(period_ns(rig), 2 * math.pi / counts)


def controller(rig: Rig) -> Controller:
    """Everything between a sample and a command, as `loop`, `laws`, `limits` and `model` say."""
    model = manipulator(rig.model, rig.model)
    estimator = make_estimator(rig.loop.estimator, 3, sampling(rig), **rig.estimators.get(rig.loop.estimator, {}))
    limits = Limits(
        x=rig.limits.workspace_x,
        y=rig.limits.workspace_y,
        conditioning=rig.limits.conditioning,
        singularity_distance=rig.limits.singularity_distance,
        joint_speed=rig.limits.joint_speed,
        position_error=rig.limits.position_error,
        torque=rig.limits.torque,
        torque_stop=rig.limits.torque_stop,
    )
    return Controller(model, estimator, law(rig, model), limits)


def pace(rig: Rig) -> Pace:
    """When torques leave after SYNC, as `loop.command_after` says.

    "auto" is the thesis' experiment at the thesis' rate: there the law's running time was the delay from sample to
    torque. At other rates, and for a law without a running time, torques leave as soon as they are computed.
    """
    after = rig.loop.command_after
    if after == "auto":
        return Pace(law_named(rig.loop.law).running_time_ns if rig.loop.rate_hz == THESIS_RATE_HZ else None)
    return Pace(None if after == "computed" else round(float(after) * 1e6))
