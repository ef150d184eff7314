"""Which procedures there are: a line each. Their modules are imported when they are called."""

import importlib
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from torquerig.calibrating.offer import Offer


class Entry(NamedTuple):
    """A procedure that is not imported yet.

    Attributes:
        module: The module whose `OFFER` it is.
        help: What it does, in one line.
    """

    module: str
    help: str


PROCEDURES: Final = {
    "direction": Entry(
        "torquerig.calibrating.direction", "Signs, wiring, gear and counts of each axis, by small pulses."
    ),
    "home": Entry("torquerig.calibrating.home", "Home in the fixture, and check it by the redundant leg."),
    "latency": Entry("torquerig.calibrating.latency", "From SYNC to TPDO, and from RPDO to torque."),
    "torque": Entry("torquerig.calibrating.torque", "Counts per N·m, by a locked rotor against a torque transducer."),
    "stiction": Entry("torquerig.calibrating.stiction", "The least torque that moves each joint, both ways."),
    "zeros": Entry("torquerig.calibrating.zeros", "Encoder zeros, by what makes the three legs close in a motion."),
    "identify": Entry(
        "torquerig.calibrating.identify", "Inertia and friction of the actuators, friction of the elbows."
    ),
}


def offer(name: str) -> "Offer":
    """A procedure of `PROCEDURES`, imported now."""
    found: Offer = importlib.import_module(PROCEDURES[name].module).OFFER
    return found
